"""How a test is recorded: its clock, and what instruments do to exact readings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import attrs
import numpy as np

Array = np.ndarray[Any, Any]

# Noise of clean sets and of all others. "wander" is as slow as a third of a record.
NOISES = ("white", "slow", "wander", "quantised", "outliers", "uneven")


@attrs.frozen(eq=False)
class Trial:
    """One experiment without noise: its columns, the one that is measured, its full scale, table entries."""

    kind: str
    name: str
    columns: dict[str, Array]
    channel: str
    scale: float
    fields: dict[str, Any] = attrs.field(factory=dict)


def clock(rng: np.random.Generator, lasts_s: float, rows: int, noise: str) -> Array:
    """Times (n,) in s of a record; of an uneven one rows jitter, a tenth is lost, the logger pauses once."""
    t = np.linspace(0.0, lasts_s, rows)
    if noise != "uneven":
        return t
    step = t[1]
    t[1:-1] += rng.uniform(-0.35, 0.35, rows - 2) * step
    kept = rng.uniform(size=rows) > 0.1
    pause = rng.integers(rows // 4, 3 * rows // 4)
    kept[pause : pause + rows // 25] = False
    kept[[0, -1]] = True
    return np.round(t[kept], 4)


def slowly(rng: np.random.Generator, t: Array, time_s: float) -> Array:
    """A stationary process (n,) of unit variance and correlation exp(-lag/time), from its spectrum.

    Sinusoids whose frequencies are drawn from the spectrum itself, a Cauchy distribution.
    """
    many = 300
    angular = np.tan(math.pi * (rng.uniform(size=many) - 0.5)) / time_s
    phase = rng.uniform(0.0, 2.0 * math.pi, many)
    return np.asarray(math.sqrt(2.0 / many) * np.cos(np.outer(t, angular) + phase).sum(axis=1))


@attrs.frozen
class Instrument:
    """What all tests of a set share: steps of the display over the noise, times in s of slow noise."""

    coarse: float
    slow_s: float
    wander_s: float


def instrument(rng: np.random.Generator, tests: list[Trial]) -> Instrument:
    """One for all tests: slow noise of 1 to 6 % of a usual record's length, wandering of 15 to 35 %."""
    lasts = float(np.median([np.ptp(t.columns.get("time_s", np.arange(10.0))) for t in tests]))
    coarse = float(rng.choice([1.0, 2.0, 4.0]))
    return Instrument(coarse, lasts * rng.uniform(0.01, 0.06), lasts * rng.uniform(0.15, 0.35))


def read(rng: np.random.Generator, test: Trial, noise: str, level: float, by: Instrument) -> Trial:
    """The test as instruments read it, with noise of a standard deviation of `level` times its full scale."""
    y = test.columns[test.channel].astype(float)
    t = test.columns.get("time_s", np.arange(len(y), dtype=float))
    sd, white = level * test.scale, rng.normal(size=len(y))
    if noise == "slow":
        y = y + sd * (0.5 * white + 0.85 * slowly(rng, t, by.slow_s))
    elif noise == "wander":
        y = y + sd * (0.7 * white + 0.7 * slowly(rng, t, by.wander_s))
    elif noise == "quantised":
        step = sd * by.coarse
        y = step * np.round((y + 0.3 * sd * white) / step)
    elif noise == "outliers":
        y = y + sd * white
        many = int(rng.integers(1, max(2, len(y) // 150) + 1))
        at = rng.choice(np.arange(2, len(y) - 2), many, replace=False)
        y[at] += sd * rng.uniform(12.0, 60.0, many) * rng.choice([-1.0, 1.0], many)
    else:
        y = y + sd * white
    return attrs.evolve(test, columns={**test.columns, test.channel: y})


def write(folder: Path, tests: list[Trial]) -> None:
    """A folder of measured data, as a laboratory has it."""
    folder.mkdir(parents=True)
    lines = []
    for number, test in enumerate(tests):
        file = f"record_{number}.csv"
        names = list(test.columns)
        rows = np.stack([test.columns[n] for n in names], axis=1)
        np.savetxt(folder / file, rows, "%.8g", ",", header=",".join(names), comments="")
        entry = {"name": test.name, "kind": test.kind, "file": file, "role": "fit", **test.fields}
        lines += ["[[experiment]]", *(f"{k} = {_toml(v)}" for k, v in entry.items()), ""]
    (folder / "experiments.toml").write_text("\n".join(lines))


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    return "[" + ", ".join(map(str, value)) + "]" if isinstance(value, tuple) else str(value)
