"""A camera that looks at the plane of bending, as it is: at an angle, through a lens, turned, near or far."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Chambers

ANGLE = "angle_deg"
# Length of a unit at 1.0x, from base to tip.
LENGTH_mm = Chambers().cell_mm * Chambers().count


@attrs.frozen(eq=False)
class View:
    """What a camera does to the picture; by default nothing.

    A place x (2,), across and along the axis in halves of the unit's length, is seen at M x / (1 + k . x):
    away (2, 2) is M, farther (2,) is k. lens: radial distortion at half a length. excess: of the picture's
    scale. across, along: foreshortening. turned (n,): in rad, at each time.
    """

    away: Array = attrs.field(factory=lambda: np.eye(2))
    farther: Array = attrs.field(factory=lambda: np.zeros(2))
    lens: float = 0.0
    excess: float = 0.0
    across: float = 1.0
    along: float = 1.0
    turned: Any = 0.0

    def read(self, channels: Sequence[str], y: Array, scale: float) -> Array:
        """Channels (c, n) as read by the camera from the true ones (c, n), in degrees and mm.

        scale: of the unit. The picture's middle is that of the unit at rest, half way along its axis.
        Positions there: y across and z along the axis; x is depth, which one camera does not see. Where only
        angles are known the unit bends as an arc of its length.
        """
        half, turns = 0.5 * LENGTH_mm * scale, bool(np.any(self.turned))
        oblique = bool(self.farther.any())

        def picture(across_mm: Array, along_mm: Array) -> tuple[Array, Array]:
            """Positions (n,) in mm about the middle, as they appear before the camera turns."""
            if oblique:
                place = np.stack([across_mm, along_mm])
                across_mm, along_mm = self.away @ place / (1.0 + self.farther @ place / half)
            grown: Any = 1.0 + self.excess
            if self.lens:
                grown = grown * (1.0 + self.lens * (across_mm**2 + along_mm**2) / half**2)
            return self.across * grown * across_mm, self.along * grown * along_mm

        found = y.copy()
        for i, channel in enumerate(channels):
            if channel == ANGLE:
                misread: Any = 0.0
                if oblique or self.lens or (self.across, self.along) != (1.0, 1.0):
                    misread = self._angle_misread(np.radians(y[i]), oblique)
                found[i] = y[i] + np.degrees(misread + self.turned)
            elif channel.startswith("marker") and channel.endswith("_y_mm"):
                other = channel.replace("_y_mm", "_z_mm")
                k = channels.index(other) if other in channels else None
                place = picture(y[i], y[k] - half if k is not None else np.zeros_like(y[i]))
                sine, cosine = np.sin(self.turned), np.cos(self.turned)
                found[i] = cosine * place[0] + sine * place[1] if turns else place[0]
                if k is not None:
                    found[k] = half - sine * place[0] + cosine * place[1]
        return found

    def _angle_misread(self, angle: Array, oblique: bool) -> Array:
        """Error (n,) of the angle (n,) of the tip's cross-section as seen, both in rad.

        The camera sees the tangent (sin a, cos a) at the tip of an arc; the tip is at (1 - cos a)/a across
        and sin a/a along, in arc lengths. Each fault turns it by its Jacobian: perspective, then a lens of x'
        = x (1 + k r^2).
        """
        near = np.abs(angle) > 1e-6
        y = 2.0 * np.where(near, (1.0 - np.cos(angle)) / np.where(angle, angle, 1.0), 0.5 * angle)
        z = 2.0 * np.sinc(angle / np.pi) - 1.0
        sine, cosine = np.sin(angle), np.cos(angle)
        to_y, to_z = sine, cosine
        if oblique:
            place, way = np.stack([y, z]), np.stack([sine, cosine])
            depth = 1.0 + self.farther @ place
            # Up to a factor that keeps a direction: the square of the depth.
            to_y, to_z = self.away @ (way * depth - place * (self.farther @ way))
            y, z = self.away @ place / depth
        grown, along = 1.0 + self.lens * (y**2 + z**2), 2.0 * self.lens * (y * to_y + z * to_z)
        seen_y = self.across / self.along * (grown * to_y + along * y)
        seen_z = grown * to_z + along * z
        # Against the angle itself, which may be more than a half turn.
        return np.asarray(np.arctan2(seen_y * cosine - seen_z * sine, seen_y * sine + seen_z * cosine))
