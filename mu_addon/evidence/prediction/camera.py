"""Faults of a camera that looks at the plane of bending: scale, angle of view, lens, rotation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...design.parameters import Chambers
from ...measured import Experiment
from ..effect import Effect, Parameter
from .drift import drift, drifts

Array = np.ndarray[Any, Any]

ANGLE = "angle_deg"
# Length of a unit at 1.0x, from base to tip.
LENGTH_mm = Chambers().cell_mm * Chambers().count
# Largest rotation of a stable camera during a record.
TURN_deg = 20.0
# Assumed distance of a camera, in unit lengths.
AWAY = 3.0
# What is nearer is larger, by this share at half a unit's length from the middle: of a camera that far away
# which is turned by 20 degrees, the sine over six half lengths.
KEYSTONE = 0.06
_KEYSTONE = (
    "a camera three unit lengths away, turned by 20 degrees; above 0 parts in that direction are farther"
)


def camera_effects(channels: Sequence[str], kind: str, experiments: Sequence[Experiment]) -> list[Effect]:
    """Effects, for a kind, of a camera that reads these channels of the unit (`read_by_camera`)."""
    found = [
        Effect(
            "camera_tilt",
            (
                Parameter(
                    "foreshortening",
                    "",
                    -0.06,
                    0.06,
                    0.0,
                    (0.01,),
                    "1 less the cosine of 20 degrees; above 0 across the unit, below along it",
                ),
            ),
            (kind,),
        ),
        Effect(
            "lens_distortion",
            (
                Parameter(
                    "at_tip",
                    "",
                    -0.05,
                    0.05,
                    0.0,
                    (0.005,),
                    "radial, where the tip is at rest: lenses of cameras 0.1 to 5 %; above 0 pincushion",
                ),
            ),
            (kind,),
        ),
        *_perspectives(kind),
        *drifts("angle_drift", "deg", TURN_deg, kind, experiments),
    ]
    if any(c.startswith("marker") for c in channels):
        scale = Parameter("excess", "", -0.1, 0.1, 0.0, (0.01,), "a ruler nearer or farther than the unit")
        found.append(Effect("camera_scale", (scale,), (kind,)))
    return found


def _perspectives(kind: str) -> tuple[Effect, ...]:
    """Laws of a camera at an angle: to first order, along the axis and across, and in full.

    The last is tried where one of the others is found: it includes foreshortening, of second order in the
    angle.
    """
    first = (Parameter(way, "", -KEYSTONE, KEYSTONE, 0.0, (0.01,), _KEYSTONE) for way in ("along", "across"))
    whole = (
        Parameter("view_deg", "deg", 0.0, 35.0, 0.0, (10.0,), "off the normal to the plane of bending"),
        Parameter(
            "farther_deg",
            "deg",
            -360.0,
            360.0,
            45.0,
            (-135.0, -45.0, 45.0, 135.0),
            "way in the picture that leads away from the camera, from across toward along the axis",
        ),
        Parameter("lengths_away", "", 1.5, 30.0, AWAY, (AWAY,), "cameras 10 cm to 2 m from a unit"),
    )
    return (
        *(Effect("camera_perspective", (p,), (kind,)) for p in first),
        Effect("camera_perspective", whole, (kind,), refines=True),
    )


def read_by_camera(
    channels: Sequence[str], y: Array, time_s: Array, scale: float, values: Mapping[str, float]
) -> Array:
    """Channels (c, n) as read by a camera with its faults, from the true ones (c, n), in degrees and mm.

    time_s (n,): in s; scale: of the unit; values: by "effect.parameter". The picture's middle is that of the
    unit at rest, half way along its axis. Positions there: y across and z along the axis; x is depth, which
    one camera does not see. Where only angles are known the unit bends as an arc of its length. An oblique
    camera divides positions by 1 + k u, with u the position along or across the axis in half lengths of the
    unit (`_view`).
    """
    get = values.get
    short, lens = get("camera_tilt.foreshortening", 0.0), get("lens_distortion.at_tip", 0.0)
    view = _view(values)
    excess = get("camera_scale.excess", 0.0)
    turned = np.radians(drift("angle_drift", time_s, values))
    turns = bool(np.any(turned))
    if not (short or lens or excess or view or turns):
        return y
    across, along = 1.0 - max(short, 0.0), 1.0 + min(short, 0.0)
    half = 0.5 * LENGTH_mm * scale

    def picture(across_mm: Array, along_mm: Array) -> tuple[Array, Array]:
        """Positions (n,) in mm about the middle, as they appear before the camera turns."""
        if view:
            turned_away, farther = view
            place = np.stack([across_mm, along_mm])
            across_mm, along_mm = turned_away @ place / (1.0 + farther @ place / half)
        grown: Any = 1.0 + excess
        if lens:
            grown = grown * (1.0 + lens * (across_mm**2 + along_mm**2) / half**2)
        return across * grown * across_mm, along * grown * along_mm

    found = y.copy()
    for i, channel in enumerate(channels):
        if channel == ANGLE:
            misread: Any = 0.0
            if view or lens or short:
                misread = _angle_misread(np.radians(y[i]), view, lens, across / along)
            found[i] = y[i] + np.degrees(misread + turned)
        elif channel.startswith("marker") and channel.endswith("_y_mm"):
            other = channel.replace("_y_mm", "_z_mm")
            k = channels.index(other) if other in channels else None
            place = picture(y[i], y[k] - half if k is not None else np.zeros_like(y[i]))
            found[i] = np.cos(turned) * place[0] + np.sin(turned) * place[1] if turns else place[0]
            if k is not None:
                found[k] = half - np.sin(turned) * place[0] + np.cos(turned) * place[1]
    return found


def _view(values: Mapping[str, float]) -> tuple[Array, Array] | None:
    """Matrix and vector of the map x -> M x / (1 + k . x) of a camera at an angle, x (2,) across and along.

    M (2, 2), and k (2,) for places in halves of the unit's length; None where it looks straight. Of a pinhole
    turned by an angle v toward a direction n in the picture: M foreshortens along n by cos v, and k is n sin
    v over its distance.
    """
    get = values.get
    first = get("camera_perspective.across", 0.0), get("camera_perspective.along", 0.0)
    off = np.radians(get("camera_perspective.view_deg", 0.0))
    if not (off or any(first)):
        return None
    farther, away = np.array(first), np.eye(2)
    if off:
        way = np.radians(get("camera_perspective.farther_deg", 45.0))
        n = np.array([np.cos(way), np.sin(way)])
        away = away + (np.cos(off) - 1.0) * np.outer(n, n)
        farther = farther + np.sin(off) / (2.0 * get("camera_perspective.lengths_away", AWAY)) * n
    return (away, farther) if farther.any() else None


def _angle_misread(angle: Array, view: tuple[Array, Array] | None, lens: float, squeezed: float) -> Array:
    """Error (n,) of the angle (n,) of the tip's cross-section as seen, both in rad.

    The camera sees the tangent (sin a, cos a) at the tip of an arc; the tip is at (1 - cos a)/a across and
    sin a/a along, in arc lengths. Each fault turns it by its Jacobian: perspective (`_view`), then a lens of
    x' = x (1 + k r^2).
    """
    y = 2.0 * np.where(np.abs(angle) > 1e-6, (1.0 - np.cos(angle)) / np.where(angle, angle, 1.0), 0.5 * angle)
    z = 2.0 * np.sinc(angle / np.pi) - 1.0
    sine, cosine = np.sin(angle), np.cos(angle)
    to_y, to_z = sine, cosine
    if view:
        away, farther = view
        place, way = np.stack([y, z]), np.stack([sine, cosine])
        depth = 1.0 + farther @ place
        # Up to a factor that keeps a direction: the square of the depth.
        to_y, to_z = away @ (way * depth - place * (farther @ way))
        y, z = away @ place / depth
    grown, along = 1.0 + lens * (y**2 + z**2), 2.0 * lens * (y * to_y + z * to_z)
    seen_y, seen_z = squeezed * (grown * to_y + along * y), grown * to_z + along * z
    # Against the angle itself, which may be more than a half turn.
    return np.asarray(np.arctan2(seen_y * cosine - seen_z * sine, seen_y * sine + seen_z * cosine))
