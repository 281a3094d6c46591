"""A pressure supply that does not follow its command: the log holds the command, the unit what it got."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...measured import Experiment
from ..effect import SUPPLY_LIMIT, SUPPLY_RATE, Effect, Parameter

Array = np.ndarray[Any, Any]

SHORT, SLOW = f"{SUPPLY_LIMIT}.short_kPa", f"{SUPPLY_RATE}.slowness_s_kPa"
# Of the largest pressure: what a supply may fall short by, and where fits begin.
MOST_SHORT, STARTS = 0.8, (0.15,)
# Share of a record's changes that are slower than its fastest; of those the time a kPa, times the starts.
FASTEST, LONGER, LONGEST = 0.95, (2.0,), 50.0


def supply(kind: str, experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Effects, for a kind, of the supply of pressure; none where no pressure changes over time."""
    own = [e for e in experiments if e.kind == kind and {"time_s", "pressure_kPa"} <= set(e.columns)]
    read = [e["pressure_kPa"] for e in own if len(e) > 1 and np.isfinite(e["pressure_kPa"]).all()]
    most = max((float(np.abs(p).max()) for p in read), default=0.0)
    rates = [np.abs(np.gradient(e["pressure_kPa"], e["time_s"])) for e in own if len(e) > 1]
    fastest = max((float(np.nanquantile(r, FASTEST)) for r in rates), default=0.0)
    if not (most > 0.0 and fastest > 0.0):
        return ()
    short = Parameter(
        "short_kPa",
        "kPa",
        0.0,
        MOST_SHORT * most,
        0.0,
        tuple(s * most for s in STARTS),
        "of the largest read",
    )
    slow = Parameter(
        "slowness_s_kPa",
        "s/kPa",
        0.0,
        LONGEST / fastest,
        0.0,
        tuple(s / fastest for s in LONGER),
        "of its valve",
    )
    return Effect(SUPPLY_LIMIT, (short,), (kind,)), Effect(SUPPLY_RATE, (slow,), (kind,))


def supplied(t: Array, p: Array, values: Mapping[str, float], largest_kPa: float) -> Array:
    """Pressure (n,) in kPa that a supply gives, at times t (n,) in s, where p (n,) is asked for.

    values: by "effect.parameter", see `supply`. largest_kPa: from which the limit falls short, of either
    sign.
    """
    if short := values.get(SHORT, 0.0):
        p = np.clip(p, short - largest_kPa, largest_kPa - short)
    if slow := values.get(SLOW, 0.0):
        x, found = float(p[0]), [float(p[0])]
        for to, most in zip(p[1:].tolist(), (np.diff(t) / slow).tolist(), strict=True):
            x += min(max(to - x, -most), most)
            found.append(x)
        p = np.array(found)
    return p
