"""From a measured angle to the simulated state: exact at states, monotone between, nothing beyond."""

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.report.motion_files import read_motion
from mu_addon.simulate_and_place.poses import poses

from .bent_motion import ANGLES, PRESSURES, write_bent_motion


@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bent")
    write_bent_motion(folder)
    return read_motion(folder)


def test_states_are_met_and_the_ends_are_the_ends(motion):
    found = poses(motion)
    np.testing.assert_allclose(found.angle_deg, ANGLES, atol=1e-3)
    assert found.range_deg == pytest.approx((-16.0, 50.0), abs=1e-3)
    for angle, pressure in zip(found.angle_deg, PRESSURES, strict=True):
        first, second, share = found.at(angle)
        state = second if share > 0.5 else first
        assert motion.state_kPa[state] == pytest.approx(pressure)
        assert min(share, 1 - share) == pytest.approx(0.0, abs=1e-9)
        assert found.pressure_at(angle) == pytest.approx(pressure)
    low, high = found.range_deg
    for beyond in (low - 1e-6, high + 1e-6, np.nan, np.inf):
        assert found.at(beyond) is None
        assert np.isnan(found.pressure_at(beyond))


def test_the_pose_bends_as_far_as_it_was_asked_to(motion):
    """Straight between states up to 14 degrees apart, the tip still turns as asked."""
    found = poses(motion)
    off = []
    for angle in np.linspace(*found.range_deg, 67):
        first, second, weight = found.at(angle)
        u = (1 - weight) * motion.model_a[first].astype(float) + weight * motion.model_a[second]
        off.append(bending_angle_deg(motion.mesh, u) - angle)
    assert np.abs(off).max() < 0.02


def test_where_the_angle_turns_back_the_twin_ends(motion):
    """Beyond a limit point an angle belongs to two states: only the branch about rest is shown."""
    back = motion.model_a.copy()
    back[6], back[0] = motion.model_a[4], motion.model_a[1] * 0.5
    found = poses(attrs.evolve(motion, model_a=back))
    assert found.range_deg == pytest.approx((-9.0, 38.0), abs=1e-3)
    assert found.state.tolist() == [1, 2, 3, 4, 5]
    assert found.pressure_at(38.0 - 1e-3) == pytest.approx(30.0, abs=0.1)


def test_a_unit_that_does_not_bend_has_no_twin(motion):
    with pytest.raises(InputError, match="does not bend"):
        poses(attrs.evolve(motion, model_a=np.zeros_like(motion.model_a)))
