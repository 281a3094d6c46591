"""Which sets a battery has, in which order, and the row of each."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import coverage
from .judging import judged
from .sets import ROUND, order

# How many sets of a class have each of its cases once.
ROUNDS = {**ROUND, "coverage": coverage.ROUND}


def shuffled(parts: Sequence[str], rounds: int, seed: int) -> list[tuple[str, int]]:
    """Class and number of each set: within a round in a random order, which is the seed's."""
    found = []
    for turn in range(rounds):
        each = [(part, turn * ROUNDS[part] + i) for part in parts for i in range(ROUNDS[part])]
        found += [each[i] for i in np.random.default_rng([seed, turn]).permutation(len(each))]
    return found


def row_of(battery: int, part: str, number: int, until: float = float("inf")) -> dict[str, Any] | None:
    """One set's row; None after `until`, in seconds since the epoch."""
    if time.time() > until:
        return None
    row = coverage.covered(number, battery) if part == "coverage" else judged(order(part, number, battery))
    return row | {"battery": battery, "number": number, "part": part}
