"""Drift of an instrument's zero while it records: one mechanism, by four laws.

Relaxation is a rival of every drift: `evidence.rivals` fits both and compares them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import attrs
import numpy as np

from ..arrays import Array
from .effects.declaration import Action, Data, Law
from .parameter import Parameter

# Times of a law's course in s, and where fits of it begin, as shares of the longest record.
SHORTEST_s, LONGEST_s, NULL_s = 0.5, 1e4, 30.0
EARLY = (0.02, 0.2)


def drift_laws(
    kinds: tuple[str, ...], unit: str, most: Callable[[Data], float], acts: Mapping[str, Action]
) -> tuple[Law, ...]:
    """The laws of a zero that drifts, offered where there is a clock.

    most: largest size of the drift within a record of these data, in `unit`. Zeros drift equally in every
    record, from its beginning: linearly, as the logarithm of time, or as a settling exponential. If one of
    these is found, a power of time is tried (diffusing heat: the root).
    """

    def size(name: str, of: str = unit) -> Parameter:
        return Parameter(name, of, -1.0, 1.0, 0.0, (), "sheets, by the largest reading")

    def time(name: str) -> Parameter:
        return Parameter(name, "s", SHORTEST_s, LONGEST_s, NULL_s, (), "warming, creep of the element")

    def bounded(law: Law, data: Data) -> tuple[Law, ...]:
        clocks = [e["time_s"] for e in data.own if "time_s" in e.columns and len(e) > 1]
        lasts = max((float(t[-1] - t[0]) for t in clocks), default=0.0)
        if not (lasts > 0.0 and (largest := most(data)) > 0.0):
            return ()
        first, *shape = law.parameters
        largest *= {"per_hour": 3600.0 / lasts, "over_100_s": max(1.0, 100.0 / lasts)}.get(first.name, 1.0)
        first = attrs.evolve(first, low=-largest, high=largest, starts=(0.1 * largest,))
        early = tuple(min(max(share * lasts, SHORTEST_s), LONGEST_s) for share in EARLY)
        found = (first, *(p if p.starts else attrs.evolve(p, starts=early) for p in shape))
        return (attrs.evolve(law, parameters=found),)

    power = Parameter("power", "", 0.1, 2.0, 0.5, (0.5,), "heat that spreads 0.5, a steady rate 1")
    return (
        Law(kinds, (size("per_hour", f"{unit}/h"),), acts, offered=bounded),
        Law(kinds, (size("per_decade"), time("onset_s")), acts, offered=bounded),
        Law(kinds, (size("settled"), time("settling_s")), acts, offered=bounded),
        Law(kinds, (size("over_100_s"), power), acts, refines=True, offered=bounded),
    )


def drift(time_s: Array, values: Mapping[str, float]) -> Array | float:
    """Drift (n,) of a zero at times (n,) in s since the record's first, in its unit, by one of `drift_laws`.

    values: by name of the parameters: r t, a log10(1 + t/onset), b (1 - exp(-t/time)) or c (t/100 s)^n.
    """
    t = time_s - time_s[0]
    if "onset_s" in values:
        return values["per_decade"] * np.log10(1.0 + t / values["onset_s"])
    if "settling_s" in values:
        return -values["settled"] * np.expm1(-t / values["settling_s"])
    if "power" in values:
        return values["over_100_s"] * (t / 100.0) ** values["power"]
    return values["per_hour"] * t / 3600.0
