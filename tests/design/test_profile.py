import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from mu_addon.design import profile
from mu_addon.design.parameters import Chambers, Unit, load_preset

from .units import units

PRESETS = ("mu-0.75x", "mu-1.0x", "mu-1.5x")
T = np.linspace(0.0, 1.0, 33)


def quadratic(arc):
    return (1 - T)[:, None] ** 2 * arc[0] + 2 * (T * (1 - T))[:, None] * arc[1] + T[:, None] ** 2 * arc[2]


def cubic(arc):
    t = T[:, None]
    return (1 - t) ** 3 * arc[0] + 3 * t * (1 - t) ** 2 * arc[1] + 3 * t**2 * (1 - t) * arc[2] + t**3 * arc[3]


def turn(u, v):
    return u[0] * v[1] - u[1] * v[0]


def distance(d, point):
    """Distance from a point (radius, z) to the outer profile, by search, with nothing of the code tested."""
    z = np.linspace(point[1] - 1.5 * d.wall, point[1] + 1.5 * d.wall, 401)
    gap = np.hypot(parabolas(d, z) - point[0], z - point[1])
    near = z[gap.argmin()]
    step = z[1] - z[0]
    found = minimize_scalar(
        lambda s: np.hypot(parabolas(d, s) - point[0], s - point[1]),
        bounds=(near - step, near + step),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return found.fun


def parabolas(d, z):
    """The profile written once more, plainly."""
    u = np.abs((np.asarray(z) % d.cell) - d.cell / 2)
    joint = (d.R * d.b + d.r * d.a) / (d.a + d.b)
    return np.where(
        u <= d.a, d.R - (d.R - joint) * (u / d.a) ** 2, d.r + (joint - d.r) * ((d.cell / 2 - u) / d.b) ** 2
    )


@given(units(), st.floats(0.0, 1.0))
@settings(max_examples=60)
def test_profile_is_the_parabolas(unit, t):
    d = unit.dimensions
    z = np.append(d.height * np.linspace(0, 1, 50), d.height * t)
    assert profile.outer_radius(d, z) == pytest.approx(parabolas(d, z), abs=1e-9 * d.R)


@given(units())
@settings(max_examples=60)
def test_profile_is_c1(unit):
    d = unit.dimensions
    joints = np.concatenate([np.arange(d.count) * d.cell + d.b, (np.arange(d.count) + 1) * d.cell - d.b])
    step = 1e-7 * d.cell
    for f, size in ((profile.outer_radius, d.R), (profile.outer_slope, 4 * (d.R - d.r) / d.cell)):
        jump = f(d, joints + step) - f(d, joints - step)
        assert np.abs(jump).max() < 1e-5 * size
    assert profile.outer_radius(d, joints) == pytest.approx(d.joint_radius)
    apices, necks = (np.arange(d.count) + 0.5) * d.cell, np.arange(d.count + 1) * d.cell
    assert profile.outer_radius(d, apices) == pytest.approx(d.R)
    assert profile.outer_radius(d, necks) == pytest.approx(d.r)
    assert np.abs(profile.outer_slope(d, np.append(apices, necks))).max() < 1e-9 * size


def test_slope_is_the_derivative():
    d = Unit().dimensions
    z = np.linspace(0.3, d.height - 0.3, 200)
    finite = (profile.outer_radius(d, z + 1e-6) - profile.outer_radius(d, z - 1e-6)) / 2e-6
    assert profile.outer_slope(d, z) == pytest.approx(finite, abs=1e-5)


@given(units())
@settings(max_examples=15)
def test_cavity_lies_one_wall_inside(unit):
    d = unit.dimensions
    z = np.linspace(d.base_cap, d.height - d.tip_cap, 9)
    for point in zip(profile.cavity_radius(d, z), z, strict=True):
        assert distance(d, point) == pytest.approx(d.wall, rel=1e-6)


@pytest.mark.parametrize("name", PRESETS)
def test_outer_arcs_are_exact_and_joined(name):
    d = load_preset(name).dimensions
    arcs = profile.outer_arcs(d)
    assert len(arcs) % (4 * d.count) == 0
    assert arcs[0][0] == pytest.approx([d.r, 0.0])
    assert arcs[-1][-1] == pytest.approx([d.r, d.height])
    for before, after in itertools.pairwise(arcs):
        assert before[-1] == pytest.approx(after[0], abs=1e-12)
        assert turn(before[2] - before[1], after[1] - after[0]) == pytest.approx(0.0, abs=1e-10)
    points = np.concatenate([quadratic(arc) for arc in arcs])
    assert points[:, 0] == pytest.approx(parabolas(d, points[:, 1]), abs=1e-11)


@pytest.mark.parametrize(
    "unit",
    [
        *(load_preset(name) for name in PRESETS),
        Unit(chambers=Chambers(wall_mm=1.874)),
        Unit(scale=4.0, chambers=Chambers(neck_diameter_mm=6.0, wall_mm=0.7, inlet_wall_mm=1.0)),
    ],
    ids=[*PRESETS, "at the limit", "large and deep"],
)
def test_inner_arcs_keep_the_wall(unit):
    d = unit.dimensions
    inner, outer = profile.inner_arcs(d), profile.outer_arcs(d)
    assert len(inner) == len(outer)
    for arc, mate in zip(inner[: len(inner) // d.count], outer, strict=False):
        for end in (0, -1):  # the ends and their tangents are exact
            assert np.linalg.norm(arc[end] - mate[end]) == pytest.approx(d.wall, rel=1e-12)
            tangent, outer_tangent = (a[1 if end == 0 else -2] - a[end] for a in (arc, mate))
            if np.linalg.norm(tangent) > 1e-9:
                sine = turn(tangent, outer_tangent) / np.linalg.norm(tangent) / np.linalg.norm(outer_tangent)
                assert sine == pytest.approx(0.0, abs=1e-9)
        worst = max(abs(distance(d, point) - d.wall) for point in cubic(arc)[2:-2])
        assert worst < 1e-3


@given(units())
@settings(max_examples=15)
def test_cavity_arcs_run_from_cap_to_cap(unit):
    d = unit.dimensions
    arcs = profile.cavity_arcs(d)
    assert arcs[0][0, 1] == d.base_cap
    assert arcs[-1][-1, 1] == d.height - d.tip_cap
    for before, after in itertools.pairwise(arcs):
        assert before[-1] == pytest.approx(after[0], abs=1e-9)
    points = np.concatenate([cubic(arc) for arc in arcs])
    assert (np.diff(points[:, 1]) > -1e-9).all()
    slope = profile.outer_slope(d, points[:, 1])
    off = np.abs(points[:, 0] - profile.cavity_radius(d, points[:, 1]))
    assert off.max() < 1e-3 * np.sqrt(1 + np.abs(slope).max() ** 2) * 2


@pytest.mark.parametrize("name", PRESETS)
def test_volumes_match_an_independent_quadrature(name):
    d = load_preset(name).dimensions

    def area(z):
        return np.pi * float(profile.cavity_radius(d, z)) ** 2

    knots = [d.b, d.cell / 2, d.cell - d.b]
    # One period's kinks lie at the offsets of its joints.
    slope = float(profile.outer_slope(d, d.b))
    shift = d.wall * slope / np.sqrt(1 + slope**2)
    knots = [d.b + shift, d.cell / 2, d.cell - d.b - shift]
    period = quad(area, 0, d.cell, points=knots, epsabs=1e-9, epsrel=1e-12, limit=200)[0]
    caps = quad(area, 0, d.base_cap, epsrel=1e-12)[0] + quad(area, 0, d.tip_cap, epsrel=1e-12)[0]
    cavity = d.count * period - caps
    assert profile.cavity_volume(d) == pytest.approx(cavity, rel=1e-10)

    outer = d.count * quad(lambda z: np.pi * parabolas(d, z) ** 2, 0, d.cell, points=[d.b, d.cell - d.b])[0]
    assert profile.outer_volume(d) == pytest.approx(outer, rel=1e-10)
    assert profile.membrane_volume(d) == pytest.approx(outer - cavity, rel=1e-9)


@given(units(), st.integers(1, 12))
@settings(max_examples=30)
def test_polygons_are_inscribed_sections(unit, per_arc):
    d = unit.dimensions
    outer, cavity = profile.outer_polygon(d, per_arc), profile.cavity_polygon(d, per_arc)
    assert outer[1:-1, 0] == pytest.approx(parabolas(d, outer[1:-1, 1]), rel=1e-9)
    assert cavity[1, 1] == d.base_cap
    assert cavity[-2, 1] == d.height - d.tip_cap
    for polygon in (outer, cavity):
        assert (np.diff(polygon[1:-1, 1]) > 0).all()
        assert (polygon[1:-1, 0] > 0).all()
        assert polygon[[0, -1], 0].tolist() == [0.0, 0.0]
