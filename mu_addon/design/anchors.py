"""Anchors in the sagittal plane and the windows of them that a waveguide can follow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .parameters import Unit

SHORTEST = 3
"""Fewest anchors of a path (the source paper's h >= 3)."""


class Window(NamedTuple):
    """A path through `length` contiguous anchors P_start .. P_(start + length - 1), counted from 1."""

    name: str
    start: int
    length: int

    @property
    def indices(self) -> range:
        """Rows of the anchor array on this path, counted from 0."""
        return range(self.start - 1, self.start - 1 + self.length)


def anchor_points(unit: Unit) -> NDArray[np.float64]:
    """Anchors P1..Pn (n, 3) in mm, from the inlet: the cell centres of column x = 0 in the anchor row."""
    d = unit.dimensions
    z = (np.arange(d.count) + 0.5) * d.cell
    return np.stack([np.zeros_like(z), np.full_like(z, d.row * d.cell), z], axis=1)


def windows(n: int) -> list[Window]:
    """All (n - 2)(n - 1)/2 windows of n anchors, by length then start, named alpha1, alpha2, ..."""
    found = [(start, length) for length in range(SHORTEST, n + 1) for start in range(1, n - length + 2)]
    return [Window(f"alpha{number}", start, length) for number, (start, length) in enumerate(found, 1)]


def window(unit: Unit, name: str) -> Window:
    """The unit's window of that name; InputError lists the names there are."""
    every = windows(unit.dimensions.count)
    for candidate in every:
        if candidate.name == name:
            return candidate
    raise InputError(
        f"there is no path {name!r} among {unit.dimensions.count} anchors",
        "path",
        f"choose one of {every[0].name} .. {every[-1].name}",
    )
