import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.anchors import SHORTEST, anchor_points, window, windows
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Envelope, Unit, Waveguide, load_preset
from mu_addon.errors import InputError

from .units import units


@given(units())
@settings(max_examples=40)
def test_lattice_is_lattice_of(unit):
    d = unit.dimensions
    lattice = lattice_of(d)
    nx, ny, nz = d.cells_x, d.cells_y_minus + 1 + d.cells_y_plus, d.count
    assert lattice.is_centre.sum() == nx * ny * nz
    assert (~lattice.is_centre).sum() == (nx + 1) * (ny + 1) * (nz + 1)
    assert len(lattice.struts) == 8 * nx * ny * nz
    assert len(np.unique(np.rint(lattice.nodes / d.cell * 4).astype(int), axis=0)) == len(lattice.nodes)
    ends = lattice.nodes[lattice.struts]
    assert np.abs(ends[:, 1] - ends[:, 0]) == pytest.approx(np.full((len(ends), 3), d.cell / 2))
    assert lattice.is_centre[lattice.struts].tolist() == [[True, False]] * len(ends)
    low, high = np.array(d.bounds).T
    assert lattice.nodes.min(axis=0) == pytest.approx(low)
    assert lattice.nodes.max(axis=0) == pytest.approx(high)


def test_nodes_coincide_with_the_bladder_apices():
    d = load_preset("mu-1.0x").dimensions
    nodes = {tuple(node) for node in np.round(lattice_of(d).nodes, 9)}
    for k in range(6):
        z = (k + 0.5) * d.cell
        for apex in ((d.R, 0.0, z), (-d.R, 0.0, z), (0.0, d.R, z), (0.0, -d.R, z)):
            assert apex in nodes


def test_cycles_of_the_paper_unit():
    lattice = lattice_of(
        Unit(lattice=Envelope(cells_y_plus=1, allow_symmetric=True), waveguide=Waveguide(row=1)).dimensions
    )
    assert (len(lattice.struts), len(lattice.nodes), lattice.cycles) == (432, 166, 267)
    assert lattice_of(Unit().dimensions).cycles == 576 - 212 + 1


@given(st.integers(3, 30))
def test_windows_count_and_order(n):
    every = windows(n)
    assert len(every) == (n - 2) * (n - 1) // 2
    assert [w.name for w in every] == [f"alpha{i}" for i in range(1, len(every) + 1)]
    assert [(w.length, w.start) for w in every] == sorted({(w.length, w.start) for w in every})
    for w in every:
        assert w.length >= SHORTEST
        assert w.indices[0] >= 0
        assert w.indices[-1] < n
        assert len(w.indices) == w.length


def test_the_papers_ten_windows():
    expected = [(1, 3), (2, 3), (3, 3), (4, 3), (1, 4), (2, 4), (3, 4), (1, 5), (2, 5), (1, 6)]
    assert [(w.start, w.length) for w in windows(6)] == expected
    assert window(Unit(), "alpha4").indices == range(3, 6)
    with pytest.raises(InputError, match="no path 'alpha11'"):
        window(Unit(), "alpha11")


@given(units())
@settings(max_examples=40)
def test_anchors_are_lattice_centres_in_the_bending_plane(unit):
    d, points = unit.dimensions, anchor_points(unit)
    assert points.shape == (d.count, 3)
    lattice = lattice_of(d)
    for point in points:
        gap = np.linalg.norm(lattice.nodes - point, axis=1)
        assert gap.min() < 1e-9 * d.cell
        assert lattice.is_centre[gap.argmin()]
    assert (points[:, 0] == 0).all()
    assert np.diff(points[:, 2]) == pytest.approx(d.cell)
