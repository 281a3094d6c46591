"""Supply limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...measured import Experiment
from ..parameter import Parameter
from .declaration import BENCH, Declaration

Array = np.ndarray[Any, Any]

DRIVEN = ("unit_pressure", "pressure_step", "blocked_force")
"""Kinds of experiments whose pressure is asked for while it is recorded."""
# Of the largest pressure: what a supply may fall short by, and where fits begin.
MOST_SHORT, STARTS = 0.8, (0.15,)


def driven(kind: str, experiments: Sequence[Experiment]) -> list[Experiment]:
    """Experiments of a kind in which a supply follows a pressure in kPa that changes over time."""
    return [
        e
        for e in experiments
        if e.kind == kind in DRIVEN and "time_s" in e.columns and np.ptp(e["pressure_kPa"]) > 0.0
    ]


def _laws(kind: str, experiments: Sequence[Experiment]) -> tuple[tuple[Parameter, ...], ...]:
    most = max((float(np.abs(e["pressure_kPa"]).max()) for e in driven(kind, experiments)), default=0.0)
    if not most:
        return ()
    starts = tuple(s * most for s in STARTS)
    short = Parameter("short_kPa", "kPa", 0.0, MOST_SHORT * most, 0.0, starts, "of the largest read")
    return ((short,),)


def _given(experiment: Experiment, p: Array, values: Mapping[str, float], largest_kPa: float) -> Array:
    most = largest_kPa - values["short_kPa"]
    return np.clip(p, -most, most) if values["short_kPa"] else p


EFFECT = Declaration(
    mechanism="the supply cannot give the largest pressures, which were asked for and logged",
    reveals="a gauge at the unit, read beside the log",
    remedy="set the supply to give that pressure, or log a gauge at the unit",
    of=BENCH,
    instrument=True,
    laws=_laws,
    pressure=_given,
)
