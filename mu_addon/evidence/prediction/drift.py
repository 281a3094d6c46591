"""Drift of an instrument's zero while it records: one mechanism, by four laws.

Relaxation is a rival of every drift: `evidence.rivals` fits both and compares them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ...measured import Experiment
from ..effect import Effect, Parameter

Array = np.ndarray[Any, Any]

# Times of a law's course in s, and where fits of it begin, as shares of the longest record.
SHORTEST_s, LONGEST_s, NULL_s = 0.5, 1e4, 30.0
EARLY = (0.02, 0.2)
# Of the largest reading: a gauge with a larger offset of its zero is noticed before any measurement.
OFFSET_SHARE, LEAST_OFFSET_kPa = 0.1, 1.0


def drifts(name: str, unit: str, most: float, kind: str, experiments: Sequence[Experiment]) -> list[Effect]:
    """The laws of a zero that drifts, as effects of one name for a kind; none without a clock.

    most: largest size of the drift within a record, in `unit`. Zeros drift equally in every record, from its
    beginning: linearly, as the logarithm of time, or as a settling exponential. If one of these is found, a
    power of time is tried (diffusing heat: the root).
    """
    clocks = [e["time_s"] for e in experiments if e.kind == kind and "time_s" in e.columns and len(e) > 1]
    lasts = max((float(t[-1] - t[0]) for t in clocks), default=0.0)
    if not (lasts > 0.0 and most > 0.0):
        return []

    def size(key: str, of: str, most: float) -> Parameter:
        return Parameter(key, of, -most, most, 0.0, (0.1 * most,), "sheets, by the largest reading")

    def time(key: str) -> Parameter:
        early = tuple(min(max(share * lasts, SHORTEST_s), LONGEST_s) for share in EARLY)
        return Parameter(key, "s", SHORTEST_s, LONGEST_s, NULL_s, early, "warming, creep of the element")

    return [
        Effect(name, (size("per_hour", f"{unit}/h", most * 3600.0 / lasts),), (kind,)),
        Effect(name, (size("per_decade", unit, most), time("onset_s")), (kind,)),
        Effect(name, (size("settled", unit, most), time("settling_s")), (kind,)),
        Effect(
            name,
            (
                size("over_100_s", unit, most * max(1.0, 100.0 / lasts)),
                Parameter("power", "", 0.1, 2.0, 0.5, (0.5,), "heat that spreads 0.5, a steady rate 1"),
            ),
            (kind,),
            refines=True,
        ),
    ]


def drift(name: str, time_s: Array, values: Mapping[str, float]) -> Array | float:
    """Drift (n,) of a zero at times (n,) in s since the record's first, in the unit of its effect; 0 without.

    values: by "effect.parameter", see `drifts`. The sum of r t, a log10(1 + t/onset), b (1 - exp(-t/time))
    and c (t/100 s)^n.
    """
    get = values.get
    found: Array | float = 0.0
    t = time_s - time_s[0]
    if per_hour := get(f"{name}.per_hour", 0.0):
        found = found + per_hour * t / 3600.0
    if per_decade := get(f"{name}.per_decade", 0.0):
        found = found + per_decade * np.log10(1.0 + t / get(f"{name}.onset_s", NULL_s))
    if settled := get(f"{name}.settled", 0.0):
        found = found - settled * np.expm1(-t / get(f"{name}.settling_s", NULL_s))
    if over := get(f"{name}.over_100_s", 0.0):
        found = found + over * (t / 100.0) ** get(f"{name}.power", 0.5)
    return found


def zeroed(effects: Iterable[Effect], kind: str, experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Effects of a kind, with its gauge's offset bounded by a share of the reading, or 1 kPa."""
    most = max(OFFSET_SHARE * largest_reading("pressure_kPa", kind, experiments), LEAST_OFFSET_kPa)
    return tuple(
        attrs.evolve(e, parameters=(e.parameters[0].narrowed(-most, most), *e.parameters[1:]))
        if e.name == "pressure_offset"
        else e
        for e in effects
    )


def largest_reading(column: str, kind: str, experiments: Sequence[Experiment]) -> float:
    """The largest magnitude in a column of the experiments of a kind, in the column's unit; 0 without any."""
    read = [e[column] for e in experiments if e.kind == kind and column in e.columns]
    return max((float(np.nanmax(np.abs(v))) for v in read if np.isfinite(v).any()), default=0.0)
