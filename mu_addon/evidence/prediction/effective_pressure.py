"""Effective pressure: at it a unit without memory would have the real unit's state.

Moduli scaled by one factor are the pressure divided by it. Moduli that relax by one factor change the
pressure to first order of the hereditary integral. Each record begins in equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

# Relaxation of the second law of viscoelasticity goes on for so many decades of time.
DECADES = 4
# Times of the third law of viscoelasticity, evenly by their logarithms.
TIMES = 7
# Pressure in kPa to whose energy that of Mullins softening is relative, as a value beside the effect's own.
REFERENCE = "mullins_softening.reference_kPa"


def in_the_chambers(t: Array, p: Array, values: Mapping[str, float]) -> Array:
    """Pressure (n,) in kPa in the chambers behind an air line and a leak, of p (n,) in kPa before them.

    t (n,): times in s. values: by "effect.parameter", of line_lag (either law) and leak.
    """
    leak, lag = values.get("leak.conductance_ratio", 0.0), values.get("line_lag.time_s", 0.0)
    slower = values.get("line_lag.slower_s", 0.0)
    if leak:
        # The line feeds the leak: tau dp_c/dt = p - p_c - leak p_c.
        p, lag, slower = p / (1.0 + leak), lag / (1.0 + leak), slower / (1.0 + leak)
    if slower:
        # One lag after the other, in partial fractions: exact for p linear between its samples.
        share = values.get("line_lag.faster_share", 0.3)
        p = (first_order_lag(t, p, slower) - share * first_order_lag(t, p, share * slower)) / (1.0 - share)
    return first_order_lag(t, p, lag)


def remembered(
    t: Array, p: Array, values: Mapping[str, float], reference_kPa: float, before_kPa: float = 0.0
) -> Array:
    """Pressure (n,) in kPa that puts a unit without memory into the same state, from that in the chambers.

    t (n,): times in s. values: by "effect.parameter", of viscoelasticity (any law), rate-independent
    hysteresis and Mullins softening, applied in this order. reference_kPa: its square is the default
    reference of the energy of softening; before_kPa: the largest absolute pressure before t begins.
    """
    get = values.get
    if share := get("viscoelasticity.share", 0.0):
        time = get("viscoelasticity.time_s", 1.0) / (1.0 - share)
        p = (1.0 - share) * p + share * first_order_lag(t, p, time)
    if share := get("viscoelasticity.per_decade", 0.0):
        p = (1.0 - DECADES * share) * p + share * decades_lag(t, p, get("viscoelasticity.onset_s", 1.0))
    if share := get("viscoelasticity.spread_share", 0.0):
        p = (1.0 - share) * p + share * spread_lag(t, p, values, 1.0 / (1.0 - share))
    if share := get("rate_independent_hysteresis.share", 0.0):
        slips = get("rate_independent_hysteresis.threshold_kPa", 2.0)
        p = (1.0 - share) * p + share * play_operator(p, slips)
    if softening := get("mullins_softening.softening", 0.0):
        width = get("mullins_softening.energy_share", 0.3) * get(REFERENCE, reference_kPa) ** 2
        p = p / mullins_softening(p, before_kPa, softening, width)
    return p


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


def decades_lag(t: Array, p: Array, onset_s: float) -> Array:
    """Sum (n,) of `first_order_lag` of p (n,) by times onset_s, ten times that, ..., over `DECADES`."""
    return np.asarray(sum(first_order_lag(t, p, onset_s * 10.0**k) for k in range(DECADES)))


def spread_lag(t: Array, p: Array, values: Mapping[str, float], longer: float = 1.0) -> Array:
    """Mean (n,) of `first_order_lag` of p (n,) by `TIMES` times around viscoelasticity's middle one.

    values: by "effect.parameter": the middle in s, and over how many decades the times spread. longer: factor
    on all of them.
    """
    middle, decades = (
        values.get(f"viscoelasticity.{k}", d) for k, d in (("middle_s", 1.0), ("decades", 2.0))
    )
    times = longer * middle * 10.0 ** (decades * np.linspace(-0.5, 0.5, TIMES))
    return np.asarray(sum(first_order_lag(t, p, time) for time in times.tolist()) / TIMES)


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


def mullins_softening(p: Array, before_kPa: float, softening: float, width: float) -> Array:
    """Share (n,) of the virgin modulus left, 1 - softening erf((W_max - W)/width), Ogden and Roxburgh 1999.

    p (n,): pressure in kPa. W and width, in kPa^2: W is the square of the pressure, as the energy of the
    virgin unit nearly is; before_kPa: the largest absolute pressure of earlier experiments.
    """
    from scipy.special import erf

    energy = p**2
    most = np.maximum(np.maximum.accumulate(energy), before_kPa**2)
    return np.asarray(1.0 - softening * erf((most - energy) / width))
