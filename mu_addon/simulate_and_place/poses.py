"""The simulated unit at a measured bending angle, interpolated between Model A's states.

Under pressure alone the elastic unit has one state a pressure. While its angle rises with pressure from rest,
each angle has one state. Beyond the first turning point it would have two, so the twin shows nothing there.
Between two states displacements go straight, as the motion on the timeline does.
"""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.bending_angle import TipSection
from ..report.motion_files import Motion


@attrs.frozen(eq=False)
class Poses:
    """States (s,) of a motion by rising angle: angle_deg, pressure_kPa, and their numbers in the motion."""

    angle_deg: Array
    pressure_kPa: Array
    state: Array

    @property
    def range_deg(self) -> tuple[float, float]:
        """Range of simulated angles."""
        return float(self.angle_deg[0]), float(self.angle_deg[-1])

    def at(self, angle_deg: float) -> tuple[int, int, float] | None:
        """The two states on either side of an angle and the share of the second; None beyond the range."""
        low, high = self.range_deg
        if not low <= angle_deg <= high:
            return None
        k = int(np.clip(np.searchsorted(self.angle_deg, angle_deg) - 1, 0, len(self.angle_deg) - 2))
        first, second = self.angle_deg[k : k + 2]
        return int(self.state[k]), int(self.state[k + 1]), float((angle_deg - first) / (second - first))

    def pressure_at(self, angle_deg: float) -> float:
        """Pressure in kPa at which Model A has this angle; nan beyond the range."""
        return float(np.interp(angle_deg, self.angle_deg, self.pressure_kPa, left=np.nan, right=np.nan))


def poses(motion: Motion) -> Poses:
    """States of a motion by angle; raises InputError where the motion does not bend about rest."""
    order = np.argsort(motion.state_kPa, kind="stable")
    tip = TipSection.of(motion.mesh)
    angles = np.array([tip.angle_deg(motion.model_a[k].astype(float)) for k in order])
    pressure = motion.state_kPa[order]
    rest = int(np.argmin(np.abs(pressure)))
    first = last = rest
    while first > 0 and angles[first - 1] < angles[first]:
        first -= 1
    while last + 1 < len(angles) and angles[last + 1] > angles[last]:
        last += 1
    if first == last:
        raise InputError(
            "the simulated unit does not bend as its pressure rises",
            str(motion.folder),
            "simulate it with a protocol that inflates it",
        )
    kept = slice(first, last + 1)
    return Poses(angles[kept], pressure[kept], order[kept])
