"""Markers tracked in a video: from pixels to millimetres in the unit's frame, and to an angle.

The bending plane is the complex plane, w = y + i z in mm. A point of the picture is q = right + i up, seen
from the camera's side. A distant camera gives w = a q + b, where |a| is the scale.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .table import Remark, Remarks

CAMERAS = ("+x", "-x")
# The distance of two markers on one rigid part may vary by this share; more, and one of them has slipped.
SLIP = 0.02
# A base that wanders by more pixels than this is reported where it is taken to stand still.
MOVED = 1.0
# Two ways to the scale may differ by this share before it is reported.
DISAGREE = 0.02

Pair = tuple[str, str]


@attrs.frozen(eq=False)
class Tracks:
    """Markers tracked through a clip: (m, n, 2) in pixels, right and down from the upper left corner.

    names: of the m markers; positions are nan in frames where a marker was lost. fps: frames per s, 0 where
    the clip does not give it; time_s (n,): of the frames in s, None if only fps is known. remarks: on how
    they were read.
    """

    names: tuple[str, ...]
    pixels: Array
    fps: float = 0.0
    time_s: Array | None = None
    remarks: tuple[Remark, ...] = ()

    def __len__(self) -> int:
        return int(self.pixels.shape[1])

    def of(self, name: str) -> Array:
        """Positions (n, 2) in pixels of one marker. Raises InputError where it was not tracked."""
        if name not in self.names:
            raise InputError(
                f"marker {name!r} was not tracked", "", f"tracked markers: {', '.join(self.names) or 'none'}"
            )
        return np.asarray(self.pixels[self.names.index(name)])


@attrs.frozen
class View:
    """View of the unit by the camera.

    base: two markers that are fixed to the base; places_mm: (y, z) in mm of each in the unit's frame; tip:
    two markers on the tip, or None if no angle is wanted; camera: "+x" or "-x", its side of the unit. The
    scale is mm_per_pixel, or follows from ruler_mm, the distance of the two markers `ruler`, or from the
    base. follow_base: True to measure places and angle relative to the base in each frame, for a moving
    camera or clamp.
    """

    base: Pair
    places_mm: tuple[tuple[float, float], tuple[float, float]]
    tip: Pair | None = None
    camera: str = "+x"
    ruler: Pair | None = None
    ruler_mm: float | None = None
    mm_per_pixel: float | None = None
    follow_base: bool = False


@attrs.frozen(eq=False)
class Motion:
    """Motion in a video: places (m, n, 2) of all markers as (y, z) in mm, bending angle (n,) in degrees.

    angle_deg: rotation of the tip's pair relative to the base's since rest, positive toward +y; None without
    a tip. noise_px: standard deviation in pixels of one coordinate of a marker, from the distance of pairs on
    rigid parts. remarks: unusual features.
    """

    names: tuple[str, ...]
    places_mm: Array
    angle_deg: Array | None
    mm_per_pixel: float
    noise_px: float
    remarks: tuple[Remark, ...]


def motion(tracks: Tracks, view: View, rest: Array, time_s: Array, where: str = "") -> Motion:
    """Motion of the unit from tracked markers; rest (n,) marks the frames that define an angle of 0.

    time_s (n,): time in s, for remarks; where: origin of the data, for messages. Raises InputError for a view
    that does not fit the tracks, or a tip that is never visible at rest.
    """
    q = {name: _seen(tracks.of(name), view.camera) for name in tracks.names}
    _check(tracks, view, where)
    remarks = Remarks()
    _remark_lost_markers(q, time_s, remarks, where)
    base = np.stack([q[name] for name in view.base])
    known = np.array([complex(y, z) for y, z in view.places_mm])
    scale = _scale(q, view, known, remarks, where)
    rigid = {"base": view.base} | ({"tip": view.tip} if view.tip else {})
    noise = [_rigid(q, pair, part, time_s, remarks, where) for part, pair in rigid.items()]
    # The camera's turn and the base's place: of every frame, or one for all.
    turns, middles = _direction(base), base.mean(axis=0)
    if not view.follow_base:
        _remark_moved_base(middles, turns, abs(base[1] - base[0]), remarks, where)
    turn = turns if view.follow_base else _mean_direction(turns)
    middle = middles if view.follow_base else np.nanmean(middles)
    a = scale * _direction(known) / turn
    places = {name: known.mean() + a * (at - middle) for name, at in q.items()}
    angle = None
    if view.tip:
        tip = _direction(np.stack([q[name] for name in view.tip])) / turn
        if not np.isfinite(tip[rest]).any():
            raise InputError(
                "tip and base are never visible together at rest", where, "begin the clip before the pressure"
            )
        # A right-hand turn about x takes y to z; the angle is positive the other way, toward +y.
        angle = -np.degrees(np.angle(tip / _mean_direction(tip[rest])))
    stacked = np.array([places[name] for name in tracks.names])
    return Motion(
        tracks.names,
        np.stack([stacked.real, stacked.imag], axis=-1),
        angle,
        scale,
        float(np.mean(noise)),
        tuple(remarks),
    )


def _seen(pixels: Array, camera: str) -> Array:
    """Places (n,) in the picture as right + i up, mirrored for a camera that looks from -x."""
    right = pixels[:, 0] if camera == "+x" else -pixels[:, 0]
    return np.asarray(right - 1j * pixels[:, 1])


def _check(tracks: Tracks, view: View, where: str) -> None:
    if view.camera not in CAMERAS:
        raise InputError(f"a camera at {view.camera!r} is not known", where, "give +x or -x")
    roles = {"base": view.base, "tip": view.tip, "ruler": view.ruler}
    for role, pair in roles.items():
        if pair is None:
            continue
        if pair[0] == pair[1]:
            raise InputError(f"the {role} is marker {pair[0]!r} twice", where, "name two markers")
        if not np.isfinite(tracks.of(pair[0]) + tracks.of(pair[1])).any():
            raise InputError(
                f"the markers of the {role}, {pair[0]!r} and {pair[1]!r}, are never visible together",
                where,
                "track them again, or take other markers",
            )
    if math.dist(*view.places_mm) == 0:
        raise InputError(
            "both markers of the base have the same position", where, "give y and z of each in mm"
        )
    if view.ruler is not None and not view.ruler_mm:
        raise InputError("ruler_mm is missing or 0", where, "give ruler_mm, the distance of its two markers")
    for name, value in (("ruler_mm", view.ruler_mm), ("mm_per_pixel", view.mm_per_pixel)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value:g} is not a length", where, "give a number above 0")


def _scale(q: Mapping[str, Array], view: View, known: Array, remarks: Remarks, where: str) -> float:
    """Millimetres a pixel: as given, by the ruler, or by the base; disagreement is remarked."""
    found = {}
    if view.mm_per_pixel is not None:
        found["mm_per_pixel"] = view.mm_per_pixel
    if view.ruler is not None and view.ruler_mm is not None:
        found["the ruler"] = view.ruler_mm / _distance(q, view.ruler)
    found["the places of the base"] = float(abs(known[1] - known[0])) / _distance(q, view.base)
    (first, chosen), *others = found.items()
    for name, value in others:
        if abs(value / chosen - 1) > DISAGREE:
            remarks.add(
                f"by {first} one pixel is {chosen:.5g} mm, by {name} {value:.5g} mm; the first value is used",
                where,
                "check that both lie in the plane of the markers and were measured correctly",
            )
    return chosen


def _distance(q: Mapping[str, Array], pair: Pair) -> float:
    return float(np.nanmean(np.abs(q[pair[1]] - q[pair[0]])))


def _direction(pair: Array) -> Array:
    """Unit vectors from the first to the second of a pair (2, ...)."""
    across = pair[1] - pair[0]
    with np.errstate(invalid="ignore"):  # lost ones
        return np.asarray(across / np.abs(across))


def _mean_direction(turns: Array) -> complex:
    mean = complex(np.nanmean(turns))
    return mean / abs(mean)


def _remark_lost_markers(q: Mapping[str, Array], time_s: Array, remarks: Remarks, where: str) -> None:
    for name, at in q.items():
        lost = np.flatnonzero(~np.isfinite(at))
        if len(lost):
            remarks.add(
                f"marker {name!r} is lost in {len(lost)} of {len(at)} frames, {_spans(lost, time_s)}",
                where,
                "these rows stay empty; track it again from there if the motion there matters",
            )


def _spans(lost: Array, time_s: Array) -> str:
    """Runs of frames as times, the first three of them."""
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
    intervals = [f"{time_s[run[0]]:.4g} to {time_s[run[-1]]:.4g} s" for run in runs[:3]]
    return ", ".join(intervals) + (f" and {len(runs) - 3} more gaps" if len(runs) > 3 else "")


def _rigid(
    q: Mapping[str, Array], pair: Pair, part: str, time_s: Array, remarks: Remarks, where: str
) -> float:
    """Noise of one coordinate, in pixels, from the distance of two markers on a rigid part."""
    apart = np.abs(q[pair[1]] - q[pair[0]])
    usual = float(np.nanmedian(apart))
    off = np.abs(apart / usual - 1)
    if np.nanmax(off) > SLIP:
        worst = int(np.nanargmax(off))
        remarks.add(
            f"the {part}'s two markers, {usual:.4g} pixels apart, are {apart[worst]:.4g} apart at "
            f"{time_s[worst]:.4g} s",
            where,
            "one of them slipped, was confused with another feature or left the plane: check that frame",
        )
    # From frame to frame: a slow drift of the distance is perspective, not noise.
    steps = np.diff(apart)
    steps = steps[np.isfinite(steps)]
    # A difference of distances holds four coordinates along the pair.
    return float(1.4826 * np.median(np.abs(steps)) / 2.0) if len(steps) else math.nan


def _remark_moved_base(middle: Array, turn: Array, apart: Array, remarks: Remarks, where: str) -> None:
    shift = np.abs(middle - np.nanmedian(middle.real) - 1j * np.nanmedian(middle.imag))
    swing = np.abs(np.angle(turn / _mean_direction(turn))) * apart / 2
    most = max(float(np.nanmax(shift)), float(np.nanmax(swing)))
    if most > MOVED:
        remarks.add(
            f"the base's markers move by up to {most:.3g} pixels, but the base is assumed fixed",
            where,
            "the camera or the clamp moved: set follow_base",
        )


def resting(pressure_kPa: Array, seen: Sequence[Array] | Array, share: float, samples: int) -> Array:
    """Marks (n,) of frames at rest: the first `samples` with abs(pressure) up to `share` of its range.

    pressure_kPa (n,): in kPa; seen (k, n): frames in which each of k markers was visible, all of which must
    be. No frame is marked where there is none.
    """
    still = np.abs(pressure_kPa) <= share * np.ptp(pressure_kPa)
    frames = np.flatnonzero(still & np.all(np.asarray(seen, bool), axis=0))[:samples]
    marked = np.zeros(len(pressure_kPa), bool)
    marked[frames] = True
    return marked
