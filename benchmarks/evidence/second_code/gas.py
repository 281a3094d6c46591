"""Closed chambers: gas that flows, warms and pushes its wall out, stepped by Heun's rule."""

from __future__ import annotations

import math

import numpy as np

from .recording import Trial, clock

Array = np.ndarray[..., np.dtype[np.float64]]
Rng = np.random.Generator

AIR_kPa = 101.325
GAMMA = 1.4
FINER = 4


def holds(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """Chambers shut at three pressures for some minutes; a record begins at the valve or a little before."""
    lasts = float(rng.uniform(240.0, 600.0))
    levels = rng.permutation([60.0, 150.0, 280.0]) * rng.uniform(0.8, 1.2)
    before = float(rng.uniform(0.0, 4.0)) if rng.uniform() < 0.5 else 0.0
    found = []
    for number, level in enumerate(levels.tolist()):
        t = clock(rng, lasts, 300, noise)
        fine = np.linspace(0.0, lasts, FINER * 300)
        p = np.interp(t, fine, _chamber(fine - before, level, faults, number))
        columns = {"time_s": t, "pressure_kPa": p}
        fields = {"specimen": "AAB"[number]}
        found.append(Trial("pressure_hold", f"hold {number + 1}", columns, "pressure_kPa", 150.0, fields))
    return found


def _chamber(t: Array, level: float, faults: dict[str, dict[str, float]], number: int) -> Array:
    """Gauge readings (n,) in kPa at times (n,) since the valve was shut."""
    get = faults.get
    cool, creep = get("temperature_drift"), get("viscoelasticity")

    def outside_warmth(s: float) -> float:
        f = get("outside_room")
        return f["kelvin"] * math.sin(2.0 * math.pi * s / f["period_s"]) if f else 0.0

    def gas_and_wall(s: float) -> tuple[float, float]:
        kelvin = 296.0 + outside_warmth(s)
        if cool:
            fast, slow = math.exp(-s / cool["time_s"]), math.exp(-s / (6.0 * cool["time_s"]))
            kelvin += cool["kelvin"] * (level / 150.0) * (0.7 * fast + 0.3 * slow)
        grown = creep["share"] * (level / 150.0) * (s / 100.0) ** creep["power"] if creep else 0.0
        return kelvin, 1.0 + grown

    first, start = gas_and_wall(0.0)[0], level + AIR_kPa

    def pressure(mass: float, s: float) -> float:
        kelvin, volume = gas_and_wall(s)
        return start * mass * kelvin / first / volume

    mass, found, before = 1.0, [], 0.0
    for s in np.maximum(t, 0.0).tolist():
        h = s - before
        if h > 0.0:
            # Of more gas at first the same flow is a smaller share.
            share = AIR_kPa / start
            k1 = share * _flow(pressure(mass, before), faults, before)
            k2 = share * _flow(pressure(mass + h * k1, s), faults, s)
            mass += 0.5 * h * (k1 + k2)
            before = s
        found.append(pressure(mass, s) - AIR_kPa)
    read = np.array(found)
    if f := get("pressure_drift"):
        read = read + f["kPa"] * np.sqrt(np.maximum(t - t[0], 0.0) / (t[-1] - t[0]))
    if f := get("outside_bumped"):
        read = read + f["kPa"] * (t > f["at"] * t[-1])
    if f := get("outside_tilt"):
        read = read + f["kPa"] * np.clip((t / t[-1] - f["at"]) / 0.06, 0.0, 1.0) * (number == 1)
    if f := get("outside_pulses"):
        read = read + f["kPa"] * np.maximum(np.sin(2.0 * math.pi * t / f["period_s"]), 0.6)
    return np.asarray(read)


def _flow(p: float, faults: dict[str, dict[str, float]], s: float) -> float:
    """Rate (1/s) at which gas is gained, over that of the chamber at one atmosphere, of p in kPa absolute."""
    lost = 0.0
    if f := faults.get("leak"):
        if "orifice" in f:
            # Isentropic flow through a hole, choked above some 192 kPa absolute.
            ratio = min(max(AIR_kPa / p, (2.0 / (GAMMA + 1.0)) ** (GAMMA / (GAMMA - 1.0))), 1.0)
            inner = 2.0 / (GAMMA - 1.0) * (ratio ** (2.0 / GAMMA) - ratio ** ((GAMMA + 1.0) / GAMMA))
            lost += f["orifice"] * p / AIR_kPa * math.sqrt(max(inner, 0.0))
        elif "seal" in f:
            # Through a film that swells, by the difference of the pressures.
            lost += f["seal"] * (p - AIR_kPa) / AIR_kPa
        elif "laminar" in f:
            lost += f["laminar"] * ((p / AIR_kPa) ** 2 - 1.0) / 2.0
        else:
            # A narrow channel: laminar with losses at its ends, by the middle density.
            lost += (
                f["channel"] * ((p / AIR_kPa) ** 2 - 1.0) / 2.0 / math.sqrt(1.0 + 0.4 * (p / AIR_kPa - 1.0))
            )
    if f := faults.get("outside_valve"):
        # A relief valve that opens above its own pressure.
        lost += f["rate"] * max(p - AIR_kPa - f["opens_kPa"], 0.0) / AIR_kPa
    if (f := faults.get("outside_shut_later")) and s < f["until_s"]:
        # The valve drips until its seat has settled, then holds: an end that no leak has.
        lost += f["rate"] * (p - AIR_kPa) / AIR_kPa
    return -lost
