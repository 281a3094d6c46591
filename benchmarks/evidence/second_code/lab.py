"""What happens in a laboratory: what is typed, mixed up, moved, warmed and dropped while tests are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from .recording import Trial

Rng = np.random.Generator
Mishap = Callable[[Rng, Sequence[Trial], float], list[Trial]]

# Names that are right, in the set, for each mishap; with none, the library has no name for it, and an open
# verdict is right.
SCALE = ("geometry_as_typed", "batch_variation", "force_scale", "step_change")
RIGHT: dict[str, tuple[str, ...]] = {
    "height": SCALE,
    "swapped": SCALE,
    # What scales the force of a test says "clamping" too; from a moment on, what changed and stayed.
    "slip": ("force_scale", "step_change"),
    "selfheat": ("self_heating", *SCALE),
    "warming_room": ("temperature_drift",),
    "nonlinear_gauge": ("force_nonlinearity", "pressure_nonlinearity"),
    "rezero": ("force_drift", "pressure_drift", "pressure_offset", "step_change"),
    "unit_change": (),
    "bursts": (),
    "grows_with_load": (),
    "flicker": (),
    "dropped": (),
}
# Those that leave the model right: `none` is the right answer.
CLEAN = frozenset(("bursts", "grows_with_load", "flicker", "dropped"))


def _with(test: Trial, column: str, values: Any) -> Trial:
    return attrs.evolve(test, columns={**test.columns, column: values})


def _height(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """One specimen's height is typed 4 to 12 % off."""
    which = tests[int(rng.integers(1, len(tests)))].fields["specimen"]
    off = 1.0 + rng.uniform(0.04, 0.12) * rng.choice([-1.0, 1.0])

    def typed(t: Trial) -> Trial:
        t = attrs.evolve(t, fields={**t.fields, "length_mm": round(t.fields["length_mm"] * off, 3)})
        return _with(t, "strain", t.columns["strain"] / off) if "strain" in t.columns else t

    return [typed(t) if t.fields["specimen"] == which else t for t in tests]


def _swapped(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Two kinds of specimen that differ by a tenth, whose labels do not say which is which."""
    found = []
    for number, t in enumerate(tests):
        scaled = t.columns[t.channel] * (1.1 if number % 2 else 1.0)
        label = "A" if 2 * number < len(tests) else "B"
        found.append(attrs.evolve(_with(t, t.channel, scaled), fields={**t.fields, "specimen": label}))
    return found


def _slip(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Clamps slip in one test: from a moment on part of the displacement is lost."""
    which = int(rng.integers(len(tests)))
    t = tests[which]
    y = t.columns[t.channel]
    clock = t.columns["time_s"]
    gone = np.clip((clock / clock[-1] - 0.3) / 0.1, 0.0, 1.0)
    return [*tests[:which], _with(t, t.channel, y - rng.uniform(0.05, 0.15) * gone * y), *tests[which + 1 :]]


def _selfheat(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Tests that are fast are some per cent softer."""
    share = rng.uniform(0.03, 0.08)

    def rate(t: Trial) -> float:
        way = t.columns.get("strain", t.columns.get("displacement_mm"))
        return float(np.abs(np.gradient(way, t.columns["time_s"])).max() / np.ptp(way))

    middle = float(np.median([rate(t) for t in tests]))
    return [
        _with(t, t.channel, t.columns[t.channel] * (1.0 - share * (rate(t) > 1.01 * middle))) for t in tests
    ]


def _warming_room(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """The room warms steadily by 4 to 11 K an hour."""
    per_hour = rng.uniform(4.0, 11.0)

    def warmed(t: Trial) -> Trial:
        clock = t.columns["time_s"]
        warm = 1.0 + per_hour / 296.0 * (clock - clock[0]) / 3600.0
        return _with(t, t.channel, (t.columns[t.channel] + 101.325) * warm - 101.325)

    return [warmed(t) for t in tests]


def _nonlinear(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """A sensor that is 2 to 4 % off straight, most in the middle of its range."""
    most = max(float(np.abs(t.columns[t.channel]).max()) for t in tests)
    share = rng.uniform(0.08, 0.16)
    return [
        _with(t, t.channel, (y := t.columns[t.channel]) + share * y * (1.0 - np.abs(y) / most)) for t in tests
    ]


def _rezero(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Somebody sets the zero anew in the middle of a test."""
    which = int(rng.integers(len(tests)))
    t = tests[which]
    y, clock = t.columns[t.channel], t.columns["time_s"]
    off = rng.uniform(0.03, 0.08) * np.abs(y).max() * (clock > rng.uniform(0.4, 0.7) * clock[-1])
    return [*tests[:which], _with(t, t.channel, y - off), *tests[which + 1 :]]


def _unit_change(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """A display that is switched from N to kgf, or kPa to psi, in the middle of a file."""
    which = int(rng.integers(len(tests)))
    t = tests[which]
    y, clock = t.columns[t.channel], t.columns["time_s"]
    by = 9.80665 if "force" in t.channel or "stress" in t.channel else 6.894757
    return [
        *tests[:which],
        _with(t, t.channel, np.where(clock > 0.5 * clock[-1], y / by, y)),
        *tests[which + 1 :],
    ]


def _bursts(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """A motor beside the bench: bursts of 8 times the noise, in a tenth of each record."""

    def disturbed(t: Trial) -> Trial:
        y = t.columns[t.channel].copy()
        for _ in range(3):
            at, n = int(rng.integers(len(y))), max(3, len(y) // 30)
            y[at : at + n] += 8.0 * sd * rng.normal(size=len(y[at : at + n]))
        return _with(t, t.channel, y)

    return [disturbed(t) for t in tests]


def _grows(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Noise that grows with load, to 6 times as much at the top."""

    def noisier(t: Trial) -> Trial:
        y = t.columns[t.channel]
        return _with(t, t.channel, y + 6.0 * sd * np.abs(y) / np.abs(y).max() * rng.normal(size=len(y)))

    return [noisier(t) for t in tests]


def _flicker(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """A lamp that flickers at twice the mains, beside the clock of the logger: noise in proportion."""

    def lit(t: Trial) -> Trial:
        phase = rng.uniform(0.0, 6.3, len(t.columns["time_s"]))
        return _with(t, t.channel, t.columns[t.channel] * (1.0 + 0.004 * np.sin(phase)))

    return [lit(t) for t in tests]


def _dropped(rng: Rng, tests: Sequence[Trial], sd: float) -> list[Trial]:
    """Frames that are dropped: every twentieth row is missing, and once a tenth of the record."""

    def fewer(t: Trial) -> Trial:
        n = len(t.columns["time_s"])
        kept = rng.uniform(size=n) > 0.05
        pause = int(rng.integers(n // 4, n // 2))
        kept[pause : pause + n // 10] = False
        return attrs.evolve(t, columns={c: v[kept] for c, v in t.columns.items()})

    return [fewer(t) for t in tests]


MISHAPS: dict[str, tuple[Mishap, tuple[str, ...]]] = {
    "height": (_height, ("coupon", "lattice_compression")),
    "swapped": (_swapped, ("coupon", "lattice_compression")),
    "slip": (_slip, ("coupon", "lattice_compression")),
    "selfheat": (_selfheat, ("coupon", "lattice_compression")),
    "warming_room": (_warming_room, ("pressure_hold",)),
    "nonlinear_gauge": (_nonlinear, ("coupon", "volume")),
    "rezero": (_rezero, ("coupon", "lattice_compression", "pressure_hold")),
    "unit_change": (_unit_change, ("coupon", "lattice_compression", "pressure_hold")),
    "bursts": (_bursts, ("coupon", "lattice_compression", "pressure_hold", "waveguide_bending")),
    "grows_with_load": (_grows, ("coupon", "lattice_compression")),
    "flicker": (_flicker, ("waveguide_bending",)),
    "dropped": (_dropped, ("coupon", "pressure_hold", "pressure_step")),
}
CASES = [(kind, name) for name, (_, kinds) in MISHAPS.items() for kind in kinds]
