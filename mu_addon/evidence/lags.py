"""First-order lags, the play operator, and what follows from it: how a drive is remembered."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..arrays import Array

# Smaller reversals of a pressure in kPa are noise of the gauge.
DEADBAND_kPa = 0.2


def first_order_lag(t: Array, p: Array, time_s: float) -> Array:
    """Solution (n,) of time_s dx/dt + x = p from equilibrium, in the unit of p.

    t (n,): times in s. Exact for p (n,) linear between its samples; p itself where time_s is not positive.
    """
    from scipy.signal import lfilter

    if time_s <= 0.0:
        return p
    h = _steps(t.tobytes())
    if isinstance(h, float):
        a, b0, b1 = lag_weights(h, time_s)
        found, _ = lfilter([b1, b0], [1.0, -a], p, zi=[(1.0 - b1) * p[0]])
        return np.asarray(found)
    from scipy.linalg.lapack import dtbtrs

    b0, b1, band = _lag(t.tobytes(), time_s)
    driven = np.concatenate([p[:1], b0 * p[:-1] + b1 * p[1:]])
    found, _ = dtbtrs(band, driven[:, None], uplo="L", diag="U")
    return np.asarray(found[:, 0])


# Derivatives by anything but the time need the same weights.
@lru_cache(maxsize=256)
def _lag(t: bytes, time_s: float) -> tuple[Array, Array, Array]:
    """Weights (n - 1,) of `first_order_lag` over uneven steps, and the band (2, n) of its equations."""
    a, b0, b1 = lag_weights(_steps(t), time_s)
    # x_k - a x_(k-1) = drive: a band with ones on its diagonal.
    band = np.zeros((2, len(a) + 1), order="F")
    band[1, :-1] = -a
    return b0, b1, band


@lru_cache(maxsize=64)
def _steps(t: bytes) -> float | Array:
    """Steps (n - 1,) in s, read-only, between times (n,) in bytes; one number where they are equal."""
    h = np.diff(np.frombuffer(t))
    if np.ptp(h) <= 1e-9 * h.mean():
        return float(h.mean())
    h.flags.writeable = False
    return h


def lag_weights(h: Any, time_s: Any) -> tuple[Any, Any, Any]:
    """Weights of `first_order_lag` over steps h in s, for its state and for both ends of p."""
    a = np.exp(-h / time_s)
    mean = -np.expm1(-h / time_s) * time_s / h
    return a, mean - a, 1.0 - mean


def play_operator(p: Array, threshold: float) -> Array:
    """Play operator (n,) of p (n,) with half-width `threshold`, in the unit of p; it begins in the middle."""
    moves = np.diff(p)
    at = np.flatnonzero(moves)
    turned = np.flatnonzero(np.diff(np.sign(moves[at])))
    turns = at[turned + 1]
    # Between two turns the history is one number.
    x = float(p[0])
    before = [x]
    for v in p[turns].tolist():
        x = min(max(x, v - threshold), v + threshold)
        before.append(x)
    held = np.repeat(before, np.diff(turns, prepend=-1, append=len(p) - 1))
    return np.minimum(np.maximum(held, p - threshold), p + threshold)


def cycles(p: Array) -> Array:
    """Number of cycles completed (n,): travel of the pressure p (n,) in kPa over twice its range.

    Reversals smaller than `DEADBAND_kPa` are ignored.
    """
    smooth = play_operator(p, DEADBAND_kPa)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(smooth)))])
    extent = float(np.ptp(smooth))
    return travel / (2.0 * extent) if extent else travel


def smooth_at(time_s: Array, x: Array, delay_s: float = 0.0) -> Array:
    """Signal (n,) `delay_s` before times (n,) in s; the first and the last beyond the record.

    Missing values are interpolated by Akima's cubics: a straight line through a fast change errs as much as a
    late clock does.
    """
    from scipy.interpolate import Akima1DInterpolator

    seen = np.isfinite(x)
    if not delay_s and seen.all():
        return x
    if np.count_nonzero(seen) < 2:
        return np.full(len(time_s), x[seen][0])
    at = np.clip(time_s - delay_s, time_s[seen][0], time_s[seen][-1])
    return np.asarray(Akima1DInterpolator(time_s[seen], x[seen])(at))
