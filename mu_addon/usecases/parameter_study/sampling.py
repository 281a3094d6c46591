"""Points of a parameter study in the unit cube; more can be added later without moving the first ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .settings import SOBOL

Array = np.ndarray[Any, Any]


def sample(method: str, count: int, dimensions: int, seed: int, before: Array | None = None) -> Array:
    """Points (count, d) in [0, 1)^d, the first of them `before` (n, d), made by the same method and seed.

    sobol: a scrambled Sobol sequence, whose longer beginnings contain the shorter. latin_hypercube: n points
    lie in n strata of every axis; points added go into empty strata, so that twice (three times ...) as many
    points are a Latin hypercube again (Sallaberry, Helton, Hora 2008).
    """
    from scipy.stats import qmc

    known = np.empty((0, dimensions)) if before is None else before
    if len(known) >= count:
        return known
    if method == SOBOL:
        # A power of two is what the sequence is balanced for; less of it is a beginning.
        whole = qmc.Sobol(dimensions, rng=seed).random_base2(math.ceil(math.log2(max(count, 2))))
        return np.concatenate([known, whole[len(known) : count]])
    if not len(known):
        return np.asarray(qmc.LatinHypercube(dimensions, rng=seed).random(count))
    return np.concatenate(
        [known, _into_empty_strata(known, count, np.random.default_rng([seed, len(known)]))]
    )


def _into_empty_strata(known: Array, count: int, rng: np.random.Generator) -> Array:
    """Points (count - n, d) in strata of width 1 / count of each axis that hold no point yet."""
    added = np.empty((count - len(known), known.shape[1]))
    for axis, values in enumerate(known.T):
        # At least so many are empty; more where two points share one.
        empty = np.setdiff1d(np.arange(count), np.floor(values * count).astype(int))
        strata = rng.permutation(rng.choice(empty, len(added), replace=False))
        added[:, axis] = (strata + rng.random(len(added))) / count
    return added
