"""Measured series as used in a fit: block means, and their positions in one long vector."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError, MuError
from ..measured import Experiment
from .readings import display_steps, quantum, stretch
from .simulator import Composite

# Blocks a record may have; longer records are averaged over whole blocks, and their predictions alike.
BLOCKS = 600
KNOWN = "spread known"


@attrs.frozen(eq=False)
class Series:
    """One channel of one experiment: rows `at` (slice) of the record's long vector of values.

    experiment: its number in the record. group: name shared by series of the same noise. row: of the
    prediction (channels, n). time_s (b,): mean times of the b blocks in s, nan without a clock; count (b,):
    samples in each block; sample_s: median time between samples in s, or nan. step: of its readings'
    resolution, in the channel's unit, 0 without one; stays: number of unchanged readings in a row, around a
    reading (`readings.stretch`). louder (b,): white noise of each block over the usual, None if it is 1
    throughout (`scatter.with_bursts`).
    """

    experiment: int
    channel: str
    row: int
    group: str
    at: slice
    time_s: Array
    count: Array
    sample_s: float
    step: float
    stays: float
    _seen: Array = attrs.field(repr=False)
    _first: Array = attrs.field(repr=False)
    _kept: Array = attrs.field(repr=False)
    _spread: Array | None = attrs.field(repr=False, default=None)
    louder: Array | None = None

    @cached_property
    def clock(self) -> tuple[Any, ...]:
        """Hashable key: equal for series whose blocks have the same sizes and distances in time, to rounding.

        Without a clock it depends on the number of blocks alone.
        """
        if math.isnan(self.sample_s):
            return (len(self.time_s),)
        apart = np.round(np.diff(self.time_s) / self.sample_s, 9)
        louder = None if self.louder is None else self.louder.tobytes()
        return f"{self.sample_s:.12g}", self.count.tobytes(), apart.tobytes(), louder

    @cached_property
    def blocks(self) -> tuple[Any, ...]:
        """Hashable key: equal for series of an experiment whose samples are averaged over the same blocks."""
        spread = None if self._spread is None else self._spread.tobytes()
        return self._seen.tobytes(), spread

    def samples(self, block: int) -> slice:
        """Samples of the experiment in a block, numbered among those with a value."""
        at = int(np.flatnonzero(self._kept)[block])
        end = int(self._first[at + 1]) if at + 1 < len(self._first) else len(self._seen)
        return slice(int(self._first[at]), end)

    def mean(self, values: Array) -> Array:
        """Block means (..., b) of samples (..., n), missing samples left out.

        For a record whose spread is given, one number: the amplitude of the spread that fits the samples
        best.
        """
        if self._spread is not None:
            # The whole record is offset together: it is one number, in units of its spread.
            return np.asarray(values @ self._spread / (self._spread @ self._spread))[..., None]
        if len(self._first) == values.shape[-1]:
            return values if self._kept.all() else values[..., self._kept]
        whole = self._seen.all()
        total = np.add.reduceat(values if whole else np.where(self._seen, values, 0.0), self._first, axis=-1)
        return np.asarray((total if whole else total[..., self._kept]) / self.count)


@attrs.frozen(eq=False)
class Record:
    """Series of several experiments, their measured values (N,) as one vector, groups together.

    values: in the unit of each channel, in standard deviations where a record's spread is given. again: the
    experiments driven by a second reading of the same gauges, see `drive.denoised_drives`.
    """

    experiments: tuple[Experiment, ...]
    series: tuple[Series, ...]
    values: Array
    again: tuple[Experiment, ...] | None = None

    def __len__(self) -> int:
        return len(self.values)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of series, in their order."""
        return tuple(dict.fromkeys(s.group for s in self.series))

    def predict(self, simulator: Composite, values: Mapping[str, float]) -> Array:
        """Prediction (N,) of the measured values, in their units, for parameters by key."""
        known = {i: simulator.predict(e, values) for i, e in enumerate(self.experiments)}
        found = np.empty(len(self))
        for s, rows, at in self._together:
            found[at] = s.mean(known[s.experiment][rows])
        return found

    def possible(self, simulator: Composite, values: Mapping[str, float]) -> Array | None:
        """Return `predict`; None where the model has no prediction, or one that is not finite.

        A law beyond its range or a body without equilibrium cannot be that of measured data.
        """
        try:
            found = self.predict(simulator, values)
        except MuError:
            return None
        return found if np.isfinite(found).all() else None

    @cached_property
    def _together(self) -> list[tuple[Series, list[int], Array]]:
        """Series of one experiment with the same blocks: the first, prediction's rows, positions (r, b)."""
        alike: dict[Any, list[Series]] = {}
        for s in self.series:
            alike.setdefault((s.experiment, s.blocks), []).append(s)
        return [
            (same[0], [s.row for s in same], np.stack([np.arange(s.at.start, s.at.stop) for s in same]))
            for same in alike.values()
        ]

    def rows(self, experiment: int) -> Array:
        """Boolean mask (N,) of the values that an experiment, by its number, gave."""
        chosen = np.zeros(len(self), bool)
        for s in self.series:
            if s.experiment == experiment:
                chosen[s.at] = True
        return chosen

    def driven(self, experiment: int, column: str) -> bool:
        """Return True if a column of an experiment is a drive: present and not predicted."""
        predicted = {s.channel for s in self.series if s.experiment == experiment}
        return column in self.experiments[experiment].columns and column not in predicted

    def covariate(self, of: Any) -> Array:
        """Block means (N,) of a quantity; `of(experiment)` gives it for the samples (n,), in any unit."""
        columns = [np.asarray(of(e), float) * np.ones((1, len(e))) for e in self.experiments]
        return np.asarray(self.laid_out(columns.__getitem__)[:, 0])

    def laid_out(self, columns: Callable[[int], Array]) -> Array:
        """Block means (N, d) of d quantities; `columns(i)` gives them for experiment i's samples (d, n)."""
        parts = [(s.mean(columns(s.experiment)), at) for s, _, at in self._together]
        found = np.empty((len(self), len(parts[0][0])), order="F")
        for means, at in parts:
            found[at] = means.T
        return found

    @cached_property
    def of_experiment(self) -> Array:
        """Number (N,) of the experiment that gave each value."""
        found = np.empty(len(self), int)
        for s in self.series:
            found[s.at] = s.experiment
        return found


# Columns that may be drives, unless they are predicted.
DRIVES = ("pressure_kPa", "angle_deg", "strain", "displacement_mm")
# Share of its range by which a drive may differ between repeats.
ALIKE = 0.05


def repeats(record: Record, one: Series, other: Series) -> bool:
    """Return True if two series are one channel of experiments with the same protocol, sample by sample.

    Their clocks must agree to a sample, each drive to `ALIKE` of its range, and all other settings.
    """
    a, b = (record.experiments[s.experiment] for s in (one, other))
    if (one.channel, a.kind, len(a)) != (other.channel, b.kind, len(b)) or "time_s" not in a.columns:
        return False
    if any(getattr(a, name) != getattr(b, name) for name in _SETTINGS) or "time_s" not in b.columns:
        return False
    if np.nanmedian(np.abs(a[one.channel] - b[one.channel])) == 0.0:
        # A copy of a file, or a display too coarse to tell by.
        return False
    clock = np.abs((a["time_s"] - a["time_s"][0]) - (b["time_s"] - b["time_s"][0])).max()
    driven = [c for c in DRIVES if c in b.columns and record.driven(one.experiment, c)]
    return (
        bool(clock < np.median(np.diff(a["time_s"])))
        and bool(driven)
        and all(np.abs(a[c] - b[c]).max() < ALIKE * max(float(np.ptp(a[c])), 1e-9) for c in driven)
    )


_SETTINGS = ("scale", "orientation_deg", "added_mass_g", "axis", "mode", "section_mm", "length_mm", "cells")


def record(experiments: Sequence[Experiment], simulator: Composite, blocks: int = BLOCKS) -> Record:
    """The predicted channels of the experiments as one vector of block means.

    blocks: most blocks a series may have. Experiments of unknown kinds are left out, and so is a channel that
    equals another one of its experiment to the last digit. Raises InputError if no reading is left or a given
    spread is 0 throughout.
    """
    kept = tuple(e for e in experiments if simulator.knows(e))
    parts: list[tuple[str, Any]] = []
    steps = display_steps(kept, simulator)
    for i, e in enumerate(kept):
        seen_before: list[Array] = []
        for row, channel in enumerate(simulator.channels(e)):
            values = e[channel]
            if any(np.array_equal(values, other, equal_nan=True) for other in seen_before):
                continue
            seen_before.append(values)
            parts.append(_series(i, e, row, channel, blocks, steps[e.kind, channel]))
    # Stable: experiments keep their order within a group.
    parts.sort(key=lambda part: part[0])
    if not parts:
        raise InputError("no experiment can be predicted", "measured data", "add one that the model has")
    series, values_, start = [], [], 0
    for group, (fields, values) in parts:
        s = Series(group=group, at=slice(0, 0), **fields)
        means = s.mean(values)
        series.append(attrs.evolve(s, at=slice(start, start + len(means))))
        values_.append(means)
        start += len(means)
    return Record(kept, tuple(series), np.concatenate(values_))


def _series(i: int, e: Experiment, row: int, channel: str, blocks: int, step: float) -> tuple[str, Any]:
    values = e[channel]
    n = len(values)
    seen = np.isfinite(values)
    head, _, unit = channel.rpartition("_")
    spread = e.columns.get(f"{head}_sd_{unit}")
    if spread is not None and not spread.any():
        raise InputError(
            f"{head}_sd_{unit} is 0 throughout", e.name, "give the record's standard deviation, or none"
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
        "step": max(quantum(values), step),
        "stays": stretch(values),
        "seen": seen,
        "first": first,
        "kept": kept,
        "spread": spread,
    }
    return group, (fields, np.where(seen, values, 0.0) if spread is None else values)
