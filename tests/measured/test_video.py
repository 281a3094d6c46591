"""From pixels to the unit's frame: closed forms of a bending arc, whatever the camera."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.measured.video import Tracks, View, motion, resting

BASE = ((-15.0, 0.0), (15.0, 0.0))
NAMES = ("a", "b", "c", "d", "e")
VIEW = View(("a", "b"), BASE, ("c", "d"))
TIME = np.linspace(0.0, 4.0, 41)
REST = np.arange(41) < 3
BEND = np.where(REST, 0.0, 50.0 * np.sin(1.5 * TIME))


def arc(angle_deg, length=75.0):
    """Places (5, n, 2) as (y, z) of an arc: two markers on the base, two on the tip, one at mid-length."""
    a = np.radians(angle_deg)
    bent = np.where(np.abs(a) < 1e-9, 1.0, a)

    def middle(share):
        y = np.where(np.abs(a) < 1e-9, 0.0, length / bent * (1 - np.cos(share * bent)))
        z = np.where(np.abs(a) < 1e-9, share * length, length / bent * np.sin(share * bent))
        return np.stack([y, z], axis=-1)

    across = 15.0 * np.stack([np.cos(a), -np.sin(a)], axis=-1)
    still = np.broadcast_to([15.0, 0.0], (len(a), 2))
    tip = middle(1.0)
    return np.stack([-still, still, tip - across, tip + across, middle(0.5)])


def picture(places, camera="+x", mm_per_pixel=0.25, turn_deg=180.0, at=(240.0, 30.0)):
    """Pixels (m, n, 2), right and down, of places (m, n, 2); turned counterclockwise on screen."""
    right, up = places[..., 0] * (1 if camera == "+x" else -1), places[..., 1]
    t = np.radians(turn_deg)
    turned = np.stack([np.cos(t) * right - np.sin(t) * up, -(np.sin(t) * right + np.cos(t) * up)], axis=-1)
    return turned / mm_per_pixel + at


def tracks(pixels):
    return Tracks(NAMES[: len(pixels)], pixels, 10.0)


@settings(max_examples=40)
@given(
    camera=st.sampled_from(["+x", "-x"]),
    scale=st.floats(0.01, 5.0),
    turn=st.floats(-180.0, 180.0),
    at=st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    start=st.floats(-120.0, 120.0),
)
def test_places_and_angle_whatever_the_camera(camera, scale, turn, at, start):
    """The unit need not be straight at rest: the angle counts from there."""
    places = arc(start + BEND)
    found = motion(
        tracks(picture(places, camera, scale, turn, at)), attrs.evolve(VIEW, camera=camera), REST, TIME
    )
    np.testing.assert_allclose(found.places_mm, places, atol=1e-6)
    np.testing.assert_allclose(found.angle_deg, BEND, atol=1e-6)
    assert found.mm_per_pixel == pytest.approx(scale)
    assert found.remarks == ()


def test_bending_toward_the_side_with_more_lattice_is_positive():
    found = motion(tracks(picture(arc(BEND))), VIEW, REST, TIME)
    most = np.argmax(BEND)
    assert found.angle_deg[most] > 49
    assert found.places_mm[4, most, 0] > 5  # toward +y


def test_the_wrong_side_of_the_camera_turns_the_sign():
    found = motion(tracks(picture(arc(BEND), "-x")), VIEW, REST, TIME)
    np.testing.assert_allclose(found.angle_deg, -BEND, atol=1e-6)


def test_scale_from_a_ruler_from_a_number_and_what_disagrees():
    pixels = np.concatenate([picture(arc(BEND))[:4], np.broadcast_to([[[10, 10]], [[10, 210]]], (2, 41, 2))])
    filmed = Tracks(("a", "b", "c", "d", "r", "s"), pixels)
    ruler = attrs.evolve(VIEW, ruler=("r", "s"), ruler_mm=50.0)
    assert motion(filmed, ruler, REST, TIME).mm_per_pixel == pytest.approx(0.25)
    wrong = motion(filmed, attrs.evolve(ruler, ruler_mm=55.0), REST, TIME)
    assert wrong.mm_per_pixel == pytest.approx(0.275)
    (remark,) = wrong.remarks
    assert "by the ruler one pixel is 0.275 mm, by the places of the base 0.25 mm" in remark.what
    number = motion(filmed, attrs.evolve(VIEW, mm_per_pixel=0.25), REST, TIME)
    assert number.mm_per_pixel == 0.25
    assert number.remarks == ()


def test_what_was_lost_stays_empty_and_is_told():
    pixels = picture(arc(BEND))
    pixels[2, 20:25] = np.nan
    pixels[4, [7, 30, 31]] = np.nan
    found = motion(tracks(pixels), VIEW, REST, TIME)
    assert np.flatnonzero(np.isnan(found.angle_deg)).tolist() == [20, 21, 22, 23, 24]
    assert np.isnan(found.places_mm[2, 20:25]).all()
    assert np.isfinite(found.places_mm[3]).all()
    assert [r.what for r in found.remarks] == [
        "marker 'c' is lost in 5 of 41 frames, 2 to 2.4 s",
        "marker 'e' is lost in 3 of 41 frames, 0.7 to 0.7 s, 3 to 3.1 s",
    ]


def test_a_marker_that_slips_is_told():
    pixels = picture(arc(BEND))
    pixels[3, 28:] += [6.0, 3.0]
    (remark,) = motion(tracks(pixels), VIEW, REST, TIME).remarks
    assert "tip's two markers, 120 pixels apart" in remark.what
    assert float(remark.what.rpartition(" at ")[2].removesuffix(" s")) >= 2.8


def test_a_base_that_turns_about_its_middle_is_told():
    """By 1.5 degrees either way of its mean: its markers, 120 pixels apart, move by 60 times that angle."""
    pixels = np.concatenate([picture(arc(BEND))[:, :21], picture(arc(BEND), turn_deg=183.0)[:, 21:]], axis=1)
    (remark,) = motion(tracks(pixels), VIEW, REST, TIME).remarks
    assert f"move by up to {60 * np.radians(3.0) * 21 / 41:.3g} pixels" in remark.what


def test_a_camera_that_moves_is_told_and_taken_out_where_asked():
    pixels = picture(arc(BEND))
    swing = np.radians(2.0) * np.sin(7 * TIME)
    turn = np.stack([np.cos(swing), -np.sin(swing), np.sin(swing), np.cos(swing)], -1).reshape(-1, 2, 2)
    shaken = np.einsum("nij,mnj->mni", turn, pixels) + 5 * np.sin(3 * TIME)[:, None]
    still = motion(tracks(shaken), VIEW, REST, TIME)
    assert np.abs(still.angle_deg - BEND).max() > 1
    assert any("base's markers move by up to" in r.what for r in still.remarks)
    followed = motion(tracks(shaken), attrs.evolve(VIEW, follow_base=True), REST, TIME)
    np.testing.assert_allclose(followed.angle_deg, BEND, atol=1e-6)
    np.testing.assert_allclose(followed.places_mm, arc(BEND), atol=1e-6)
    assert followed.remarks == ()


def test_noise_is_found_and_the_angle_is_as_uncertain_as_geometry_says():
    rng = np.random.default_rng(3)
    n = 4000
    bend = np.where(np.arange(n) < 1000, 0.0, 40.0)
    pixels = picture(arc(bend)) + rng.normal(0.0, 0.05, (5, n, 2))
    found = motion(tracks(pixels), VIEW, np.arange(n) < 1000, np.arange(n) / 30.0)
    assert found.noise_px == pytest.approx(0.05, rel=0.05)
    # Two ends, 120 pixels apart, each 0.05 aside.
    assert np.std(found.angle_deg[1000:]) == pytest.approx(np.degrees(0.05 * np.sqrt(2) / 120), rel=0.05)
    assert np.mean(found.angle_deg[1000:]) == pytest.approx(40.0, abs=0.003)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"camera": "left"}, "a camera at 'left'"),
        ({"tip": ("c", "c")}, "the tip is marker 'c' twice"),
        ({"tip": ("c", "x")}, "marker 'x' was not tracked"),
        ({"places_mm": ((1.0, 2.0), (1.0, 2.0))}, "have the same position"),
        ({"ruler": ("c", "d")}, "ruler_mm is missing or 0"),
        ({"mm_per_pixel": -1.0}, "mm_per_pixel = -1"),
        ({"mm_per_pixel": float("nan")}, "mm_per_pixel = nan"),
        ({"base": ("a", "gone")}, "never visible together"),
    ],
)
def test_views_that_do_not_fit(change, what):
    pixels = picture(arc(BEND))
    lost = np.full((1, 41, 2), np.nan)
    filmed = Tracks((*NAMES, "gone"), np.concatenate([pixels, lost]))
    with pytest.raises(InputError, match=what):
        motion(filmed, attrs.evolve(VIEW, **change), REST, TIME)


def test_rest_is_where_there_is_no_pressure_and_all_is_seen():
    p = np.array([0.1, 0.0, 0.2, 20.0, -15.0, 0.0])
    seen = np.array([[0, 1, 1, 1, 1, 1], [1, 1, 1, 1, 1, 0]])
    assert np.flatnonzero(resting(p, seen, 0.02, 5)).tolist() == [1, 2]
    assert np.flatnonzero(resting(p, np.ones((1, 6)), 0.02, 2)).tolist() == [0, 1]
    assert not resting(p + 5.0, seen, 0.02, 5).any()
    # Of suction, too, the share is of the whole range.
    assert np.flatnonzero(resting(np.array([0.3, -0.3, -20.0, -5.0]), np.ones((1, 4)), 0.02, 5)).tolist() == [
        0,
        1,
    ]
