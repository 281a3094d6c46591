"""Bars between joints: their stiffness by closed forms, and what moves with them does not strain them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mu_addon.resolved.response import _frame, _natural, _stiffness


def test_an_even_beam_has_the_stiffness_of_the_textbook():
    t = np.linspace(0.0, 1.0, 101)
    found = _stiffness(t, np.full(101, 3.0), np.full(101, 5.0), np.full(101, 7.0), 2.0)
    assert found[0, 0] == pytest.approx(1.5)
    assert found[1, 1] == pytest.approx(2.5)
    expected = 3.5 * np.array([[4.0, 2.0], [2.0, 4.0]])
    np.testing.assert_allclose(found[2:4, 2:4], expected, rtol=1e-3)
    np.testing.assert_allclose(found[4:, 4:], expected, rtol=1e-3)


def test_a_beam_with_rigid_ends_is_stiffer_as_the_textbook_has_it():
    """Livesley: with a share r rigid at either end, l = 1 - 2 r clear, the ends' stiffness is of the third power."""
    r = 0.1
    clear = 1.0 - 2.0 * r
    t = np.linspace(r, 1.0 - r, 401)
    found = _stiffness(t, np.full(401, 3.0), np.full(401, 5.0), np.full(401, 7.0), 2.0)
    assert found[0, 0] == pytest.approx(1.5 / clear)
    # Ends that turn alike bend the beam's middle in an S, with the force that moves its clear part aside.
    alike = found[2:4, 2:4].sum()
    assert alike == pytest.approx(12.0 * 3.5 / clear**3, rel=1e-4)
    # Ends that turn against each other bend it evenly.
    against = found[2, 2] + found[3, 3] - 2.0 * found[2, 3]
    assert against == pytest.approx(4.0 * 3.5 / clear, rel=1e-4)


def moved_bar(seed):
    rng = np.random.default_rng(seed)
    ends = rng.normal(size=(2, 3))
    return _frame(ends[1] - ends[0]), float(np.linalg.norm(ends[1] - ends[0])), ends, rng


def test_a_rigid_motion_strains_no_bar():
    frame, length, ends, _ = moved_bar(1)
    turn = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
    found, _ = _natural(frame, length, ends @ turn.T + [3.0, 1.0, -2.0], np.array([turn, turn]))
    assert np.abs(found).max() < 1e-12


def test_slopes_are_those_of_the_bar_s_deformation():
    """Of a bar moved and turned far, strained little, as a stiff one is."""
    frame, length, ends, rng = moved_bar(2)
    turn = Rotation.from_rotvec([0.7, -0.4, 1.1])
    place, turns = ends @ turn.as_matrix().T, np.array([turn.as_matrix()] * 2)
    _, slopes = _natural(frame, length, place, turns)
    step = 1e-6 * rng.normal(size=12)

    def at(sign):
        shift = sign * np.stack([step[:3], step[6:9]])
        spins = Rotation.from_rotvec(sign * np.stack([step[3:6], step[9:]])).as_matrix()
        return _natural(frame, length, place + shift, spins @ turns)[0]

    np.testing.assert_allclose((at(1) - at(-1)) / 2.0, slopes @ step, atol=1e-12)
