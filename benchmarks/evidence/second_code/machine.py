"""Coupons and blocks of lattice in a testing machine, by laws that the engine does not have."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .recording import Trial, clock

Array = np.ndarray[Any, Any]
Rng = np.random.Generator

# Steps in s by which histories are integrated: corners of all protocols lie on them.
STEP_s = 0.125
# Gauss points of the mean of a kernel over a step.
_X, _W = np.polynomial.legendre.leggauss(12)
_X, _W = 0.5 * (_X + 1.0), 0.5 * _W


def coupons(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """Strips of resin: loops at two rates, cycles, a hold, a warm one, one across the layers, one pressed."""
    modulus = float(np.exp(rng.uniform(math.log(200.0), math.log(3000.0))))
    top = float(rng.uniform(0.3, 0.55))
    section, length = (float(rng.uniform(4, 12)), float(rng.uniform(2, 4))), float(rng.uniform(25, 40))
    bulk = float(np.exp(rng.uniform(math.log(200.0), math.log(2000.0))))
    plan = [*_plan(top), ("pressed", "F", [(-0.2, 30), (0, 30)], 23.0, "z")]
    law = _hyperelastic(modulus, bulk, faults)
    scale = float(np.abs(law(np.array([top])))[0])
    return _tests(rng, "coupon", plan, law, scale, section, length, faults, noise)


def blocks(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """Blocks of lattice between plates: loops at two rates, cycles, a hold, a warm one, one across."""
    modulus = float(np.exp(rng.uniform(math.log(8.0), math.log(60.0))))
    top = float(rng.uniform(0.12, 0.2))
    side = float(rng.uniform(25, 45))
    plan = [*_plan(top), ("1.3 times as tall", "F", [(top, 50), (0, 50)], 23.0, "z")]
    law = _cellular(modulus, faults)
    scale = float(law(np.array([top]))[0])
    return _tests(rng, "lattice_compression", plan, law, scale, (side, side), side, faults, noise)


def _plan(top: float) -> list[Any]:
    """What both are put through: name, specimen, strains and seconds, temperature in C, direction."""
    return [
        ("first loops", "A", [(0.6 * top, 20), (0, 20), (top, 35), (0, 35)], 23.0, "z"),
        ("slow", "B", [(top, 300), (0, 300)], 23.0, "z"),
        ("held", "C", [(0.7 * top, 3), (0.7 * top, 120), (0.2 * top, 3), (0.2 * top, 60)], 23.0, "z"),
        ("first loops again", "A", [(0.6 * top, 20), (0, 20), (top, 35), (0, 35)], 23.0, "z"),
        ("warm", "D", [(top, 35), (0, 35)], 37.0, "z"),
        ("across", "E", [(top, 35), (0, 35)], 23.0, "x"),
    ]


def _hyperelastic(
    modulus: float, bulk: float, faults: dict[str, dict[str, float]]
) -> Callable[[Array], Array]:
    """Nominal stress (n,) in kPa of strain: a compressible solid whose sides are free, found by Newton.

    W = G/2 (I1 - 3 - 2 ln J) + K/2 (J - 1)^2, K/G = bulk; stiffened by Gent's limit of I1 or Ogden's power.
    """
    g = modulus / 3.0
    stiff = faults.get("strain_stiffening", {})

    def factor(first: Array) -> Array:
        limit = stiff.get("gent", 0.0)
        return 1.0 / (1.0 - np.minimum((first - 3.0) / limit, 0.95)) if limit else np.ones_like(first)

    def law(strain: Array) -> Array:
        stretch = 1.0 + strain
        side = stretch**-0.5
        for _ in range(25):
            j, first = stretch * side**2, stretch**2 + 2.0 * side**2
            f = factor(first)
            # Stress across: zero.
            off = f * side**2 - 1.0 + bulk * j * (j - 1.0)
            slope = 2.0 * f * side + bulk * (2.0 * j - 1.0) * 2.0 * stretch * side
            side = side - off / slope
        j, first = stretch * side**2, stretch**2 + 2.0 * side**2
        found = g * (factor(first) * stretch**2 - 1.0 + bulk * j * (j - 1.0)) / stretch
        if power := stiff.get("ogden", 0.0):
            extra = stretch ** (power - 1.0) - stretch ** (-0.5 * power - 1.0)
            found = found + stiff["share"] * g * 2.0 / power * extra
        if excess := faults.get("tension_compression_asymmetry", {}).get("excess", 0.0):
            found = found * (1.0 + 0.5 * excess * (1.0 - np.tanh(strain / 0.015)))
        return np.asarray(found)

    return law


def _cellular(modulus: float, faults: dict[str, dict[str, float]]) -> Callable[[Array], Array]:
    """Stress (n,) in kPa of compression: linear, or a plateau where struts buckle, or cells that close."""
    stiff = faults.get("strain_stiffening", {})

    def law(strain: Array) -> Array:
        if plateau := stiff.get("plateau", 0.0):
            return np.asarray(modulus * plateau * np.tanh(strain / plateau))
        found = modulus * strain
        if power := stiff.get("closing", 0.0):
            found = found * (1.0 + power * np.abs(strain) ** 1.6)
        return np.asarray(found)

    return law


def _tests(
    rng: Rng,
    kind: str,
    plan: list[Any],
    law: Callable[[Array], Array],
    scale: float,
    section: tuple[float, float],
    length: float,
    faults: dict[str, dict[str, float]],
    noise: str,
) -> list[Trial]:
    done: dict[str, int] = {}
    most: dict[str, float] = {}
    found = []
    for name, specimen, way, warm, axis in plan:
        ends = np.cumsum([0.0, *(s for _, s in way)])
        to = np.array([0.0, *(e for e, _ in way)])
        rows = int(np.clip(ends[-1] / 0.6, 120, 240))
        t = clock(rng, float(ends[-1]), rows, noise)
        tall = length * (1.3 if "tall" in name else 1.0)
        strain = np.interp(t, ends, to)
        fine = np.arange(0.0, float(ends[-1]) + 0.5 * STEP_s, STEP_s)
        body = np.interp(fine, ends, to)
        stress = _measured(
            fine, body, law, faults, scale, section, tall, warm - 23.0, axis, done.get(specimen, 0),
            most.get(specimen, 0.0),
        )  # fmt: skip
        done[specimen] = done.get(specimen, 0) + 1
        most[specimen] = max(most.get(specimen, 0.0), float(np.abs(body).max()))
        y = np.interp(t, fine, stress)
        columns = {"time_s": t, "strain": strain, "stress_kPa": y}
        channel, full = "stress_kPa", scale
        if kind == "coupon":
            newton = section[0] * section[1] * 1e-3
            columns = {"time_s": t, "displacement_mm": strain * tall, "force_N": y * newton}
            channel, full = "force_N", scale * newton
        fields: dict[str, Any] = {
            "specimen": specimen,
            "temperature_C": warm,
            "axis": axis,
            "length_mm": round(tall, 3),
            "section_mm": tuple(round(s, 3) for s in section),
        }
        if kind == "coupon":
            fields["mode"] = "uniaxial"
        found.append(Trial(kind, name, columns, channel, full, fields))
    return found


def _measured(
    t: Array,
    strain: Array,
    law: Callable[[Array], Array],
    faults: dict[str, dict[str, float]],
    scale: float,
    section: tuple[float, float],
    length: float,
    warmer: float,
    axis: str,
    done: int,
    most: float,
) -> Array:
    """What the machine reads (n,), in kPa, on a uniform clock (n,): bench, then material, then load cell."""
    get = faults.get
    factor = 1.0
    if f := get("anisotropy"):
        factor *= 1.0 + f["excess"] * (axis == "x")
    if f := get("temperature_drift"):
        factor *= 1.0 + f["per_K"] * warmer if "per_K" in f else math.exp(-f["rate"] * warmer)
    if f := get("fatigue_drift"):
        factor *= (1.0 + done) ** -f["power"]

    def whole(e: Array) -> Array:
        return factor * law(e)

    if f := get("seating"):
        # A hyperbolic toe: faces touch point by point.
        toe = f["gap_mm"] / length
        strain = np.sign(strain) * (np.sqrt(strain**2 + toe**2) - toe)
    if f := get("frame_compliance"):
        # Steel and a contact after Hertz: what they take is found by bisection on the specimen's own strain.
        area, sign = section[0] * section[1], np.sign(strain)
        low, high = np.zeros_like(strain), np.abs(strain)
        for _ in range(50):
            mid = 0.5 * (low + high)
            newton = np.abs(whole(sign * mid)) * area * 1e-3
            ref = scale * area * 1e-3
            way = mid + (f["mm"] / length) * (0.8 * newton / ref + 0.2 * (newton / ref) ** (2.0 / 3.0))
            low, high = np.where(way < np.abs(strain), mid, low), np.where(way < np.abs(strain), high, mid)
        strain = sign * 0.5 * (low + high)
    stress = whole(strain)
    if f := get("rate_independent_hysteresis"):
        stress = (1.0 - f["share"]) * stress + f["share"] * _bouc_wen(strain, f["width"], scale, whole)
    if f := get("mullins_softening"):
        # By the largest strain so far, after Beatty and Krishnaswamy.
        peak = np.maximum(np.maximum.accumulate(np.abs(strain)), most)
        lost = 1.0 - np.exp(-f["rate"] * np.sqrt(np.maximum(peak - np.abs(strain), 0.0)))
        if f.get("tanh"):
            lost = f["rate"] * 0.3 * np.tanh((peak - np.abs(strain)) / (0.5 * np.maximum(peak, 1e-9)))
        stress = stress * (1.0 - lost)
    if f := get("viscoelasticity"):
        stress = _relaxed(t, stress, f)
    if f := get("force_lag"):
        stress = _two_poles(t, stress, f["time_s"])
    if f := get("force_drift"):
        stress = stress + f["share"] * scale * np.sqrt(t / t[-1])
    return stress + _outside(t, strain, stress, faults, scale, done)


def _bouc_wen(strain: Array, width: float, scale: float, law: Callable[[Array], Array]) -> Array:
    """Stress (n,) of a Bouc-Wen element that begins with the law's slope, and whose force ends at `width`."""
    slope = float(law(np.array([1e-4]))[0]) / 1e-4
    end = slope * width
    z, found, before = 0.0, [], 0.0
    for e in strain.tolist():
        step = e - before
        for _ in range(4):
            z += (
                slope
                * (step / 4)
                * (1.0 - (0.5 + 0.5 * math.copysign(1.0, step * z)) * (abs(z) / end) ** 1.5)
            )
        before = e
        found.append(z)
    return np.array(found)


def _relaxed(t: Array, stress: Array, f: dict[str, float]) -> Array:
    """Hereditary integral (n,) of a relaxation by a stretched exponential, a power, or one or three times."""

    def left(s: Array) -> Array:
        if "beta" in f:
            return np.asarray(1.0 - f["share"] * (1.0 - np.exp(-((s / f["time_s"]) ** f["beta"]))))
        if "power" in f:
            return np.asarray((1.0 + s / f["time_s"]) ** -f["power"])
        times = (1.0,) if "one" in f else (0.3, 2.0, 12.0)
        each = sum(np.exp(-s / (f["time_s"] * k)) for k in times) / len(times)
        return np.asarray(1.0 - f["share"] * (1.0 - each))

    steps = np.diff(stress, prepend=0.0)[1:]
    # Each step of the stress comes in evenly: the kernel's mean over it, where it begins by cubes of time.
    kernel = sum(w * left(t[:-1] + x * STEP_s) for x, w in zip(_X, _W, strict=True))
    kernel[0] = float(np.sum(_W * 3.0 * _X**2 * left(STEP_s * _X**3)))
    return np.concatenate([stress[:1], stress[0] + np.convolve(steps, kernel)[: len(steps)]])


def _two_poles(t: Array, x: Array, time_s: float) -> Array:
    """A filter (n,) of two equal poles, by the midpoint rule."""
    h = t[1] - t[0]
    a, b, found = float(x[0]), float(x[0]), []
    before = a
    for v in x.tolist():
        steps = max(1, math.ceil(4.0 * h / time_s))
        for k in range(steps):
            u = before + (v - before) * (k + 0.5) / steps
            d = h / steps / (0.5 * time_s)
            was = a
            a += d / (1.0 + 0.5 * d) * (u - a)
            b += d / (1.0 + 0.5 * d) * (0.5 * (was + a) - b)
        before = v
        found.append(b)
    return np.array(found)


def _outside(
    t: Array, strain: Array, stress: Array, faults: dict[str, dict[str, float]], scale: float, done: int
) -> Array:
    """What the engine's library lacks: added to the stress (n,) in kPa."""
    get, added = faults.get, np.zeros_like(t)
    if f := get("outside_mains"):
        added = added + f["share"] * scale * np.sin(2.0 * math.pi * t / f["period_s"])
    if f := get("outside_slip"):
        # Grips let go a little at each of several moments of loading.
        for at in (0.45, 0.6, 0.72):
            added = added - f["share"] * scale * (t > at * t[-1]) * (np.abs(stress) > 0.05 * scale)
    if f := get("outside_crack"):
        # A notch that opens once, under the largest load so far, in the second half.
        gone = (t > 0.35 * t[-1]) & (np.abs(strain) > 0)
        added = added - f["share"] * stress * gone * (done == 0)
    if f := get("outside_cell_nonlinear"):
        added = added + f["share"] * scale * ((stress / scale) ** 2 - np.abs(stress / scale))
    if f := get("outside_backlash"):
        # A screw with play: for a while after each turn nothing moves.
        turned = np.sign(np.gradient(strain))
        added = added - f["share"] * scale * (turned < 0) * (np.abs(stress) > 0.1 * scale)
    if f := get("outside_stick"):
        saw = ((t / f["period_s"]) % 1.0 - 0.5) * (np.abs(np.gradient(strain)) > 1e-9)
        added = added + f["share"] * scale * saw
    return added
