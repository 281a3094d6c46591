"""Measured series as the fit sees them: block means, and their places in one long vector."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..measured import Experiment
from .simulator import Composite

Array = np.ndarray[Any, Any]

# Blocks a record may have; longer records are averaged over whole blocks, and their predictions alike.
BLOCKS = 600
KNOWN = "spread known"


@attrs.frozen(eq=False)
class Series:
    """One channel of one experiment: rows `at` (slice) of the long vector.

    group: series that share their noise; time_s (b,) of blocks, nan where the record has no clock; count
    (b,) samples a block; sample_s: between samples. row: of the prediction.
    """

    experiment: int
    channel: str
    row: int
    group: str
    at: slice
    time_s: Array
    count: Array
    sample_s: float
    _seen: Array = attrs.field(repr=False)
    _first: Array = attrs.field(repr=False)
    _kept: Array = attrs.field(repr=False)
    _spread: Array | None = attrs.field(repr=False, default=None)

    def mean(self, values: Array) -> Array:
        """Block means (b,) of samples (n,)."""
        if self._spread is not None:
            # The whole record lies too high or too low together: it is one number, in units of its spread.
            return np.array([self._spread @ values / (self._spread @ self._spread)])
        if len(self._first) == len(values):
            return values[self._kept]
        total = np.add.reduceat(np.where(self._seen, values, 0.0), self._first)
        return np.asarray(total[self._kept] / self.count)


@attrs.frozen(eq=False)
class Record:
    """Series of several experiments, their measured values (N,) as one vector, series of a group together."""

    experiments: tuple[Experiment, ...]
    series: tuple[Series, ...]
    values: Array

    def __len__(self) -> int:
        return len(self.values)

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups of series, in their order."""
        return tuple(dict.fromkeys(s.group for s in self.series))

    def predict(self, simulator: Composite, values: Mapping[str, float]) -> Array:
        """Prediction (N,) of the measured values."""
        known = {i: simulator.predict(e, values) for i, e in enumerate(self.experiments)}
        found = np.empty(len(self))
        for s in self.series:
            found[s.at] = s.mean(known[s.experiment][s.row])
        return found

    def rows(self, experiment: int) -> Array:
        """Which of the N values (N,) an experiment gave."""
        chosen = np.zeros(len(self), bool)
        for s in self.series:
            if s.experiment == experiment:
                chosen[s.at] = True
        return chosen

    def driven(self, experiment: int, column: str) -> bool:
        """Whether a column of an experiment says what was done to it, rather than what came of it."""
        predicted = {s.channel for s in self.series if s.experiment == experiment}
        return column in self.experiments[experiment].columns and column not in predicted

    def covariate(self, of: Any) -> Array:
        """A quantity (N,) of every value: `of(experiment)` gives it for its samples (n,)."""
        found = np.empty(len(self))
        for i, e in enumerate(self.experiments):
            quantity = np.asarray(of(e), float) * np.ones(len(e))
            for s in self.series:
                if s.experiment == i:
                    found[s.at] = s.mean(quantity)
        return found


def record(experiments: Sequence[Experiment], simulator: Composite, blocks: int = BLOCKS) -> Record:
    """What the simulator predicts of the experiments, as measured.

    A channel that repeats another one of its experiment to the last digit brings nothing and is left out.
    Raises InputError where nothing is left.
    """
    kept = tuple(e for e in experiments if simulator.knows(e))
    parts: list[tuple[str, Any]] = []
    for i, e in enumerate(kept):
        seen_before: list[Array] = []
        for row, channel in enumerate(simulator.channels(e)):
            values = e[channel]
            if any(np.array_equal(values, other, equal_nan=True) for other in seen_before):
                continue
            seen_before.append(values)
            parts.append(_series(i, e, row, channel, blocks))
    # Stable: experiments keep their order within a group.
    parts.sort(key=lambda part: part[0])
    if not parts:
        raise InputError("no experiment can be predicted", "measured data", "add one the model knows")
    series, values_, start = [], [], 0
    for group, (fields, values) in parts:
        s = Series(group=group, at=slice(0, 0), **fields)
        means = s.mean(values)
        series.append(attrs.evolve(s, at=slice(start, start + len(means))))
        values_.append(means)
        start += len(means)
    return Record(kept, tuple(series), np.concatenate(values_))


def _series(i: int, e: Experiment, row: int, channel: str, blocks: int) -> tuple[str, Any]:
    values = e[channel]
    n = len(values)
    seen = np.isfinite(values)
    head, _, unit = channel.rpartition("_")
    spread = e.columns.get(f"{head}_sd_{unit}")
    if spread is not None and not spread.any():
        raise InputError(
            f"{head}_sd_{unit} is 0 throughout", e.name, "give by how much the record may be off, or none"
        )
    per = max(1, math.ceil(n / blocks))
    first = np.arange(0, n, per)
    count = np.add.reduceat(seen.astype(float), first)
    kept = count > 0
    clock = e.columns.get("time_s")
    time = np.full(n, math.nan) if clock is None else clock
    centre = (np.add.reduceat(np.where(seen, time, 0.0), first)[kept]) / count[kept]
    sample = float(np.median(np.diff(time))) if clock is not None and n > 1 else math.nan
    quantity = "marker" if channel.startswith("marker") else head
    group = KNOWN if spread is not None else f"{e.kind} {quantity}"
    fields = {
        "experiment": i,
        "channel": channel,
        "row": row,
        "time_s": centre,
        "count": count[kept],
        "sample_s": sample,
        "seen": seen,
        "first": first,
        "kept": kept,
        "spread": spread,
    }
    return group, (fields, np.where(seen, values, 0.0) if spread is None else values)
