"""Geometrically exact beams: derivatives, frame indifference, closed forms and published answers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mu_addon.fem.beams import Beams, Sections, frames_along, sections_of
from mu_addon.fem.rotations import rotation

from .derivatives import assert_beams_consistent

RNG = np.random.default_rng(5)


def some(count=6):
    """Beams of any stiffness, in any direction."""
    values = [RNG.uniform(0.5, 2.0, count) for _ in range(5)]
    values[3] *= 0.1
    chord = RNG.normal(size=(count, 3))
    return Beams(chord, frames_along(chord), Sections(*values))


def along(points, area, inertia, torsion, young, poisson=0.0, shear=np.inf):
    """Even beams through points (n, 3), each of n - 1 chords one element."""
    chord = np.diff(points, axis=0)
    length = np.linalg.norm(chord, axis=1)
    ones = np.ones(len(chord))
    flexible = np.column_stack(
        [
            length / area,
            length * 2 * (1 + poisson) / (2 * (1 + poisson)) / torsion,
            length / inertia,
            0 * ones,
            length**3 / (12 * inertia),
            length / shear,
        ]
    )
    return Beams(chord, frames_along(chord), sections_of(length, flexible, young * ones, poisson * ones))


def bent(beams, load, steps, fixed=6):
    """Unknowns (n, 6) of a chain of beams, clamped at its first node, under a load (6,) on its last node."""
    count = len(beams.chord) + 1
    x = np.zeros((count, 6))
    own = np.array([np.r_[6 * e : 6 * e + 12] for e in range(len(beams.chord))])
    for step in range(1, steps + 1):
        for _ in range(60):
            elements = x.ravel()[own]
            force = np.bincount(own.ravel(), beams.forces(elements).ravel(), 6 * count)
            force[-6:] -= load * step / steps
            tangent = np.zeros((6 * count, 6 * count))
            for rows, block in zip(own, beams.stiffness(elements), strict=True):
                tangent[np.ix_(rows, rows)] += block
            change = np.linalg.solve(tangent[fixed:, fixed:], force[fixed:])
            x.ravel()[fixed:] -= change
            if np.abs(change).max() < 1e-7 * np.abs(x).max():
                break
        else:
            pytest.fail(f"no equilibrium at {step} of {steps}")
    return x


@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.05, 0.4, 1.5])
def test_forces_are_the_slope_of_the_energy_and_stiffness_that_of_the_forces(size):
    assert_beams_consistent(some(20), size * RNG.normal(size=(20, 12)))


@given(
    st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3), st.lists(st.floats(-9, 9), min_size=3, max_size=3)
)
def test_a_rigid_motion_changes_no_energy(turn, shift):
    beams = some()
    x = 0.4 * RNG.normal(size=(6, 12))
    rigid = Rotation.from_rotvec(turn)
    start = RNG.normal(size=(6, 3))
    moved = []
    for place, own in ((start, x[:, :6]), (start + beams.chord, x[:, 6:])):
        after = rigid.apply(place + own[:, :3]) + shift
        moved += [after - place, (rigid * Rotation.from_rotvec(own[:, 3:])).as_rotvec()]
    np.testing.assert_allclose(beams.energy_mJ(np.hstack(moved)), beams.energy_mJ(x), rtol=1e-9, atol=1e-12)


def test_rotation_vectors_turn_as_scipy_turns():
    vectors = RNG.normal(size=(30, 3)) * np.logspace(-9, 0.4, 30)[:, None]
    np.testing.assert_allclose(rotation(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-14)


def test_an_end_moment_rolls_a_cantilever_into_half_a_circle():
    points = np.outer(np.linspace(0, 10, 11), [1.0, 0, 0])
    beams = along(points, area=1e3, inertia=1.0, torsion=2.0, young=1.0)
    x = bent(beams, np.r_[0, 0, 0, 0, 0, np.pi / 10], steps=20)
    assert x[-1, 5] == pytest.approx(np.pi, rel=1e-3)
    # Ten chords of an arc, not the arc itself.
    assert points[-1, 0] + x[-1, 0] == pytest.approx(0.0, abs=1e-2)
    assert x[-1, 1] == pytest.approx(2 * 10 / np.pi, rel=5e-3)


@pytest.mark.parametrize(
    ("load", "across", "along_it"),
    # Tip of an inextensible cantilever under P = load E I/L^2 across it: Mattiasson, Int. J. Numer. Methods
    # Eng. 17 (1981) 145, table I.
    [(1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763), (10.0, 0.81061, 0.55500)],
)
def test_the_elastica(load, across, along_it):
    points = np.outer(np.linspace(0, 1, 41), [0.0, 0, 1.0])
    beams = along(points, area=1e4, inertia=1.0, torsion=2.0, young=1.0)
    x = bent(beams, np.r_[load, 0, 0, 0, 0, 0], steps=60)
    assert x[-1, 0] == pytest.approx(across, rel=3e-3)
    assert -x[-1, 2] == pytest.approx(along_it, rel=3e-3)


def test_a_bent_cantilever_leaves_its_plane_as_bathe_and_bolourchi_have_it():
    # 45 degrees of a circle of radius 100, section 1 x 1, E 1e7, no lateral strain, 600 at the tip: Int. J.
    # Numer. Methods Eng. 14 (1979) 961: 15.9, 47.2, 53.4. Simo and Vu-Quoc (1986): 15.79, 47.23, 53.37;
    # Crisfield (1990): 15.61, 46.84, 53.71.
    angle = np.linspace(0, np.pi / 4, 17)
    points = 100 * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    beams = along(points, area=1.0, inertia=1 / 12, torsion=0.1406, young=1e7, shear=5 / 6)
    x = bent(beams, np.r_[0, 0, 600.0, 0, 0, 0], steps=6)
    tip = points[-1] + x[-1, :3]
    low, high = [15.5, 46.8, 53.3], [15.95, 47.3, 53.75]
    assert (np.array(low) < tip[[1, 0, 2]]).all()
    assert (tip[[1, 0, 2]] < np.array(high)).all()


def test_a_tapered_cantilever_is_exact_with_one_element():
    # Diameter from 2 to 1 over 10: by Castigliano's theorem, integrated with 4000 points.
    s = (np.arange(4000) + 0.5) / 400
    radius = 1.0 - 0.05 * s
    inertia, area = np.pi * radius**4 / 4, np.pi * radius**2
    off, w = s - 5.0, 1 / 400
    rows = [1 / area, 0.5 / inertia, 1 / inertia, off / inertia, off**2 / inertia, 1 / area]
    flexible = np.array([[w * row.sum() for row in rows]])
    chord = np.array([[0.0, 0.0, 10.0]])
    young, poisson = np.array([3.0]), np.array([0.3])
    beams = Beams(chord, frames_along(chord), sections_of(np.array([10.0]), flexible, young, poisson))
    x = bent(beams, np.r_[1e-7, 0, 0, 0, 0, 0], steps=1)
    sheared = 1 / (0.9 * 3.0 / 2.6 * area)
    expected = 1e-7 * w * ((10 - s) ** 2 / (3.0 * inertia) + sheared).sum()
    assert x[-1, 0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("stretch", [0.3, 0.7, 1.8])
def test_a_pulled_or_pressed_rod_is_an_incompressible_neo_hookean_one(stretch):
    """F = E A (l - 1/l^2)/3, down to a third of its length, too."""
    area, young = 0.7, 2.0
    beams = along(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]), area, 0.3, 0.6, young)
    x = np.zeros((1, 12))
    x[0, 8] = 5.0 * (stretch - 1.0)
    axial, _ = beams.end_loads(x)
    assert axial == pytest.approx([young * area * (stretch - stretch**-2) / 3])


@pytest.mark.parametrize("way", [[0, 0, 10.0], [3.0, -4.0, 5.0]])
def test_end_loads_of_a_tapered_cantilever_are_those_of_statics(way):
    way = np.array(way)
    length, axis = np.linalg.norm(way), way / np.linalg.norm(way)
    # Integrals of some taper, thicker at its clamped end.
    flexible = np.array([[4.0, 9.0, 30.0, 20.0, 300.0, 4.0]])
    beams = Beams(
        way[None], frames_along(way[None]), sections_of(np.array([length]), flexible, np.array([2.0]), 0.45)
    )
    across, pull = 1e-5 * np.cross(axis, [1.0, 2.0, 3.0]), 2e-5
    x = bent(beams, np.r_[across + pull * axis, np.zeros(3)], 1)
    axial, moments = beams.end_loads(x.reshape(1, -1))
    assert axial == pytest.approx([pull], rel=5e-3)
    assert np.linalg.norm(moments[0, 0]) == pytest.approx(length * np.linalg.norm(across), rel=1e-3)
    assert np.linalg.norm(moments[0, 1]) < 1e-3 * np.linalg.norm(moments[0, 0])
