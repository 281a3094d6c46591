"""pressure_hold: the gas balance of a chamber whose valve was shut."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import attrs
import numpy as np

from ...measured import Experiment
from ...measured.folder import ATMOSPHERE_kPa
from ..effect import Effect, Parameter, laws
from .drift import drift, drifts, largest_reading, zeroed
from .effective_pressure import lag_weights
from .instruments import CURVE, as_read, gauge
from .unit_pressure import GAUGE_SHARE

Array = np.ndarray[Any, Any]

KIND = "pressure_hold"
# The column of a room's temperature, where it was logged.
ROOM = "room_C"
ROOM_K = 296.0
AIR_GAMMA = 1.4
SUPPLY_K = 5.0
# Pressure outside over that inside below which flow through a hole grows no more.
CHOKED = (2 / (AIR_GAMMA + 1)) ** (AIR_GAMMA / (AIR_GAMMA - 1))
# Steps of a hold, at least; where more are wanted; in the onset of creep; in the time constant of a leak.
FEW_STEPS, MANY_STEPS, MANY, STEPS = 50, 200, 12, 4
# Creep is spread over these decades after its onset.
DECADES = 6
# Parameters of cooling at two rates beside its size, and their values where none are given.
_TWO_RATES = {"first_s": 10.0, "later_share": 0.0, "later_times": 6.0}
# Length of the readings that determine a hold's start, to within this share of the absolute pressure.
BEGINNING_s, NEAR = 1.0, 0.01

EFFECTS = (
    Effect(
        "leak",
        (
            Parameter("loss_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.03), "share of a small overpressure lost"),
            Parameter(
                "inertia",
                "",
                0.0,
                3000.0,
                0.0,
                (0.0, 1.0, 100.0),
                "of the flow, after Forchheimer; 0 is laminar, a hole has hundreds",
            ),
        ),
        (KIND,),
        "gas flows through pores or cracks, out or in, by the difference of the squared absolute pressures",
    ),
    Effect(
        "leak",
        (Parameter("hole_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.01), "flow through a hole, as below"),),
        (KIND,),
        "gas flows through a hole, out or in, choked where one pressure is 1.9 times the other",
    ),
    Effect(
        "leak",
        (
            Parameter("loss_until_tight_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.01), "as long as it lasts"),
            Parameter("tight_s", "s", 0.5, 3600.0, 60.0, (30.0, 100.0), "when a seal or a valve has closed"),
        ),
        (KIND,),
        "gas flows out until a seal or a valve has closed",
        refines=True,
    ),
    Effect(
        "leak",
        (
            Parameter("loss_above_per_s", "1/s", 0.0, 0.5, 0.0, (1e-3, 0.01), "of the excess over it"),
            Parameter("opens_kPa", "kPa", 0.0, 1000.0, 0.0, (30.0, 100.0), "relief valves, seams that part"),
        ),
        (KIND,),
        "gas flows out above a pressure at which a valve or a seam opens",
        refines=True,
    ),
    Effect(
        "viscoelasticity",
        (
            Parameter(
                "creep_per_MPa", "1/MPa", 0.0, 0.5, 0.0, (3e-3,), "the volume's growth a decade of time"
            ),
            Parameter("onset_s", "s", 0.1, 100.0, 1.0, (1.0, 10.0), "when that growth begins"),
        ),
        (KIND,),
        "the wall creeps under pressure, so the chamber grows by as much in each decade of time",
    ),
    Effect(
        "viscoelasticity",
        (
            Parameter(
                "growth_per_MPa", "1/MPa", 0.0, 0.5, 0.0, (3e-3,), "the volume's, as the logarithm of time"
            ),
            Parameter("begins_s", "s", 0.5, 1e4, 30.0, (5.0, 50.0), "began before the valve was shut"),
        ),
        (KIND,),
        "the wall creeps under pressure, so the chamber grows by as much in each decade of time",
    ),
    Effect(
        "viscoelasticity",
        (
            # From a small size alone fits of a large one end in another minimum, as bad as a wrong law.
            Parameter("findley_per_MPa", "1/MPa", 0.0, 0.5, 0.0, (3e-3, 0.1), "the volume's growth in 100 s"),
            Parameter("findley_power", "", 0.05, 0.8, 0.3, (0.3,), "plastics 0.1 to 0.5 (Findley 1944)"),
        ),
        (KIND,),
        "the wall creeps under pressure, so the chamber grows as a power of time",
        refines=True,
    ),
    Effect(
        "temperature_drift",
        (
            Parameter("cooling_K", "K", -40.0, 120.0, 0.0, (-3.0, 3.0), "compressed gas is warm"),
            Parameter("cooling_s", "s", 0.5, 3600.0, 30.0, (10.0, 60.0), "to the temperature of the wall"),
        ),
        (KIND,),
        "the gas cools to the temperature of the wall, and its pressure with it",
    ),
    Effect(
        "temperature_drift",
        (Parameter("room_K_per_hour", "K/h", -12.0, 12.0, 0.0, (2.0,), "rooms over a morning; logs tell"),),
        (KIND,),
        "the room warms or cools steadily, and the gas in the chamber with it",
    ),
    Effect(
        "temperature_drift",
        (
            Parameter("warmth", "", 0.0, 1.0, 0.0, (0.05,), "share of the warming by adiabatic compression"),
            Parameter("cools_s", "s", 0.5, 3600.0, 30.0, (10.0, 60.0), "to the temperature of the wall"),
        ),
        (KIND,),
        "gas cools that was compressed faster than it gives off its heat, the more the higher its pressure",
    ),
    Effect(
        "temperature_drift",
        (
            Parameter("cooling_K_per_100_kPa", "K", 0.0, 60.0, 0.0, (3.0,), "without any loss of heat 64 K"),
            Parameter("first_s", "s", 0.5, 600.0, 10.0, (5.0, 20.0), "to the temperature of the wall"),
            Parameter("later_share", "", 0.0, 0.9, 0.0, (0.3,), "of the cooling that waits for the wall"),
            Parameter("later_times", "", 1.5, 60.0, 6.0, (6.0,), "as long takes the wall to the room's"),
        ),
        (KIND,),
        "the gas cools to the temperature of the wall, and more slowly with the wall to that of the room",
        refines=True,
    ),
    # A hold's own first pressure absorbs a curve.
    *(e for e in gauge(KIND) if e.name != CURVE),
)


class ChamberPressure:
    """Predicts pressure holds: p V = m R T in a chamber that, without effects, keeps V, m and T.

    experiments: those of kind pressure_hold each add two nuisances, the initial pressure in kPa and the time
    in s at which the valve was shut, until when the supply keeps the pressure. compliance_per_kPa: relative
    growth of the volume a kPa; it acts only while the pressure changes, so a hold does not show it.
    """

    def __init__(self, experiments: Sequence[Experiment], compliance_per_kPa: float = 0.0) -> None:
        self._compliance = compliance_per_kPa
        self._largest_kPa = largest_reading("pressure_kPa", KIND, experiments)
        self.effects = (
            *zeroed(map(partial(_warmed, experiments), EFFECTS), KIND, experiments),
            *drifts("pressure_drift", "kPa", GAUGE_SHARE * self._largest_kPa, KIND, experiments),
            *laws(KIND, experiments),
        )
        nuisances = []
        for e in experiments:
            if e.kind != KIND:
                continue
            first = beginning_kPa(e)
            near = NEAR * (first + ATMOSPHERE_kPa)
            lasts = float(e["time_s"][-1] - e["time_s"][0])
            nuisances.append(
                Parameter(_initial(e), "kPa", first - near, first + near, first, (), "its first readings")
            )
            nuisances.append(
                Parameter(_shut(e), "s", 0.0, 0.5 * lasts, 0.0, (), "records begin by hand", spread=5.0)
            )
            nuisances[-2:] = [attrs.evolve(p, experiment=e.name) for p in nuisances[-2:]]
        self.nuisances = tuple(nuisances)

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """The predicted column: gauge pressure in kPa."""
        return ("pressure_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Gauge pressure (1, n) in kPa at the experiment's times; values as in `Simulator`."""
        get = values.get
        initial = get(_initial(experiment), None)
        initial = beginning_kPa(experiment) if initial is None else initial
        time = experiment["time_s"] - experiment["time_s"][0] - get(_shut(experiment), 0.0)
        p = _in_the_chamber(
            time.tobytes(),
            initial,
            loss_per_s=get("leak.loss_per_s", 0.0),
            inertia=get("leak.inertia", 0.0),
            hole_per_s=get("leak.hole_per_s", 0.0),
            loss_until_tight_per_s=get("leak.loss_until_tight_per_s", 0.0),
            tight_s=get("leak.tight_s", 60.0),
            loss_above_per_s=get("leak.loss_above_per_s", 0.0),
            opens_kPa=get("leak.opens_kPa", 0.0),
            creep_per_kPa=1e-3 * get("viscoelasticity.creep_per_MPa", 0.0),
            onset_s=get("viscoelasticity.onset_s", 1.0),
            growth_per_kPa=1e-3 * get("viscoelasticity.growth_per_MPa", 0.0),
            begins_s=get("viscoelasticity.begins_s", 30.0),
            findley_per_kPa=1e-3 * get("viscoelasticity.findley_per_MPa", 0.0),
            findley_power=get("viscoelasticity.findley_power", 0.3),
            cooling_K=get("temperature_drift.cooling_K", 0.0),
            cooling_s=get("temperature_drift.cooling_s", 30.0),
            warmth=get("temperature_drift.warmth", 0.0),
            cools_s=get("temperature_drift.cools_s", 30.0),
            compliance_per_kPa=self._compliance,
            cooling_per_kPa=0.01 * get("temperature_drift.cooling_K_per_100_kPa", 0.0),
            rates=tuple(get(f"temperature_drift.{k}", v) for k, v in _TWO_RATES.items()),
        )
        per_hour = get("temperature_drift.room_K_per_hour", 0.0)
        warm = per_hour * (experiment["time_s"] - experiment["time_s"][0]) / 3600.0
        if (room := experiment.columns.get(ROOM)) is not None:
            warm = room - room[0]
        if warm.any():
            # The gas that leaks meanwhile is at room temperature.
            p = (p + ATMOSPHERE_kPa) * (1.0 + warm / ROOM_K) - ATMOSPHERE_kPa
        p = as_read(p, values, self._largest_kPa)
        p = p + drift("pressure_drift", experiment["time_s"], values)
        return p[None]


def _warmed(experiments: Sequence[Experiment], effect: Effect) -> Effect:
    """Effect of a temperature drift no larger than that of gas compressed or expanded adiabatically.

    T / T0 = (P / P0)^((gamma - 1) / gamma), gamma of air.
    """
    if effect.parameters[0].name != "cooling_K":
        return effect
    begun = [0.0, *(beginning_kPa(e) for e in experiments if e.kind == KIND)]
    ratio = np.array([max(1.0 + p / ATMOSPHERE_kPa, 0.05) for p in (min(begun), max(begun))])
    # A few kelvin more: supplies and rooms differ.
    low, high = _adiabatic_K(ratio) + np.array([-SUPPLY_K, SUPPLY_K])
    cooling, lasts = effect.parameters
    return attrs.evolve(effect, parameters=(cooling.narrowed(float(low), float(high)), lasts))


def _adiabatic_K(ratio: Any) -> Any:
    """Warming in K of the room's air by compression to `ratio` times its pressure, without loss of heat."""
    return ROOM_K * (ratio ** (1.0 - 1.0 / AIR_GAMMA) - 1.0)


def beginning_kPa(experiment: Experiment) -> float:
    """Mean gauge pressure in kPa over the first `BEGINNING_s` seconds of an experiment."""
    time = experiment["time_s"]
    return float(np.nanmean(experiment["pressure_kPa"][time <= time[0] + BEGINNING_s]))


def _initial(experiment: Experiment) -> str:
    return f"initial_kPa of {experiment.name}"


def _shut(experiment: Experiment) -> str:
    return f"shut_s of {experiment.name}"


def chamber_pressure(
    time_s: Array,
    initial_kPa: float,
    *,
    loss_per_s: float = 0.0,
    inertia: float = 0.0,
    hole_per_s: float = 0.0,
    loss_until_tight_per_s: float = 0.0,
    tight_s: float = math.inf,
    loss_above_per_s: float = 0.0,
    opens_kPa: float = 0.0,
    creep_per_kPa: float = 0.0,
    onset_s: float = 1.0,
    growth_per_kPa: float = 0.0,
    begins_s: float = 30.0,
    findley_per_kPa: float = 0.0,
    findley_power: float = 0.3,
    cooling_K: float = 0.0,
    cooling_s: float = 30.0,
    warmth: float = 0.0,
    cools_s: float = 30.0,
    compliance_per_kPa: float = 0.0,
    cooling_per_kPa: float = 0.0,
    rates: Sequence[float] = (10.0, 0.0, 6.0),
) -> Array:
    """Gauge pressure (n,) in kPa at times (n,) in s after the valve was shut.

    Up to then it is initial_kPa. loss_per_s: k in 1/s; inertia: b, Forchheimer's, no unit; creep_per_kPa: c
    in 1/kPa; onset_s: onset of creep; growth_per_kPa, begins_s: creep as the logarithm of time, g and its
    onset s; findley_per_kPa, findley_power: creep as a power of time, its growth f in 100 s in 1/kPa and its
    exponent n; cooling_K, cooling_s: excess temperature of the gas at the start and its time constant;
    warmth, cools_s: that excess as a share of what compression to this pressure without loss of heat makes,
    and its time constant; cooling_per_kPa: excess temperature in K of each kPa, and by `rates` its first time
    constant in s, the share that cools later, and its time constant over the first; compliance_per_kPa: C in
    1/kPa. With P absolute, P0 the atmosphere, V and T
    relative to the start: P V = P_i m T. Gas is lost by P_i dm/dt = -k P0 x, where
    x + b x^2 = (P^2 - P0^2)/(2 P0^2), so that a small overpressure falls by exp(-k t), and a large b makes it
    nearly the flow of an orifice. hole_per_s: h in 1/s of such a flow itself, P_i dm/dt = -h P0 f(P/P0)
    (`_through_a_hole`). loss_until_tight_per_s: k of a laminar flow that ends at tight_s, in s;
    loss_above_per_s: k of a flow in proportion to what the gauge pressure is above opens_kPa. The volume is
    V = 1 + C (p - p_i) + sum over decades d of c x_d, where x_d follows p with the time onset 10^d,
    + g p log10(1 + t/s) + f p (t/100 s)^n.
    """
    end = float(time_s[-1])
    leaks = loss_per_s or hole_per_s or loss_until_tight_per_s or loss_above_per_s
    creeps = creep_per_kPa or growth_per_kPa or findley_per_kPa
    compliance = compliance_per_kPa

    def softness(t: Array) -> Array:
        """Growth of the volume, in 1/kPa, by creep in proportion to the pressure at that time."""
        found = growth_per_kPa * np.log10(1.0 + t / begins_s) if growth_per_kPa else np.zeros_like(t)
        return found + findley_per_kPa * (t / 100.0) ** findley_power if findley_per_kPa else found

    def warmed(t: Array) -> Array:
        """Temperature of the gas over that at the start."""
        warm = np.ones_like(t)
        if cooling_K:
            warm += cooling_K * np.expm1(-t / cooling_s) / (ROOM_K + cooling_K)
        if warmth:
            excess_K = warmth * _adiabatic_K(start / ATMOSPHERE_kPa)
            warm += excess_K * np.expm1(-t / cools_s) / (ROOM_K + excess_K)
        if cooling_per_kPa:
            first_s, later, times = rates
            excess_K = cooling_per_kPa * initial_kPa
            cooled = (1.0 - later) * np.expm1(-t / first_s) + later * np.expm1(-t / (times * first_s))
            warm += excess_K * cooled / (ROOM_K + excess_K)
        return warm

    if not (leaks or creeps or cooling_K or warmth or cooling_per_kPa) or end <= 0:
        return np.full(len(time_s), float(initial_kPa))
    start = initial_kPa + ATMOSPHERE_kPa
    # Runge and Kutta's method is stable below 2.8 steps a time constant, and four are accurate. What begins
    # or ends at a moment needs more of them.
    abrupt = loss_until_tight_per_s or loss_above_per_s or hole_per_s * end > 1.0
    fast_s = 0.0 if abrupt else onset_s if creep_per_kPa else end
    lost = end * leaks * start / ATMOSPHERE_kPa
    wanted = max(FEW_STEPS, MANY * end / max(fast_s, 1e-9), 8 * STEPS * lost)
    steps = int(np.clip(max(min(wanted, MANY_STEPS), STEPS * lost), 1, 20000))
    t = np.linspace(0.0, end, 2 * steps + 1)
    warm = warmed(t)
    flow = _seeping(loss_per_s or loss_until_tight_per_s, inertia)
    if hole_per_s:
        flow = _through_a_hole(hole_per_s)
    elif loss_above_per_s:
        flow = _above(loss_above_per_s, 1.0 + opens_kPa / ATMOSPHERE_kPa)
    soft = softness(t)
    creeping = _creeping(t, onset_s) if creep_per_kPa else np.zeros_like
    p, grown, gas, change = np.full_like(t, initial_kPa), np.zeros_like(t), np.ones_like(t), start
    for turn in range(50):
        before = p
        if creep_per_kPa:
            grown = creep_per_kPa * creeping(p)
        rest = 1 + grown - compliance * start - soft * ATMOSPHERE_kPa
        # The gas that is lost hardly depends on what is left to find of the pressure.
        if leaks and (turn < 4 or change > 1e-5 * start):
            gas = _lost(t, start * warm, rest, compliance + soft, start, flow)
            if loss_until_tight_per_s and tight_s < end:
                gas = np.interp(np.minimum(t, tight_s), t, gas)
        p = _pressure(start * gas * warm, rest, compliance + soft) - ATMOSPHERE_kPa
        change = float(np.abs(p - before).max())
        if not creep_per_kPa or change < 1e-8 * start:
            break
    found, after = np.full(len(time_s), p[0]), time_s > 0
    # What has a formula is taken at the times themselves: no cubic follows a fast beginning.
    own = time_s[after]
    amount = start * _between(gas, own / end) * warmed(own)
    rest = 1 + _between(grown, own / end) - compliance * start - softness(own) * ATMOSPHERE_kPa
    found[after] = _pressure(amount, rest, compliance + softness(own)) - ATMOSPHERE_kPa
    return found


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


# Derivatives by what the gauge adds need the same chamber again.
@lru_cache(maxsize=256)
def _in_the_chamber(time_s: bytes, initial_kPa: float, **values: Any) -> Array:
    """`chamber_pressure` (n,), read-only, at times (n,) in bytes."""
    found = chamber_pressure(np.frombuffer(time_s), initial_kPa, **values)
    found.flags.writeable = False
    return found


def _seeping(loss: float, inertia: float) -> Callable[[float], float]:
    """Laminar flow in 1/s of a pressure in atmospheres, with inertia after Forchheimer."""
    if not inertia:
        return lambda P: 0.5 * loss * (P * P - 1)

    def flow(P: float) -> float:
        drive = P * P - 1
        return loss * drive / (1 + math.sqrt(1 + 2 * inertia * abs(drive)))

    return flow


def _above(loss: float, opens: float) -> Callable[[float], float]:
    """Flow in 1/s in proportion to the excess of a pressure over another, both in atmospheres."""
    return lambda P: loss * max(P - opens, 0.0)


def _through_a_hole(hole: float) -> Callable[[float], float]:
    """Isentropic flow in 1/s through a hole, of a pressure in atmospheres (Saint-Venant and Wantzel)."""
    one, other, scale = 2 / AIR_GAMMA, (AIR_GAMMA + 1) / AIR_GAMMA, hole * math.sqrt(2 / (AIR_GAMMA - 1))
    choked = scale * math.sqrt(CHOKED**one - CHOKED**other)

    def flow(P: float) -> float:
        high, low = (P, 1.0) if P > 1.0 else (1.0, P)
        if low < CHOKED * high:
            most = choked * high
        else:
            ratio = low / high
            most = scale * high * math.sqrt(max(ratio**one - ratio**other, 0.0))
        return most if P > 1.0 else -most

    return flow


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
