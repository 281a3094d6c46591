"""Anchors in the plane of bending and the windows of them that a waveguide can follow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, did_you_mean
from .parameters import Unit

SHORTEST = 3
"""Fewest anchors of a path (the source paper's h >= 3)."""


class Window(NamedTuple):
    """A path through `length` consecutive anchors P_start .. P_(start + length - 1), counted from 1.

    name: alpha1, alpha2, ... in the order of `windows`.
    """

    name: str
    start: int
    length: int

    @property
    def indices(self) -> range:
        """Rows of the anchor array on this path, counted from 0."""
        return range(self.start - 1, self.start - 1 + self.length)


def anchor_points(unit: Unit) -> NDArray[np.float64]:
    """Anchors P1..Pn of a unit, (n, 3) in mm at its scale, in order from the inlet.

    They are the centres of the cells in the column x = 0 of the anchor row, one a chamber.

    >>> from mu_addon.design import load_preset
    >>> anchor_points(load_preset("mu-1.0x"))[:2].tolist()
    [[0.0, 25.0, 6.25], [0.0, 25.0, 18.75]]
    """
    d = unit.dimensions
    z = (np.arange(d.count) + 0.5) * d.cell
    return np.stack([np.zeros_like(z), np.full_like(z, d.row * d.cell), z], axis=1)


def windows(n: int) -> list[Window]:
    """All (n - 2)(n - 1)/2 windows of 3 or more consecutive anchors out of n, by length, then by start.

    They are named alpha1, alpha2, ... in this order; fewer than 3 anchors give an empty list.

    >>> [(w.name, w.start, w.length) for w in windows(4)]
    [('alpha1', 1, 3), ('alpha2', 2, 3), ('alpha3', 1, 4)]
    """
    found = [(start, length) for length in range(SHORTEST, n + 1) for start in range(1, n - length + 2)]
    return [Window(f"alpha{number}", start, length) for number, (start, length) in enumerate(found, 1)]


def farthest_window(n: int) -> Window:
    """The shortest window of n anchors, 3 or more, that begins farthest from the inlet.

    >>> farthest_window(6).name
    'alpha4'
    """
    return [one for one in windows(n) if one.length == SHORTEST][-1]


def window(unit: Unit, name: str) -> Window:
    """The window of this name, such as "alpha4", among those of the unit's anchors.

    Raises InputError, which gives the range of valid names.

    >>> from mu_addon.design import load_preset
    >>> window(load_preset("mu-1.0x"), "alpha5").length
    4
    """
    every = windows(unit.dimensions.count)
    for candidate in every:
        if candidate.name == name:
            return candidate
    raise InputError(
        f"there is no path {name!r} among {unit.dimensions.count} anchors"
        + did_you_mean(name, [candidate.name for candidate in every]),
        "path",
        f"choose one of {every[0].name} .. {every[-1].name}",
    )
