"""Positions of a unit's markers at zero pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from .experiment import Experiment
from .kinds import AXES, markers

Array = np.ndarray[Any, Any]

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
