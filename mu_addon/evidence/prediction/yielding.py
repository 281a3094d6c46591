"""A material that yields: elements side by side that slide at strains of their own (Prandtl, Ishlinskii)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..effect import Effect, Parameter

Array = np.ndarray[Any, Any]

NAME = "rate_independent_hysteresis"
# Elements that slide, all with the same say.
_ELEMENTS = 48
_HARDENING = 0.1
# Strains at which they slide, over the mean one: an exponential distribution's, at its even quantiles. The
# middle of each share has a mean a little too small, which the last takes.
_SLIDES = -np.log1p(-(np.arange(_ELEMENTS) + 0.5) / _ELEMENTS)
_SLIDES[-1] += _ELEMENTS - _SLIDES.sum()


def yielding(kind: str) -> Effect:
    """The effect, for a kind: part of the strain stays after unloading, however slow the test."""
    return Effect(
        NAME,
        (
            Parameter(
                "per_strain",
                "",
                0.0,
                200.0,
                0.0,
                (5.0, 20.0, 60.0),
                "1 over the mean strain at which it yields: glassy polymers 0.02 to 0.1",
            ),
            Parameter(
                "hardening", "", 0.0, 0.9, _HARDENING, (_HARDENING,), "share that never yields: 0.01 to 0.3"
            ),
        ),
        (kind,),
        "the material yields: part of its strain stays after unloading, however slow the test",
        "loops to several strains, to zero stress and at two rates a decade apart",
    )


def elastic_strain(strain: Array, values: Mapping[str, float]) -> Array:
    """Strain (n,) that stress goes by, of the strain (n,) of a new specimen in the order it was strained.

    values: by "effect.parameter", see `yielding`. First loading to e gives h e + (1 - h) m (1 - exp(-e/m)),
    with the mean yield strain m and the share h that never yields; after a reversal the same with twice m
    (Masing 1926).
    """
    per_strain = values.get(f"{NAME}.per_strain", 0.0)
    if not per_strain:
        return strain
    slides = _SLIDES / per_strain
    found, state, before = np.empty_like(strain), np.zeros(_ELEMENTS), 0.0
    for start, stop in _straight(strain):
        moved = np.clip(state + (strain[start:stop, None] - before), -slides, slides)
        found[start:stop] = moved.mean(axis=1)
        state, before = moved[-1], float(strain[stop - 1])
    hardening = values.get(f"{NAME}.hardening", _HARDENING)
    return np.asarray(hardening * strain + (1.0 - hardening) * found)


def _straight(strain: Array) -> list[tuple[int, int]]:
    """First rows and ends of the runs in which strain (n,) only rises or only falls."""
    up = np.diff(strain, prepend=0.0)
    way = np.sign(up)
    # What stands still goes on with the run before it.
    for k in np.flatnonzero(way == 0.0):
        way[k] = way[k - 1] if k else 1.0
    turns = np.flatnonzero(np.diff(way)) + 1
    bounds = [0, *turns.tolist(), len(strain)]
    return list(itertools.pairwise(bounds))
