"""What is hidden in each set, by class: nothing, one effect, two, or a fault that the library lacks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from . import gas, lab, light, machine, units
from .recording import NOISES, Trial, instrument, read

Rng = np.random.Generator
Faults = dict[str, dict[str, float]]

# By kind: what makes its tests.
BENCHES: dict[str, Callable[[Rng, Faults, str], list[Trial]]] = {
    "coupon": machine.coupons,
    "lattice_compression": machine.blocks,
    "pressure_hold": gas.holds,
    "waveguide_bending": light.waveguides,
    "volume": units.strokes,
    "pressure_step": units.steps,
    "unit_pose": units.poses,
    "blocked_force": units.presses,
}
MACHINE = ("coupon", "lattice_compression")

# Names by the library's mechanisms, each with laws: a parameter is a number or a range that is drawn from.
_RESIN: dict[str, list[dict[str, Any]]] = {
    "viscoelasticity": [
        {"share": (0.12, 0.4), "time_s": (4.0, 30.0), "beta": (0.4, 0.7)},
        {"power": (0.03, 0.09), "time_s": (0.5, 3.0)},
        {"share": (0.12, 0.35), "time_s": (4.0, 20.0), "three": 1.0},
    ],
    "mullins_softening": [{"rate": (0.35, 0.9)}, {"rate": (0.5, 1.0), "tanh": 1.0}],
    "rate_independent_hysteresis": [{"share": (0.15, 0.4), "width": (0.02, 0.08)}],
    "temperature_drift": [{"rate": (0.006, 0.02)}],
    "fatigue_drift": [{"power": (0.05, 0.15)}],
    "anisotropy": [{"excess": (0.1, 0.4)}],
    "seating": [{"gap_mm": (0.15, 0.6)}],
    "frame_compliance": [{"mm": (0.2, 0.8)}],
    "force_lag": [{"time_s": (0.4, 1.5)}],
    "force_drift": [{"share": (0.005, 0.009)}],
}
SINGLE: dict[str, dict[str, list[dict[str, Any]]]] = {
    "coupon": {
        **_RESIN,
        "strain_stiffening": [{"gent": (3.0, 12.0)}, {"ogden": (6.0, 9.0), "share": (0.15, 0.4)}],
        "tension_compression_asymmetry": [{"excess": (0.15, 0.5)}],
    },
    "lattice_compression": {
        **{k: v for k, v in _RESIN.items() if k != "frame_compliance"},
        "strain_stiffening": [{"plateau": (0.12, 0.4)}, {"closing": (4.0, 20.0)}],
    },
    "pressure_hold": {
        "leak": [{"orifice": (1e-4, 2e-3)}, {"seal": (1e-4, 2e-3)}, {"channel": (1e-4, 2e-3)}],
        "temperature_drift": [{"kelvin": (3.0, 10.0), "time_s": (8.0, 25.0)}],
        "viscoelasticity": [{"share": (0.01, 0.04), "power": (0.2, 0.35)}],
        "pressure_drift": [{"kPa": (2.0, 8.0)}],
    },
    "waveguide_bending": {
        "led_drift": [{"share": (0.03, 0.12), "time_s": (100.0, 300.0)}],
        "ambient_light": [{"share": (0.05, 0.3)}],
        "optical_nonlinearity": [{"excess": (0.2, 0.8), "power": (1.5, 2.5)}],
        "clock_offset": [{"seconds": (0.2, 0.8)}],
    },
    "pressure_step": {
        "line_lag": [{"time_s": (0.12, 0.4)}],
        "viscoelasticity": [{"share": (0.12, 0.35), "time_s": (0.4, 1.5), "beta": (0.5, 0.8)}],
        "inertia": [{"period_s": (0.2, 0.6), "damping": (0.06, 0.25)}],
    },
    "unit_pose": {"gravity": [{"weight": (0.6, 1.4)}]},
    "blocked_force": {"line_lag": [{"time_s": (0.15, 0.5)}]},
    "volume": {"pressure_offset": [{"kPa": (1.2, 3.0)}]},
}
OUTSIDE: dict[str, dict[str, dict[str, Any]]] = {
    "machine": {
        "outside_mains": {"share": (0.01, 0.04), "period_s": (3.0, 15.0)},
        "outside_slip": {"share": (0.02, 0.06)},
        "outside_crack": {"share": (0.05, 0.25)},
        "outside_cell_nonlinear": {"share": (0.03, 0.12)},
        "outside_backlash": {"share": (0.02, 0.06)},
        "outside_stick": {"share": (0.02, 0.06), "period_s": (2.0, 9.0)},
    },
    "pressure_hold": {
        "outside_room": {"kelvin": (0.6, 3.0), "period_s": (60.0, 200.0)},
        "outside_bumped": {"kPa": (1.0, 4.0), "at": (0.3, 0.8)},
        "outside_tilt": {"kPa": (1.0, 4.0), "at": (0.3, 0.8)},
        "outside_valve": {"rate": (2e-3, 1e-2), "opens_kPa": (60.0, 140.0)},
        "outside_shut_later": {"rate": (5e-4, 3e-3), "until_s": (50.0, 140.0)},
        "outside_pulses": {"kPa": (1.0, 4.0), "period_s": (20.0, 80.0)},
    },
    "waveguide_bending": {
        "outside_play": {"deg": (1.0, 5.0)},
        "outside_modes": {"share": (0.01, 0.05)},
        "outside_room": {"share": (0.01, 0.04), "period_s": (25.0, 90.0)},
        "outside_jump": {"share": (0.02, 0.08), "at": (0.3, 0.8)},
        "outside_compressed": {"end": (0.95, 1.15)},
    },
    "pressure_step": {
        "outside_wind": {"deg": (0.3, 1.2), "period_s": (0.7, 2.0)},
        "outside_stick": {"deg": (0.8, 2.5)},
        "outside_slipped": {"deg": (0.5, 2.0)},
    },
    "unit_pose": {"outside_cable": {"deg": (0.5, 2.0)}},
    "blocked_force": {"outside_friction": {"share": (0.04, 0.15)}},
}
# Faults that the library has learned since they were made: by which name, where it names them.
SINCE = {
    "outside_play": "waveguide_play",
    "outside_shut_later": "leak",
    "outside_valve": "leak",
    "outside_cell_nonlinear": "force_nonlinearity",
}
# Two at once; each has its own law, as above.
PAIRS: dict[str, list[tuple[str, str]]] = {
    "coupon": [
        ("viscoelasticity", "strain_stiffening"),
        ("mullins_softening", "temperature_drift"),
        ("anisotropy", "viscoelasticity"),
        ("strain_stiffening", "tension_compression_asymmetry"),
        ("temperature_drift", "strain_stiffening"),
    ],
    "lattice_compression": [
        ("viscoelasticity", "strain_stiffening"),
        ("anisotropy", "viscoelasticity"),
        ("mullins_softening", "temperature_drift"),
    ],
    "pressure_hold": [("leak", "temperature_drift")],
    "waveguide_bending": [("led_drift", "ambient_light"), ("clock_offset", "optical_nonlinearity")],
    "pressure_step": [("inertia", "viscoelasticity")],
}
CLEAN_KINDS = (*SINGLE,)
_LAWS = [(k, n, law) for k, effects in SINGLE.items() for n, each in effects.items() for law in each]
_FAULTS = [(k, n) for k in OUTSIDE for n in OUTSIDE[k]]
_BOTH = [(k, pair) for k in PAIRS for pair in PAIRS[k]]
# How many sets of a class have each of its cases once.
ROUND = {
    "clean": len(CLEAN_KINDS) * len(NOISES),
    "single": len(_LAWS),
    "outside": len(_FAULTS),
    "two": len(_BOTH),
    "lab": len(lab.CASES),
}
CLASSES = (*ROUND,)


@attrs.frozen
class Order:
    """One set: its class and kind, what is hidden, its noise over the full scale, and its seed."""

    part: str
    kind: str
    faults: Faults
    noise: str
    level: float
    seed: int

    @property
    def truth(self) -> tuple[str, ...]:
        """The library's names of what is hidden; none of a clean set and of a fault outside."""
        if self.part == "lab":
            return lab.RIGHT[next(iter(self.faults))]
        names = (SINCE.get(name, name) for name in self.faults)
        return tuple(name for name in names if not name.startswith("outside"))


def drawn(rng: Rng, law: dict[str, Any]) -> dict[str, float]:
    """A law's parameters: numbers as they are, ranges by their logarithm."""
    found = {}
    for key, value in law.items():
        ends = value if isinstance(value, tuple) else (value, value)
        found[key] = float(np.exp(rng.uniform(*np.log(ends))))
    return found


def order(part: str, number: int, battery: int) -> Order:
    """The set of a class with this number, of a battery's seed."""
    seed = [battery, CLASSES.index(part), number]
    rng = np.random.default_rng(seed)
    kind, faults = _hidden(part, number, rng)
    noise = NOISES[number % len(NOISES)] if part == "clean" else str(rng.choice(["white", "slow", "uneven"]))
    if kind == "unit_pose" and noise == "uneven":
        noise = "white"
    level = float(np.exp(rng.uniform(np.log(0.001), np.log(0.005))))
    return Order(part, kind, faults, noise, level, int(rng.integers(2**31)))


def _hidden(part: str, number: int, rng: Rng) -> tuple[str, Faults]:
    if part == "clean":
        # Each kind with each noise in turn.
        return CLEAN_KINDS[(number // len(NOISES)) % len(CLEAN_KINDS)], {}
    if part == "single":
        kind, name, law = _LAWS[number % len(_LAWS)]
        return kind, {name: drawn(rng, law)}
    if part == "outside":
        group, name = _FAULTS[number % len(_FAULTS)]
        kind = MACHINE[(number // len(_FAULTS)) % 2] if group == "machine" else group
        return kind, {name: drawn(rng, OUTSIDE[group][name])}
    if part == "lab":
        kind, name = lab.CASES[number % len(lab.CASES)]
        return kind, {name: {}}
    kind, pair = _BOTH[number % len(_BOTH)]
    return kind, {n: drawn(rng, SINGLE[kind][n][int(rng.integers(len(SINGLE[kind][n])))]) for n in pair}


def noise_of(of: Order) -> dict[tuple[str, str], float]:
    """Standard deviation of the noise added to each channel, as read, by experiment and channel."""
    tests = BENCHES[of.kind](np.random.default_rng(of.seed), of.faults, of.noise)
    return {(t.name, t.channel): of.level * t.scale for t in tests}


def made(of: Order) -> list[Trial]:
    """The tests of a set, as instruments read them."""
    rng = np.random.default_rng(of.seed)
    tests = BENCHES[of.kind](rng, of.faults, of.noise)
    by = instrument(rng, tests)
    if of.part == "lab":
        mishap, _ = lab.MISHAPS[next(iter(of.faults))]
        tests = mishap(rng, tests, of.level * tests[0].scale)
    return [read(rng, test, of.noise, of.level, by) for test in tests]
