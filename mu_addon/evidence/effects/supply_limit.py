"""Supply limit."""

from __future__ import annotations

import attrs
import numpy as np

from ...measured import Experiment
from .declaration import BENCH, DRIVEN, Array, Data, Declaration, Law, Parameter, Setting, Values

# Of the largest pressure: what a supply may fall short by, and where fits begin.
MOST_SHORT, STARTS = 0.8, (0.15,)


def driven(data: Data) -> list[Experiment]:
    """Own experiments in which a supply follows a pressure in kPa that changes over time."""
    return [e for e in data.own if "time_s" in e.columns and np.ptp(e["pressure_kPa"]) > 0.0]


def _short(law: Law, data: Data) -> tuple[Law, ...]:
    most = max((float(np.abs(e["pressure_kPa"]).max()) for e in driven(data)), default=0.0)
    if not most:
        return ()
    size = attrs.evolve(law.parameters[0], high=MOST_SHORT * most, starts=tuple(s * most for s in STARTS))
    return (attrs.evolve(law, parameters=(size,)),)


def _given(p: Array, v: Values, at: Setting) -> Array:
    most = at.largest - v["short_kPa"]
    return np.clip(p, -most, most)


EFFECT = Declaration(
    mechanism="the supply cannot give the largest pressures, which were asked for and logged",
    reveals="a gauge at the unit, read beside the log",
    remedy="set the supply to give that pressure, or log a gauge at the unit",
    of=BENCH,
    instrument=True,
    laws=(
        Law(
            DRIVEN,
            (Parameter("short_kPa", "kPa", 0.0, 1.0, 0.0, (), "of the largest read"),),
            {"supply": _given},
            offered=_short,
        ),
    ),
)
