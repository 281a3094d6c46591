"""Supply rate limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...measured import Experiment
from ..parameter import Parameter
from .declaration import BENCH, Declaration
from .supply_limit import driven

Array = np.ndarray[Any, Any]

# Share of a record's changes that are slower than its fastest; of those the time a kPa, times the starts.
FASTEST, LONGER, LONGEST = 0.95, (2.0,), 50.0


def _laws(kind: str, experiments: Sequence[Experiment]) -> tuple[tuple[Parameter, ...], ...]:
    rates = [np.abs(np.gradient(e["pressure_kPa"], e["time_s"])) for e in driven(kind, experiments)]
    fastest = max((float(np.nanquantile(r, FASTEST)) for r in rates), default=0.0)
    if not fastest:
        return ()
    starts = tuple(s / fastest for s in LONGER)
    slow = Parameter("slowness_s_kPa", "s/kPa", 0.0, LONGEST / fastest, 0.0, starts, "of its valve")
    return ((slow,),)


def _given(experiment: Experiment, p: Array, values: Mapping[str, float], largest_kPa: float) -> Array:
    if not (slow := values["slowness_s_kPa"]):
        return p
    x, found = float(p[0]), [float(p[0])]
    for to, most in zip(p[1:].tolist(), (np.diff(experiment["time_s"]) / slow).tolist(), strict=True):
        x += min(max(to - x, -most), most)
        found.append(x)
    return np.array(found)


EFFECT = Declaration(
    mechanism="the supply cannot change its pressure as fast as was asked for and logged",
    reveals="a gauge at the unit, read beside the log; the same protocol at a third of the rate",
    remedy="ask for slower changes, or log a gauge at the unit",
    of=BENCH,
    instrument=True,
    laws=_laws,
    pressure=_given,
)
