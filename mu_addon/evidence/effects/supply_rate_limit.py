"""Supply rate limit."""

from __future__ import annotations

import attrs
import numpy as np

from .declaration import BENCH, DRIVEN, Array, Data, Declaration, Law, Parameter, Setting, Values
from .supply_limit import driven

# Share of a record's changes that are slower than its fastest; of those the time a kPa, times the starts.
FASTEST, LONGER, LONGEST = 0.95, (2.0,), 50.0


def _slow(law: Law, data: Data) -> tuple[Law, ...]:
    rates = [np.abs(np.gradient(e["pressure_kPa"], e["time_s"])) for e in driven(data)]
    fastest = max((float(np.nanquantile(r, FASTEST)) for r in rates), default=0.0)
    if not fastest:
        return ()
    starts = tuple(s / fastest for s in LONGER)
    size = attrs.evolve(law.parameters[0], high=LONGEST / fastest, starts=starts)
    return (attrs.evolve(law, parameters=(size,)),)


def _given(p: Array, v: Values, at: Setting) -> Array:
    x, found = float(p[0]), [float(p[0])]
    for to, most in zip(p[1:].tolist(), (np.diff(at.time_s) / v["slowness_s_kPa"]).tolist(), strict=True):
        x += min(max(to - x, -most), most)
        found.append(x)
    return np.array(found)


EFFECT = Declaration(
    mechanism="the supply cannot change its pressure as fast as was asked for and logged",
    reveals="a gauge at the unit, read beside the log; the same protocol at a third of the rate",
    remedy="ask for slower changes, or log a gauge at the unit",
    of=BENCH,
    instrument=True,
    laws=(
        Law(
            DRIVEN,
            (Parameter("slowness_s_kPa", "s/kPa", 0.0, 1.0, 0.0, (), "of its valve"),),
            {"supply": _given},
            offered=_slow,
        ),
    ),
)
