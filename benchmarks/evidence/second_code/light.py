"""Waveguides bent to and fro: loss after loss along the bend, and what lamp and photodiode do."""

from __future__ import annotations

import math

import numpy as np

from .recording import Trial, clock

Array = np.ndarray[..., np.dtype[np.float64]]
Rng = np.random.Generator


def waveguides(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """A slow, a fast and a small motion, each from rest to rest."""
    straight, loss = float(rng.uniform(0.8, 3.0)), float(rng.uniform(0.004, 0.014))
    found = []
    for name, period, middle, reach in (("slow", 71.0, 40.0, 45.0), ("fast", 17.0, 35.0, 40.0),
                                        ("small", 29.0, 12.0, 25.0)):  # fmt: skip
        t = clock(rng, 240.0, 300, noise)

        def angle(at: Array, period: float = period, middle: float = middle, reach: float = reach) -> Array:
            # Cosines from rest, so that the motion begins and ends without a jump.
            ease = np.clip(at / 8.0, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(at / 8.0, 0.0, 1.0))
            return np.asarray(ease * (middle + reach * np.sin(2.0 * math.pi * at / period)))

        columns = {"time_s": t, "angle_deg": angle(t)}
        columns["voltage_V"] = _voltage(t, angle, straight, loss, faults)
        found.append(Trial("waveguide_bending", name, columns, "voltage_V", 0.6 * straight))
    return found


def _voltage(t: Array, angle, straight: float, loss: float, faults: dict[str, dict[str, float]]) -> Array:  # type: ignore[no-untyped-def]
    get = faults.get
    bent = angle(t - get("clock_offset", {}).get("seconds", 0.0))
    if f := get("outside_play"):
        # The guide lies in its channel with play.
        at, held = float(bent[0]), []
        for a in bent.tolist():
            at = min(max(at, a - f["deg"]), a + f["deg"])
            held.append(at)
        bent = np.array(held)
    exponent = loss * bent
    if f := get("optical_nonlinearity"):
        beyond = np.abs(bent) / 90.0
        curve = beyond**1.6 if f["power"] < 2.0 else beyond**2 / (1.0 + 0.5 * beyond)
        exponent = exponent + np.sign(bent) * loss * 90.0 * f["excess"] * curve
    light = straight * np.exp(-exponent)
    if (f := get("led_drift")) and "per_hour" in f:
        light = light * np.exp(f["per_hour"] * t / 3600.0)
    elif f:
        # A lamp that warms up: most of its loss comes early, some goes on.
        light = light * (1.0 - f["share"] * (1.0 - np.exp(-t / f["time_s"])) - 0.3 * f["share"] * t / t[-1])
    if f := get("ambient_light"):
        # A room whose light grows by a tenth while one records.
        light = light + f["share"] * straight * (1.0 + f.get("grows", 0.1) * t / t[-1])
    if f := get("outside_modes"):
        # The lamp hops between two states at random moments.
        rng = np.random.default_rng(int(1e6 * f["share"]))
        flips = np.sort(rng.uniform(t[0], t[-1], 7))
        light = light * (1.0 + f["share"] * (np.searchsorted(flips, t) % 2))
    if f := get("outside_room"):
        light = light * (1.0 + f["share"] * np.sin(2.0 * math.pi * t / f["period_s"]))
    if f := get("outside_jump"):
        light = light * (1.0 - f["share"] * (t > f["at"] * t[-1]))
    if f := get("outside_compressed"):
        # A photodiode's amplifier that gives way near its end.
        light = light / (1.0 + (light / (f["end"] * straight)) ** 6) ** (1.0 / 6.0)
    return np.asarray(light)
