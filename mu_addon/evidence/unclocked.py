"""Readings without a clock that are isolated in a fit's residual: poses at rest, points of a curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..arrays import Array
from ..measured import Experiment

TURN = "orientation_deg"
DRIVES = ("pressure_kPa", "strain", "added_mass_g", TURN)
# Points whose median residual is the reference, and the standard deviations from it that are wrong.
AROUND, WRONG = 9, 8.0
# Most points that may be wrong in a row, and in all, as a share.
IN_A_ROW, MOST = 2, 0.1
# A misfit is too steep to tell by it if no more than this share differs from the median around it.
STEEP = 0.5
# Share of a drive's largest value within which two experiments are read at the same place.
SAME = 0.01
# Orientations cover a whole turn if no gap exceeds this many times the median one.
CLOSED = 1.5


@attrs.frozen(eq=False)
class Points:
    """Readings of one channel of an experiment without a clock, as n points in the order of their drives.

    rows (n,): of the experiment. off (n,): reading less prediction, in the channel's unit. drive: name of the
    drive that varies most. places (n, d): every drive in its unit. closed: the order is cyclic, as in a full
    turn. step: of the display, in the channel's unit.
    """

    experiment: Experiment
    channel: str
    rows: Array
    off: Array
    drive: str
    places: Array
    closed: bool
    step: float

    @property
    def away(self) -> Array:
        """Distance (n,) of each point from the median of those around it, itself included."""
        mode: Any = "wrap" if self.closed else "reflect"
        around = sliding_window_view(np.pad(self.off, AROUND // 2, mode), AROUND)
        return np.asarray(self.off - np.median(around, axis=1))


def points(experiment: Experiment, channel: str, predicted: Array, step: float) -> Points | None:
    """The points of a channel with its prediction (n,); None if they are too few.

    None, too, if a spread of the record is given: it counts as one number. step: of the display, in the
    channel's unit, 0 without one.
    """
    head, _, unit = channel.rpartition("_")
    off = experiment[channel] - predicted
    rows = np.flatnonzero(np.isfinite(off))
    drives = [c for c in DRIVES if c in experiment.columns]
    if len(rows) < AROUND or not drives or f"{head}_sd_{unit}" in experiment.columns:
        return None
    places = np.stack([experiment[c][rows] for c in drives], axis=1)
    shares = places / np.maximum(np.abs(places).max(axis=0), 1e-300)
    main = int(np.argmax(np.ptp(shares, axis=0)))
    # Drives that are held, up to how well, come before the one that is changed.
    held = np.delete(np.round(shares / (2.0 * SAME)), main, axis=1)
    order = np.lexsort([places[:, main], *held.T])
    closed = drives[main] == TURN and not np.ptp(held, axis=0).any() and _closed(places[:, main])
    off, places = off[rows][order], places[order]
    return Points(experiment, channel, rows[order], off, drives[main], places, closed, step)


def _closed(orientation_deg: Array) -> bool:
    apart = np.unique(np.round(orientation_deg % 360.0, 6))
    gaps = np.diff(apart, append=apart[0] + 360.0)
    return bool(gaps.max() < CLOSED * np.median(gaps))


def lone(every: Sequence[Points]) -> list[Array]:
    """Masks (n,) of isolated points, for one channel of one kind in several experiments.

    These are `WRONG` standard deviations from the median of the points around them, and at most `MOST` of an
    experiment. A point does not count if it may show a wrong model: near an end, beyond which the course is
    unknown, among more than `IN_A_ROW`, or if others at the same place deviate equally.
    """
    away = np.abs(np.concatenate([p.away for p in every]))
    if np.count_nonzero(away) <= STEEP * len(away):
        return [np.zeros(len(p.rows), bool) for p in every]
    largest = max(float(np.ptp(p.off)) for p in every)
    scale = max(float(np.median(away[away > 0.0])) / 0.6745, max(p.step for p in every) / math.sqrt(12.0))
    scale = max(scale, 1e-9 * largest)
    found = []
    for p in every:
        alone = np.abs(p.away) > WRONG * scale
        if not p.closed:
            alone[:IN_A_ROW] = alone[-IN_A_ROW:] = False
        alone &= ~in_a_run(alone, p.closed)
        for i in np.flatnonzero(alone):
            alone[i] = not _likewise(p, int(i), every)
        few = np.count_nonzero(alone) <= max(1, round(MOST * len(alone)))
        found.append(alone if few else np.zeros(len(alone), bool))
    return found


def in_a_run(alone: Array, closed: bool = False) -> Array:
    """Mask (n,) of points that are among more than `IN_A_ROW` in a row of a mask (n,)."""
    mode: Any = "wrap" if closed else "constant"
    runs = sliding_window_view(np.pad(alone, IN_A_ROW, mode), IN_A_ROW + 1).all(axis=1)
    return np.asarray(sliding_window_view(runs, IN_A_ROW + 1).any(axis=1))


def _likewise(p: Points, i: int, every: Sequence[Points]) -> bool:
    """Return True if others are read where point i is, and each is off to its side by half as much."""
    beside = []
    alike = [o for o in every if o.places.shape[1] == p.places.shape[1]]
    largest = np.max([np.abs(o.places).max(axis=0) for o in alike], axis=0)
    for o in alike:
        apart = (np.abs(o.places - p.places[i]) / np.maximum(largest, 1e-300)).max(axis=1)
        if o is p:
            apart[i] = math.inf
        j = int(np.argmin(apart))
        if apart[j] <= (0.0 if o is p else SAME):
            beside.append(float(o.away[j] / p.away[i]))
    return bool(beside) and min(beside) > 0.5
