"""The gas balance of a chamber whose valve was shut: p V = m R T."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..measured import Experiment
from ..measured.folder import ATMOSPHERE_kPa
from .lags import lag_weights

# The column of a room's temperature, where it was logged.
ROOM = "room_C"
ROOM_K = 296.0
AIR_GAMMA = 1.4
# Steps of a hold, at least; where more are wanted; in the onset of creep; in the time constant of a leak.
FEW_STEPS, MANY_STEPS, MANY, STEPS = 50, 200, 12, 4
# Creep is spread over these decades after its onset.
DECADES = 6
# Length of the readings that determine a hold's start.
BEGINNING_s = 1.0


@attrs.frozen(eq=False)
class Chamber:
    """A chamber from the moment at which its valve was shut; without more it keeps its pressure initial_kPa.

    compliance_per_kPa: C, growth of the volume with the pressure. creep_per_kPa: c in 1/kPa, by which it
    grows in each decade of time from onset_s on. softness: growths of the volume in 1/kPa at times (n,) in s,
    in proportion to the pressure then. warming: relative changes of the gas's temperature at times (n,).
    flow: rate in 1/s at which gas is lost, of that of the chamber at one atmosphere, at a pressure in
    atmospheres, until tight_s; loss_per_s: its size; abrupt_s: time within which it begins or ends.
    """

    initial_kPa: float
    compliance_per_kPa: float = 0.0
    creep_per_kPa: float = 0.0
    onset_s: float = 1.0
    softness: tuple[Callable[[Array], Array], ...] = ()
    warming: tuple[Callable[[Array], Array], ...] = ()
    flow: Callable[[float], float] | None = None
    loss_per_s: float = 0.0
    abrupt_s: float = math.inf
    tight_s: float = math.inf

    def _soft(self, t: Array) -> Array:
        return sum((grown(t) for grown in self.softness), np.zeros_like(t))

    def _warm(self, t: Array) -> Array:
        return sum((changed(t) for changed in self.warming), np.ones_like(t))

    def pressure_kPa(self, time_s: Array) -> Array:
        """Gauge pressure (n,) in kPa at times (n,) in s after the valve was shut; up to then initial_kPa.

        With P absolute, P0 the atmosphere, V and T relative to the start: P V = P_i m T, P_i dm/dt = -P0
        flow(P/P0), V = 1 + C (p - p_i) + softness p + the sum over decades d of c x_d, where x_d follows p
        with the time onset 10^d.
        """
        end, start, compliance = float(time_s[-1]), self.initial_kPa + ATMOSPHERE_kPa, self.compliance_per_kPa
        still = not (self.flow or self.creep_per_kPa or self.softness or self.warming)
        if still or end <= 0:
            return np.full(len(time_s), float(self.initial_kPa))
        # Runge and Kutta's method is stable below 2.8 steps a time constant, and four are accurate. What
        # begins or ends at a moment needs more of them.
        fast_s = 0.0 if end > self.abrupt_s else self.onset_s if self.creep_per_kPa else end
        lost = end * self.loss_per_s * start / ATMOSPHERE_kPa
        wanted = max(FEW_STEPS, MANY * end / max(fast_s, 1e-9), 8 * STEPS * lost)
        steps = int(np.clip(max(min(wanted, MANY_STEPS), STEPS * lost), 1, 20000))
        t = np.linspace(0.0, end, 2 * steps + 1)
        warm, soft = self._warm(t), self._soft(t)
        creeping = _creeping(t, self.onset_s) if self.creep_per_kPa else np.zeros_like
        p, grown, gas, change = np.full_like(t, self.initial_kPa), np.zeros_like(t), np.ones_like(t), start
        for turn in range(50):
            before = p
            if self.creep_per_kPa:
                grown = self.creep_per_kPa * creeping(p)
            rest = 1 + grown - compliance * start - soft * ATMOSPHERE_kPa
            # The gas that is lost hardly depends on what is left to find of the pressure.
            if self.flow and (turn < 4 or change > 1e-5 * start):
                gas = _lost(t, start * warm, rest, compliance + soft, start, self.flow)
                if self.tight_s < end:
                    gas = np.interp(np.minimum(t, self.tight_s), t, gas)
            p = _pressure(start * gas * warm, rest, compliance + soft) - ATMOSPHERE_kPa
            change = float(np.abs(p - before).max())
            if not self.creep_per_kPa or change < 1e-8 * start:
                break
        found, after = np.full(len(time_s), p[0]), time_s > 0
        # What has a formula is taken at the times themselves: no cubic follows a fast beginning.
        own = time_s[after]
        amount = start * _between(gas, own / end) * self._warm(own)
        soft = self._soft(own)
        rest = 1 + _between(grown, own / end) - compliance * start - soft * ATMOSPHERE_kPa
        found[after] = _pressure(amount, rest, compliance + soft) - ATMOSPHERE_kPa
        return found


def beginning_kPa(experiment: Experiment) -> float:
    """Mean gauge pressure in kPa over the first `BEGINNING_s` seconds of an experiment."""
    time = experiment["time_s"]
    return float(np.nanmean(experiment["pressure_kPa"][time <= time[0] + BEGINNING_s]))


def warmed(p: Array, warm_K: Any) -> Array:
    """Gauge pressure (n,) in kPa of gas that is warmer by so many K (n,) than at room temperature.

    The gas that leaks meanwhile is at room temperature.
    """
    return np.asarray((p + ATMOSPHERE_kPa) * (1.0 + warm_K / ROOM_K) - ATMOSPHERE_kPa)


def _creeping(t: Array, onset_s: float) -> Callable[[Array], Array]:
    """Sum over decades of `first_order_lag` of pressures (n,) at even times t (n,), from none before them."""
    from scipy.signal import fftconvolve

    times = onset_s * 10.0 ** np.arange(DECADES)[:, None]
    a, before, at = lag_weights(float(t[1] - t[0]), times)
    fading = a ** np.arange(len(t))
    ats, befores = (at * fading).sum(axis=0), (before * fading).sum(axis=0)
    answer = ats + np.concatenate([[0.0], befores[:-1]])
    return lambda p: np.asarray(fftconvolve(answer, p)[: len(t)] - ats * p[0])


def _between(values: Array, shares: Array) -> Array:
    """Values (n,) at even places, at shares (m,) of the way along them, by cubics through four neighbours.

    As accurate as a spline, without its equations.
    """
    at = shares * (len(values) - 1)
    first = np.clip(at.astype(np.int64) - 1, 0, len(values) - 4)
    u = at - first
    v, w, x = u - 1.0, u - 2.0, u - 3.0
    a, b, c, d = (values[first + k] for k in range(4))
    return np.asarray(v * w * (d * u - a * x) / 6.0 + u * x * (b * w - c * v) / 2.0)


def _pressure(amount: Array, rest: Array, soft: Array) -> Array:
    """Absolute pressures P in kPa with P (rest + soft P) = amount."""
    return np.asarray(2.0 * amount / (rest + np.sqrt(rest * rest + 4.0 * soft * amount)))


def _lost(
    t: Array, per_gas: Array, rest: Array, soft: Array, start: float, flow: Callable[[float], float]
) -> Array:
    """Share of the gas (2 n + 1,) left at the steps and midway between them.

    per_gas, rest, soft (2 n + 1,): amounts in kPa of all gas, as in `_pressure`. flow: rate in 1/s, of the
    gas of the chamber at one atmosphere, at a pressure in atmospheres.
    """
    rate, h = ATMOSPHERE_kPa / start, float(t[2] - t[0])
    gas, found = 1.0, [1.0]
    if soft.any():
        A, R, S = (per_gas / ATMOSPHERE_kPa).tolist(), rest.tolist(), (4.0 * ATMOSPHERE_kPa * soft).tolist()

        def slope(gas: float, i: int) -> float:
            amount, r = A[i] * gas, R[i]
            return -rate * flow(2.0 * amount / (r + math.sqrt(r * r + S[i] * amount)))

    else:
        # In a rigid chamber the pressure, in atmospheres, is this times the gas.
        A = (per_gas / rest / ATMOSPHERE_kPa).tolist()

        def slope(gas: float, i: int) -> float:
            return -rate * flow(gas * A[i])

    for i in range(0, len(t) - 2, 2):
        k1 = slope(gas, i)
        k2 = slope(gas + h / 2 * k1, i + 1)
        k3 = slope(gas + h / 2 * k2, i + 1)
        k4 = slope(gas + h * k3, i + 2)
        middle = gas + h / 24 * (5 * k1 + 4 * k2 + 4 * k3 - k4)
        gas += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        found += [middle, gas]
    return np.array(found)
