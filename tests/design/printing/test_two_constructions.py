"""The Boolean solid against one by signed distances."""

import numpy as np
import pytest
from scipy.ndimage import label

from mu_addon.design.profile import cavity_volume

from .parts import small_solid, small_unit
from .signed_distance import field, topology


def test_topology_of_known_bodies():
    n = np.arange(-14, 15) + 0.13
    x, y, z = np.meshgrid(n, n, n, indexing="ij")
    ball = np.sqrt(x * x + y * y + z * z)
    torus = np.hypot(np.hypot(x, y) - 8.0, z)
    assert topology(ball < 9) == (1, 0, 0)
    assert topology((ball < 9) & (ball > 5)) == (1, 1, 0)
    assert topology(torus < 3) == (1, 0, 1)
    assert topology((torus < 3) | (np.hypot(np.hypot(x, z) - 8.0, y) < 3)) == (1, 0, 3)
    assert topology((torus < 3) | (ball < 2)) == (2, 0, 1)


def test_the_solid_by_signed_distances_is_the_same_body():
    unit, step = small_unit(), 0.25
    d = unit.dimensions
    distance, (x, y, z) = field(unit, step)
    gates = small_solid().gates
    assert topology(distance < 0.0) == (gates.components, 0, gates.genus)

    # The inlet stopped halfway, what it seals off is one cavity.
    stopped = distance < 0.0
    bore = np.hypot(*np.meshgrid(x, y, indexing="ij")) < d.inlet_radius + 0.5 * d.inlet_wall
    stopped[np.ix_(range(len(x)), range(len(y)), np.flatnonzero(z < -0.5 * d.inlet_length))] |= bore[
        :, :, None
    ]
    rooms, count = label(~stopped)
    assert count == 2
    sealed = rooms == rooms[np.abs(x).argmin(), np.abs(y).argmin(), len(z) // 2]
    volume = np.count_nonzero(sealed) * step**3
    assert volume == pytest.approx(gates.inner_volume_mm3, rel=0.01)
    bored = np.pi * d.inlet_radius**2 * (d.base_cap + 0.5 * d.inlet_length)
    assert volume == pytest.approx(cavity_volume(d) + bored, rel=0.01)
