"""Instants between samples: corners of a drive between straight lines, and substeps of fast changes.

A regulator turns at corners, seldom at a sample. Anything that integrates the drive (a mass, a line, a resin
that relaxes) depends on its true course, not on the chord from sample to sample.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array

# Slopes on one side of a corner are alike to this share of what the slope changes by there.
STRAIGHT = 0.05
# Share of the change of slope at a turn by which slopes beside it may differ from straight lines'.
TURNED = 0.2
# A way of more than this share of the record's range between two instants is divided, into so many at most.
SHARE, MOST = 0.05, 8


def finer(t: Array, drive: Array) -> tuple[Array, Array, Array]:
    """Times (m,) in s, the drive (m,) there in its unit, and the indices (n,) of the samples among them.

    t (n,), drive (n,): samples, times ascending. A corner is inserted where the lines through the neighbours
    of two samples cross between them, if on one side the line holds for two steps or more. Then fast changes
    are divided evenly. Linear between the samples elsewhere.
    """
    if len(t) < 6 or not np.ptp(drive):
        return t, drive, np.arange(len(t))
    _, at, value = _corners(t, drive)
    times = np.concatenate([t, at])
    order = np.argsort(times, kind="stable")
    times, values = times[order], np.concatenate([drive, value])[order]
    pieces = np.abs(np.diff(values)) / (SHARE * float(np.ptp(drive)))
    parts = np.clip(np.ceil(pieces), 1, MOST).astype(int)
    whole = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(whole)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[whole]
    dense = np.append(times[whole] + share * np.diff(times)[whole], times[-1])
    found = np.append(values[whole] + share * np.diff(values)[whole], values[-1])
    places = np.append(np.cumsum(parts) - parts, len(whole))
    return dense, found, places[np.flatnonzero(order < len(t))]


def turns(t: Array, x: Array) -> Array:
    """The largest value (n,) since the sample before, where x turns downward between two samples.

    t (n,), x (n,): times and samples. A machine moves straight to a turning point and back, seldom at a
    sample: lines through the samples on either side meet there. x itself elsewhere, and where x is round.
    """
    found, (step, _, value) = x.copy(), _corners(t, x, np.maximum, TURNED)
    higher = value > x[step]
    found[step[higher] + 1] = value[higher]
    return np.maximum(found, x)


def _corners(
    t: Array, x: Array, sides: np.ufunc = np.minimum, straight: float = STRAIGHT
) -> tuple[Array, Array, Array]:
    """Steps (c,) with a corner strictly between their samples, its time and its value.

    sides: np.minimum or np.maximum, where one or both sides of it must be straight, to that share of its
    bend.
    """
    h = np.diff(t)
    slope = np.diff(x) / h
    # Steps around each that may hold a corner: two before it and two after it.
    before, up, down, after = slope[:-4], slope[1:-3], slope[3:-1], slope[4:]
    first, last, step = x[2:-3], x[3:-2], h[2:-2]
    bend = down - up
    alike = sides(np.abs(before - up), np.abs(after - down)) < straight * np.abs(bend)
    at = np.divide(first + down * step - last, bend, out=np.zeros_like(step), where=alike)
    # To rounding a corner at a sample is that sample.
    inside = np.flatnonzero(alike & (at > 1e-6 * step) & (at < (1.0 - 1e-6) * step))
    return inside + 2, (t[2:-3] + at)[inside], (first + up * at)[inside]
