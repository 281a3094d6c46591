"""Units under pressure whose response is another code's: near the table that the judge has, and not on it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .recording import Trial, clock

Array = np.ndarray[..., np.dtype[np.float64]]
Rng = np.random.Generator

# What two codes of the same physics differ by at the largest pressure, of it.
APART = 0.03
LARGEST_kPa = 40.0


def warped(rng: Rng) -> tuple[Callable[[Array], Array], float]:
    """Pressures at which the judge's table would stand where this unit stands, and its modulus."""
    second, third, modulus = APART * rng.normal(), APART * rng.normal(), math.exp(0.1 * rng.normal())

    def warp(p: Array) -> Array:
        x = p / modulus
        u = x / LARGEST_kPa
        return np.asarray(x + LARGEST_kPa * (second * u**2 + third * u**3))

    return warp, modulus


def bent(p: Array, weight: float = 0.0, orientation_deg: float = 0.0) -> Array:
    """Angle (n,) in deg of a chain of six hinges at pressures (n,) in kPa, each heavier beyond it.

    weight: density over that of water; orientation_deg: of gravity about x, 0 hangs.
    """
    found = np.zeros(len(p))
    share = (1.15, 1.05, 1.0, 1.0, 0.95, 0.85)
    x = np.asarray(p, float) / 20.0
    for j in range(6):
        hinge = share[j] * (4.0 * x + 0.9 * x**2 - 0.25 * x**3)
        found = (
            found
            + hinge
            - 2.0 * weight * ((6 - j) / 6.0) ** 2 * np.sin(np.radians(found + hinge + orientation_deg))
        )
    return found


def strokes(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """The growth of chambers that a syringe of liquid fills and empties, in three ramps."""
    (warp, _), found = warped(rng), []
    for number, top in enumerate((20.0, 38.0, -12.0)):
        t = clock(rng, 80.0, 200, noise)
        p = top * (1.0 - np.abs(2.0 * t / t[-1] - 1.0))
        inside = p - faults.get("pressure_offset", {}).get("kPa", 0.0)
        volume = 900.0 * np.arctan(warp(inside) / 30.0) + 120.0
        columns = {"time_s": t, "pressure_kPa": p, "volume_mm3": volume}
        fields = {"specimen": "A", "session": "morning"}
        found.append(Trial("unit_pressure", f"stroke {number + 1}", columns, "volume_mm3", 800.0, fields))
    return found


def steps(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """Steps of pressure at 40 frames a second."""
    (warp, _), found = warped(rng), []
    for number, high in enumerate((15.0, 32.0, 24.0)):
        t = clock(rng, 7.0, 280, noise)
        fine = np.linspace(0.0, 7.0, 8 * 280)
        p = np.interp(fine, [0, 1, 1.05, 4, 4.05, 7], [0, 0, high, high, 2, 2])
        inside = _line(fine, p, faults)
        if f := faults.get("viscoelasticity"):
            inside = _softened(fine, inside, f)
        still = bent(warp(inside))
        if f := faults.get("inertia"):
            still = _swung(fine, still, f)
        if f := faults.get("outside_wind"):
            still = still + f["deg"] * np.sin(2.0 * math.pi * fine / f["period_s"])
        if f := faults.get("outside_stick"):
            at, held = 0.0, []
            for v in still.tolist():
                if abs(v - at) > f["deg"]:
                    at = v
                held.append(at)
            still = np.array(held)
        if f := faults.get("outside_slipped"):
            still = still + f["deg"] * (fine > 2.6)
        columns = {"time_s": t, "pressure_kPa": np.interp(t, fine, p), "angle_deg": np.interp(t, fine, still)}
        fields = {"specimen": "A"}
        found.append(Trial("pressure_step", f"step {number + 1}", columns, "angle_deg", 25.0, fields))
    return found


def _line(t: Array, p: Array, faults: dict[str, dict[str, float]]) -> Array:
    """Pressure (n,) behind a line with two volumes in it, one a fifth of the other."""
    f = faults.get("line_lag")
    if not f:
        return p
    h, a, b, found = t[1] - t[0], float(p[0]), float(p[0]), []
    for u in p.tolist():
        a += h / (0.2 * f["time_s"] + 0.5 * h) * (u - a)
        b += h / (f["time_s"] + 0.5 * h) * (a - b)
        found.append(b)
    return np.array(found)


def _softened(t: Array, p: Array, f: dict[str, float]) -> Array:
    """Pressure (n,) over a modulus that relaxes by a stretched exponential: its creep function convolved."""
    h = t[1] - t[0]
    grown = 1.0 + f["share"] / (1.0 - f["share"]) * (1.0 - np.exp(-((t / f["time_s"]) ** f["beta"])))
    kernel = grown / grown[-1] if f.get("normal") else grown * (1.0 - f["share"])
    return np.convolve(np.diff(p, prepend=0.0), np.concatenate([kernel[:1], kernel[:-1] + 0 * h]))[: len(t)]


def _swung(t: Array, still: Array, f: dict[str, float]) -> Array:
    """Two modes (n,) that share the motion, by Newmark's rule of mean acceleration."""
    h, found = t[1] - t[0], np.zeros_like(still)
    for share, faster in ((0.93, 1.0), (0.07, 5.5)):
        w = 2.0 * math.pi * faster / f["period_s"]
        c = 2.0 * f["damping"] * w
        x, v = float(still[0]), 0.0
        a, way = 0.0, []
        for u in still.tolist():
            x1, v1 = x + h * v + 0.25 * h * h * a, v + 0.5 * h * a
            new = (w * w * (u - x1) - c * v1) / (1.0 + 0.5 * h * c + 0.25 * h * h * w * w)
            x, v, a = x1 + 0.25 * h * h * new, v1 + 0.5 * h * new, new
            way.append(x)
        found += share * np.array(way)
    return found


def poses(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """Full turns at three pressures, read at rest, in a fixture that is half a degree off."""
    (warp, _), tilt, found = warped(rng), 0.5 * rng.normal(), []
    for p in (5.0, 15.0, 25.0):
        rows = np.arange(0.0, 360.0, 20.0)
        weight = faults.get("gravity", {}).get("weight", 0.0)
        inside = warp(np.array([p]))
        angle = np.array([bent(inside, weight, a + tilt)[0] for a in rows.tolist()])
        if f := faults.get("outside_cable"):
            # A hose pulls on one side of the turn only.
            angle = angle + f["deg"] * np.maximum(np.sin(np.radians(3.0 * rows)), 0.0)
        columns = {"pressure_kPa": 0.0 * rows + p, "orientation_deg": rows, "angle_deg": angle}
        fields = {"specimen": "A"}
        found.append(Trial("unit_pose", f"{p:g} kPa", columns, "angle_deg", 25.0, fields))
    return found


def force(p: Array, gap_mm: float = 0.0) -> Array:
    """Force (n,) in N of a blocked tip at pressures (n,) in kPa."""
    return np.asarray(0.9 * (p / 20.0) * (1.0 + 0.1 * p / 20.0) - gap_mm * 0.12 * (1.0 + 0.2 * p / 20.0))


def presses(rng: Rng, faults: dict[str, dict[str, float]], noise: str) -> list[Trial]:
    """The tip against a load cell, pressed by three waves of pressure."""
    (warp, modulus), found = warped(rng), []
    for name, most, period in (("slow", 30.0, 40.0), ("fast", 25.0, 8.0), ("again", 20.0, 16.0)):
        t = clock(rng, 2.0 * period, 240, noise)
        fine = np.linspace(0.0, float(t[-1]), 8 * 240)
        p = most * np.sin(np.pi * fine / period) ** 2
        # A stiffer unit that is held deforms as little: by as much less pressure, it presses by as much more.
        newton = np.maximum(modulus * force(warp(_line(fine, p, faults))), 0.0)
        if f := faults.get("outside_friction"):
            # The tip sticks to the pad and slides: the pad's friction turns with the motion.
            newton = newton + f["share"] * newton * np.tanh(40.0 * np.gradient(p) / max(np.ptp(p), 1e-9) * 50)
        columns = {"time_s": t, "pressure_kPa": np.interp(t, fine, p), "force_N": np.interp(t, fine, newton)}
        fields = {"gap_mm": 0.0}
        found.append(Trial("blocked_force", name, columns, "force_N", 1.5, fields))
    return found
