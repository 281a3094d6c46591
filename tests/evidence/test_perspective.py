"""A camera that looks at an angle: what it makes of places and angles, and whether it is told from a unit."""

import math

import numpy as np
import pytest

from mu_addon.evidence.diagnosis import diagnose
from tests.evidence import analytic
from tests.evidence.bench import read_by_camera

HALF_mm = 37.5
PLACE = ("marker1_y_mm", "marker1_z_mm")


def pinhole(y, z, turn_deg, about, lengths=3.0):
    """Places in mm about the middle of the plane x = 0, seen by a pinhole so many unit lengths away.

    The plane is turned by rotation matrices, about the axis across ("y") or the unit's own ("z").
    """
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    turn = {"y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "z": [[c, s, 0], [-s, c, 0], [0, 0, 1]]}[about]
    depth, y, z = np.array(turn) @ np.stack([0.0 * y, y, z])
    away = 2.0 * HALF_mm * lengths
    return y * away / (away + depth), z * away / (away + depth)


def seen(y, z, values):
    """Places in mm about the middle, as the evidence's camera reads them."""
    found = read_by_camera(PLACE, np.stack([y, z + HALF_mm]), np.zeros(len(y)), 1.0, values)
    return found[0], found[1] - HALF_mm


SQUARE = np.array([[-30.0, 30.0, 30.0, -30.0, 0.0], [-30.0, -30.0, 30.0, 30.0, 30.0]])


@pytest.mark.parametrize(("about", "way"), [("y", "along"), ("z", "across")])
def test_keystone_is_a_pinhole_s_to_first_order_of_the_angle(about, way):
    """What is left of a square falls with the square of the angle, and is small beside what is told."""
    left = []
    for degrees in (4.0, 2.0):
        k = math.sin(math.radians(degrees)) / 6.0
        true = np.stack(pinhole(*SQUARE, degrees, about))
        ours = np.stack(seen(*SQUARE, {f"camera_perspective.{way}": k}))
        left.append(np.abs(ours - true).max())
        assert left[-1] < 0.25 * np.abs(true - SQUARE).max()
    assert left[1] == pytest.approx(left[0] / 4.0, rel=0.05)


@pytest.mark.parametrize(("about", "farther_deg"), [("y", 90.0), ("z", 0.0)])
def test_the_whole_law_is_a_pinhole_s_at_any_angle(about, farther_deg):
    values = {"view_deg": 25.0, "farther_deg": farther_deg, "lengths_away": 2.0}
    ours = seen(*SQUARE, {f"camera_perspective.{k}": v for k, v in values.items()})
    np.testing.assert_allclose(ours, pinhole(*SQUARE, 25.0, about, 2.0), atol=1e-9)


@pytest.mark.parametrize(
    "values",
    [
        {"along": 0.05},
        {"across": -0.05},
        {"view_deg": 20.0, "farther_deg": 60.0, "lengths_away": 2.0},
        {"across": 0.03, "lens": 0.02},
    ],
)
def test_perspective_turns_the_angle_as_it_moves_two_points_of_the_tip(values):
    """Of an arc drawn point by point, read as places, and measured at its end."""
    named = {f"camera_perspective.{k}": v for k, v in values.items() if k != "lens"}
    named["lens_distortion.at_tip"] = values.get("lens", 0.0)
    for degrees in (-80.0, 0.0, 5.0, 60.0):
        s = np.linspace(0.0, 1.0, 20001)
        angle = np.radians(degrees) * s
        y, z = (np.cumsum(f(angle)) * 2.0 * HALF_mm / len(s) for f in (np.sin, np.cos))
        y, z = seen(y, z - HALF_mm, named)
        expected = math.degrees(math.atan2(y[-1] - y[-3], z[-1] - z[-3]))
        found = read_by_camera(("angle_deg",), np.array([[degrees]]), np.zeros(1), 1.0, named)
        assert found[0, 0] == pytest.approx(expected, abs=0.01)


def by_pinhole(y, turn_deg, about):
    """Channels of the written unit as a pinhole reads them: its angle by two points of the tip."""
    y = np.array(y)
    tip, angle = (y[5].copy(), y[6] - HALF_mm), np.radians(y[0])
    for row in (1, 3, 5):
        y[row], along = pinhole(y[row], y[row + 1] - HALF_mm, turn_deg, about)
        y[row + 1] = along + HALF_mm
    ends = [
        pinhole(tip[0] + h * np.sin(angle), tip[1] + h * np.cos(angle), turn_deg, about) for h in (0.0, 1e-3)
    ]
    y[0] = np.degrees(np.arctan2(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]))
    return y


def filmed(seed, turn_deg=0.0, about="y"):
    """The verdict on four records of the written unit, filmed by a pinhole three unit lengths away."""
    rng, truth = np.random.default_rng(seed), {"modulus_factor": 1.05}
    bare = analytic.simulator(analytic.measured(rng, truth, dt=0.5, count=4))
    made = analytic.measured(
        rng, truth, dt=0.5, count=4, predict=lambda e: by_pinhole(bare.predict(e, truth), turn_deg, about)
    )
    return diagnose(made, analytic.simulator(made))


@pytest.mark.parametrize(
    "about",
    ["y", pytest.param("z", marks=pytest.mark.nightly("test_a_camera_that_looks_at_an_angle_is_named"))],
)
def test_a_camera_that_looks_at_an_angle_is_named(about):
    found = filmed(3, 5.0, about)
    assert (found.kind, found.names) == ("named", ("camera_perspective",))
    # One camera sees no angle by itself: what is told is its sine over the distance, by either law.
    get = found.selection.chosen.values.get
    whole = math.sin(math.radians(get("camera_perspective.view_deg", 0.0)))
    told = whole / (2.0 * get("camera_perspective.lengths_away", 3.0))
    told += get("camera_perspective.along" if about == "y" else "camera_perspective.across", 0.0)
    assert told == pytest.approx(math.sin(math.radians(5.0)) / 6.0, rel=0.15)


@pytest.mark.nightly("test_a_camera_that_looks_at_an_angle_is_named")
@pytest.mark.parametrize("about", ["y", "z"])
def test_at_a_large_angle_the_whole_law_is_found_with_the_angle(about):
    found = filmed(4, 15.0, about)
    assert (found.kind, found.names) == ("named", ("camera_perspective",))
    low, high = found.intervals["camera_perspective.view_deg"]
    assert low < 15.0 < high


STRAIGHT = pytest.mark.nightly("test_a_camera_that_looks_straight_has_no_fault")


@pytest.mark.parametrize("seed", [5, pytest.param(6, marks=STRAIGHT), pytest.param(7, marks=STRAIGHT)])
def test_a_camera_that_looks_straight_has_no_fault(seed):
    assert filmed(seed).kind == "none"
