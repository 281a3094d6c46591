"""Numpy arrays: their type in signatures, converters, and groups of linked things."""

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


def float64(values: Any) -> Array:
    """Values as a contiguous array of floats."""
    return np.ascontiguousarray(values, np.float64)


def int32(values: Any) -> Array:
    """Values as a contiguous array of whole numbers."""
    return np.ascontiguousarray(values, np.int32)


def ranges(counts: Array, first: Array | int = 0) -> tuple[Array, Array]:
    """Every number (k,) of some ranges, of `counts` (n,) from `first` (n,) on, after the row (k,) it is of.

    >>> [found.tolist() for found in ranges(np.array([2, 0, 1]), np.array([5, 7, 9]))]
    [[0, 0, 2], [5, 6, 9]]
    """
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) + np.repeat(first - (np.cumsum(counts) - counts), counts)


def connected(count: int, one: Array, other: Array) -> Array:
    """Number (count,), from 0, of each thing's group: `count` things, the links one (k,) to other (k,)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(one), bool), (one, other)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])


def pareto(costs: Array) -> Array:
    """Numbers of the Pareto-optimal points (n, c): no other is as small in all costs and smaller in one.

    Equal points are all among them; one with a cost that is not finite is not.
    """
    finite = np.isfinite(costs).all(axis=1)
    found = []
    for number in np.flatnonzero(finite):
        no_worse = (costs <= costs[number]).all(axis=1) & finite
        if not (no_worse & (costs < costs[number]).any(axis=1)).any():
            found.append(number)
    return np.array(found, dtype=int)
