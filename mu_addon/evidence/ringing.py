"""Ringing of a driven mass on a spring: the motion added by inertia."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from ..arrays import Array

# Shares of the critical damping, each for those within a factor of 1.6 of it.
DAMPINGS = (0.03, 0.08, 0.2)
# Between neighbouring frequencies, in dampings: one halfway between them keeps three quarters of its power.
APART = 1.5


def modes(low_Hz: float, high_Hz: float) -> tuple[Array, Array]:
    """Frequencies (k,) in Hz and damping ratios (k,), so close that any mode between the bounds is near one.

    Damping ratios are `DAMPINGS`, shares of the critical damping; with high_Hz not above low_Hz the result is
    empty.
    """
    found: list[tuple[float, float]] = []
    for damping in DAMPINGS:
        many = math.ceil(math.log(high_Hz / low_Hz) / (APART * damping)) + 1 if high_Hz > low_Hz else 0
        found += [(f, damping) for f in np.geomspace(low_Hz, high_Hz, many).tolist()]
    hertz, dampings = np.array(found).reshape(-1, 2).T
    return hertz, dampings


def ringing(time_s: Array, still: Array, hertz: Array, damping: Array) -> Array:
    """Motion (n, c, k) added by inertia to signals (n, c), of k modes that start at rest, in their unit.

    time_s (n,): ascending, in s; still (n, c): the signals without inertia; hertz (k,), damping (k,): as from
    `modes`. Solves x'' + 2 damping w x' + w^2 x = w^2 still and returns x - still; exact for signals linear
    between their samples.
    """
    w = 2.0 * np.pi * hertz
    rate = w * (-damping + 1j * np.sqrt(1.0 - damping**2))
    h = np.diff(time_s)[:, None]
    keeps = np.exp(rate * h)
    # The integral of exp(rate (h - s)) over a step, of a signal that stays and of one that grows from 0 to 1.
    stays = (keeps - 1.0) / rate
    grows = (stays - h) / (rate * h)
    z = -still[0, :, None] / rate
    found = np.zeros((*still.shape, len(hertz)))
    scale = w / np.sqrt(1.0 - damping**2)
    for i in range(len(h)):
        z = keeps[i] * z + still[i, :, None] * stays[i] + (still[i + 1] - still[i])[:, None] * grows[i]
        found[i + 1] = scale * z.imag - still[i + 1, :, None]
    return found


def swinging(time_s: Array, still: Array, hertz: float, damping: float) -> Array:
    """Signals (c, n) of a driven mode, from those without inertia (c, n), in the signals' unit.

    `still` plus the result of `ringing`, for one mode from rest: exact for signals that are linear between
    samples. time_s (n,): ascending, in s; hertz: undamped; damping: share of the critical one, below 1.
    """
    from scipy.linalg.lapack import ztbtrs

    stays, grows, band = _swing(time_s.tobytes(), hertz, damping)
    w = 2.0 * math.pi * hertz
    rate = w * (-damping + 1j * math.sqrt(1.0 - damping**2))
    driven = still[:, :-1] * stays + np.diff(still, axis=1) * grows
    driven = np.concatenate([-still[:, :1] / rate, driven], axis=1)
    z, _ = ztbtrs(band, driven.T, uplo="L", diag="U")
    return np.asarray(w / math.sqrt(1.0 - damping**2) * z.T.imag)


# Derivatives by anything but the mode need the same weights.
@lru_cache(maxsize=64)
def _swing(time_s: bytes, hertz: float, damping: float) -> tuple[Array, Array, Array]:
    """Weights (n - 1,) of a signal that stays and of one that grows in each step, and the band (2, n)."""
    time = np.frombuffer(time_s)
    w = 2.0 * math.pi * hertz
    rate = w * (-damping + 1j * math.sqrt(1.0 - damping**2))
    h = np.diff(time)
    keeps = np.exp(rate * h)
    # For steps much shorter than a period the difference of nearly equal numbers would lose its digits.
    x = rate * h
    small = np.abs(x) < 1e-3
    safe = np.where(small, 1.0, x)
    stays = np.where(small, h * (1.0 + x / 2.0 + x**2 / 6.0), (keeps - 1.0) / rate)
    grows = np.where(small, h * (0.5 + x / 6.0 + x**2 / 24.0), h * (keeps - 1.0 - x) / safe**2)
    # z_k - keeps z_(k-1) = drive: a band with ones on its diagonal.
    band = np.ones((2, len(time)), complex, order="F")
    band[1, :-1] = -keeps
    return stays, grows, band
