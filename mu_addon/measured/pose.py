"""Pose of a unit in an experiment: its markers at rest, and the direction of gravity where it was turned."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .experiment import Experiment
from .kinds import AXES, markers

Direction = tuple[float, float, float]
X: Direction = (1.0, 0.0, 0.0)

# A marker is at rest where the pressure is within this share of its range from 0 ...
AT_REST = 0.02
# ... and lies where these first samples of rest put it on average.
SAMPLES = 5


def at_rest(experiments: Sequence[Experiment]) -> dict[int, tuple[str, Array, str]]:
    """Markers at rest, by number: known axes, position (3,) in mm, 0 where unknown, and the experiment.

    The frame is the unit's: z along the axis from the inlet, +y the side with more lattice. The position is
    the mean of the first SAMPLES rows at rest, in the first experiment that has any: pressure within AT_REST
    of its range from 0. Raises InputError where there is none or a marker lacks y or z.
    """
    found: dict[int, tuple[str, Array, str]] = {}
    missed: dict[int, str] = {}
    for e in experiments:
        p = np.abs(e["pressure_kPa"])
        still = p <= AT_REST * np.ptp(e["pressure_kPa"])
        for number, axes in markers(list(e.columns)).items():
            if number in found:
                continue
            if not {"y", "z"} <= axes:
                raise InputError(f"marker {number} lacks its y or z", e.name, "give both columns")
            known = "".join(a for a in AXES if a in axes)
            columns = np.stack([e[f"marker{number}_{a}_mm"] for a in known], axis=1)
            rows = np.flatnonzero(still & np.isfinite(columns).all(axis=1))[:SAMPLES]
            if len(rows):
                seen = np.zeros(3)
                seen[[AXES.index(a) for a in known]] = columns[rows].mean(axis=0)
                found[number] = known, seen, e.name
            else:
                missed.setdefault(number, e.name)
    for number in missed.keys() - found.keys():
        raise InputError(
            f"marker {number} is never visible at rest",
            missed[number],
            "record it at zero pressure before the run",
        )
    return dict(sorted(found.items()))


def down(orientation_deg: float, axis: Direction = X) -> Array:
    """Unit vector (3,) of gravity in the unit's frame; at 0 degrees along z, as a unit hangs.

    Gravity is rotated by orientation_deg about `axis` (3,) of nonzero length, right-handed (Rodrigues): about
    x to -y, about y to +x. Raises InputError for an axis without a length.

    >>> down(0.0).round(9).tolist()[2], down(90.0, (0.0, 1.0, 0.0)).round(9).tolist()[0]
    (1.0, 1.0)
    """
    n = np.array(axis, np.float64)
    length = float(np.linalg.norm(n))
    if not (n.shape == (3,) and length > 0.0):
        raise InputError(
            f"{axis!r} is not an axis to turn about", "orientation", "give three numbers, not all of them 0"
        )
    n /= length
    a, z = math.radians(orientation_deg), np.array([0.0, 0.0, 1.0])
    return np.asarray(math.cos(a) * z + math.sin(a) * np.cross(n, z) + (1.0 - math.cos(a)) * n[2] * n)
