"""What a camera makes of a unit that bends in the plane it looks at: scale, tilt, lens, slow turning."""

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
# A camera that stands well turns less than this while it records.
TURN_deg = 20.0


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
        *drifts("angle_drift", "deg", TURN_deg, kind, experiments),
    ]
    if any(c.startswith("marker") for c in channels):
        scale = Parameter("excess", "", -0.1, 0.1, 0.0, (0.01,), "a ruler nearer or farther than the unit")
        found.append(Effect("camera_scale", (scale,), (kind,)))
    return found


def read_by_camera(
    channels: Sequence[str], y: Array, time_s: Array, scale: float, values: Mapping[str, float]
) -> Array:
    """Channels (c, n) as a camera with its faults reads them, of what they are (c, n), in degrees and mm.

    time_s (n,): in s; scale: of the unit; values: by "effect.parameter". The picture's middle is that of the
    unit at rest, half way along its axis. Positions there: y across and z along the axis; x is depth, which
    one camera does not see. Where only angles are known the unit bends as an arc of its length.
    """
    get = values.get
    short, lens = get("camera_tilt.foreshortening", 0.0), get("lens_distortion.at_tip", 0.0)
    excess = get("camera_scale.excess", 0.0)
    turned = np.radians(drift("angle_drift", time_s, values))
    if not (short or lens or excess or np.any(turned)):
        return y
    across, along = 1.0 - max(short, 0.0), 1.0 + min(short, 0.0)
    half = 0.5 * LENGTH_mm * scale

    def picture(across_mm: Array, along_mm: Array) -> tuple[Array, Array]:
        """Positions (n,) in mm about the middle, as they appear before the camera turns."""
        far = lens * (across_mm**2 + along_mm**2) / half**2
        grown = (1.0 + excess) * (1.0 + far)
        return across * grown * across_mm, along * grown * along_mm

    found = y.copy()
    for i, channel in enumerate(channels):
        if channel == ANGLE:
            found[i] = y[i] + np.degrees(_angle_misread(np.radians(y[i]), lens, across / along) + turned)
        elif channel.startswith("marker") and channel.endswith("_y_mm"):
            other = channel.replace("_y_mm", "_z_mm")
            k = channels.index(other) if other in channels else None
            place = picture(y[i], y[k] - half if k is not None else np.zeros_like(y[i]))
            found[i] = np.cos(turned) * place[0] + np.sin(turned) * place[1]
            if k is not None:
                found[k] = half - np.sin(turned) * place[0] + np.cos(turned) * place[1]
    return found


def _angle_misread(angle: Array, lens: float, squeezed: float) -> Array:
    """By how much the angle (n,) of the tip's cross-section is misread, in rad, as the angle itself.

    The line that is seen is the tangent (sin a, cos a) at the tip of an arc, (1 - cos a)/a across and
    sin a/a along of its length. A lens of x' = x (1 + k r^2) turns it by its Jacobian.
    """
    y = 2.0 * np.where(np.abs(angle) > 1e-6, (1.0 - np.cos(angle)) / np.where(angle, angle, 1.0), 0.5 * angle)
    z = 2.0 * np.sinc(angle / np.pi) - 1.0
    sine, cosine = np.sin(angle), np.cos(angle)
    grown, along = 1.0 + lens * (y**2 + z**2), 2.0 * lens * (y * sine + z * cosine)
    seen_y, seen_z = squeezed * (grown * sine + along * y), grown * cosine + along * z
    # Against the angle itself, which may be more than a half turn.
    return np.asarray(np.arctan2(seen_y * cosine - seen_z * sine, seen_y * sine + seen_z * cosine))
