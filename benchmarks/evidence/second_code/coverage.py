"""Do 95 % intervals hold the truth? Sets of one effect by the engine's own law, integrated otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np

from .judging import judged
from .sets import Order, drawn

NOISES = ("white", "slow", "quantised")
# By kind: what is hidden, the law's ranges, and by which keys the engine has them, times what factor.
LAWS: tuple[tuple[str, str, dict[str, Any], dict[str, tuple[str, float]]], ...] = (
    (
        "coupon",
        "viscoelasticity",
        {"share": (0.08, 0.3), "time_s": (4.0, 30.0), "one": 1.0},
        {"viscoelasticity.share": ("share", 1.0), "viscoelasticity.time_s": ("time_s", 1.0)},
    ),
    (
        "pressure_hold",
        "leak",
        {"laminar": (2e-4, 3e-3)},
        {"leak.loss_per_s": ("laminar", 1.0)},
    ),
    (
        "waveguide_bending",
        "led_drift",
        {"per_hour": (0.2, 1.5)},
        {"led_drift.per_hour": ("per_hour", 1.0)},
    ),
    (
        "lattice_compression",
        "anisotropy",
        {"excess": (0.06, 0.4)},
        {"anisotropy.in_plane": ("excess", 1.0)},
    ),
    (
        "lattice_compression",
        "temperature_drift",
        {"per_K": (0.004, 0.015)},
        {"temperature_drift.per_K": ("per_K", 1.0)},
    ),
)
# How many sets have each law under each noise once.
ROUND = len(NOISES) * len(LAWS)


def covered(number: int, battery: int) -> dict[str, Any]:
    """One set as a row, with whether each interval of a named effect holds the truth: `inside`."""
    rng = np.random.default_rng([battery, 99, number])
    kind, name, law, keys = LAWS[(number // len(NOISES)) % len(LAWS)]
    faults = {name: drawn(rng, law)}
    level = float(np.exp(rng.uniform(np.log(0.001), np.log(0.005))))
    of = Order("coverage", kind, faults, NOISES[number % len(NOISES)], level, int(rng.integers(2**31)))
    row = judged(of)
    inside = {}
    if name in row.get("ambiguity", ()):
        for key, (parameter, factor) in keys.items():
            if key in row["intervals"]:
                low, high = row["intervals"][key]
                inside[key] = bool(low <= faults[name][parameter] * factor <= high)
    return {**row, "inside": inside}
