"""Graded struts: a field of factors on the struts' diameters over the envelope, from a few parameters.

The factor at a point is the product of four. Along the axis: linear between five values. Across y: from 1 on
the axis to a value at either side. Across x: from 1 in the bending plane to a value at both sides. Factors of
single cells: valid at the cells' centres and interpolated between them. Struts take it at their nodes
(`lattice.Lattice`). It is symmetric about x = 0, as the unit is.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property, lru_cache
from typing import Any, ClassVar, NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from .factor_list import LEAST, MOST, FactorList
from .quantity import Groups, quantity, text_quantity

ALONG_Z = ("base", "lower", "middle", "upper", "tip")
"""Parameters along the axis, evenly spaced from the middle of the first chamber to that of the last."""

_NONE = "assumed: the paper's struts are alike everywhere"


def _factor(text: str) -> Any:
    return quantity(1.0, "", LEAST, MOST, f"factor on the struts' diameters {text}", _NONE)


class CellFactor(NamedTuple):
    """The factor of an entry's cells: column |i| across x, row j across y, chamber k along z; None is all."""

    i: int | None
    j: int | None
    k: int | None
    factor: float


CELLS = FactorList(
    "grading",
    "cells",
    ("number or *", "whole or *", "number or *"),
    "an entry of cells: column, row, chamber and factor",
    "0 2 3",
)
"""Columns count from 0 in the bending plane to both sides, rows from 0 on the axis toward +y, chambers from 1
at the inlet."""


@lru_cache(maxsize=64)
def parsed(text: str) -> tuple[CellFactor, ...]:
    """The entries of a text such as "0 2 3: 0.8; * * 5: 1.2", in one order. Raises InputError."""
    return tuple(CellFactor._make((*place, factor)) for place, factor in CELLS.parsed(text).items())


def cells_text(entries: Iterable[CellFactor]) -> str:
    """The text of entries, as `parsed` takes it.

    >>> cells_text([CellFactor(0, 2, None, 0.8)])
    '0 2 *: 0.8'
    """
    return CELLS.text({tuple(entry[:3]): entry.factor for entry in entries})


@attrs.frozen
class Grading:
    """Section [grading]: factors on the struts' diameters at junctions and at mid-span, over the envelope.

    They multiply. All are 1 by default: uniform struts. `names` are the parameters that differ.
    """

    section: ClassVar[str] = "grading"
    advanced: ClassVar[Groups] = {"grading": ()}

    base: float = _factor("in the middle of the first chamber and below")
    lower: float = _factor("a quarter of the way from the first chamber's middle to the last's")
    middle: float = _factor("half way up")
    upper: float = _factor("three quarters of the way up")
    tip: float = _factor("in the middle of the last chamber and above")
    minus_y: float = _factor("in the outermost cells on the -y side, over those on the axis")
    plus_y: float = _factor("in the outermost cells on the +y side, over those on the axis")
    beside_x: float = _factor("in the outermost cells across x, over those in the bending plane")
    cells: str = text_quantity(
        "",
        CELLS.canonical,
        'factors of single cells besides, as "column row chamber: factor; ..." with * for all; columns '
        "count from the bending plane to both sides alike, rows from the axis toward +y, chambers from 1 at "
        "the inlet",
        _NONE,
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that differ from their default; empty for uniform struts."""
        return tuple(f.name for f in attrs.fields(Grading) if getattr(self, f.name) != f.default)

    @cached_property
    def entries(self) -> tuple[CellFactor, ...]:
        """The entries of `cells`."""
        return parsed(self.cells)


@attrs.frozen
class Field:
    """The factors of a grading over an envelope; lengths in mm.

    cell: edge of a cell; count: of chambers; half_x, y_minus, y_plus: number of cells to each side of the one
    on the axis. Beyond this envelope, as in a user-defined body, the outermost values apply.
    """

    grading: Grading
    cell: float
    count: int
    half_x: int
    y_minus: int
    y_plus: int

    def at(self, points: ArrayLike) -> Array:
        """Factors (n,) at points (n, 3) in mm.

        >>> Field(Grading(tip=0.8), 10.0, 3, 1, 1, 2).at([[0.0, 0.0, 22.5]]).tolist()
        [0.9]
        """
        p = np.asarray(points, float)
        g = self.grading
        found = np.ones(len(p))
        for weights, values in zip(self._weights(p), self._values, strict=True):
            if any(value != 1.0 for value in values):
                found *= weights @ np.array(values)
        return found * self._of_cells(p) if g.entries else found

    @property
    def _values(self) -> tuple[tuple[float, ...], ...]:
        g = self.grading
        along = tuple(getattr(g, name) for name in ALONG_Z)
        return along, (g.minus_y, 1.0, g.plus_y), (1.0, g.beside_x)

    def _weights(self, p: Array) -> tuple[Array, Array, Array]:
        """Shares of the values along z (n, 5), across y (n, 3) and across x (n, 2) at points (n, 3)."""
        u = self.cell
        rows = np.linspace(0.5, self.count - 0.5, len(ALONG_Z)) * u
        return (
            _hats(rows, p[:, 2]),
            _hats(np.array([-self.y_minus * u, 0.0, self.y_plus * u]), p[:, 1]),
            _hats(np.array([0.0, self.half_x * u]), np.abs(p[:, 0])),
        )

    @property
    def cell_centres(self) -> Array:
        """Centres (columns, rows, chambers, 3) in mm of the cells at x >= 0, ordered as `cell_factors`."""
        places = (
            np.arange(self.half_x + 1),
            np.arange(-self.y_minus, self.y_plus + 1),
            np.arange(self.count) + 0.5,
        )
        return np.stack(np.meshgrid(*places, indexing="ij"), axis=-1) * self.cell

    def cells_of_factors(self, factors: ArrayLike) -> str:
        """The text of `cells` with a factor for each cell, to two digits; (columns, rows, chambers).

        Out of bounds they are taken to the nearest bound.

        >>> Field(Grading(), 10.0, 2, 0, 0, 1).cells_of_factors([[[1.0, 1.0], [0.8, 1.0]]])
        '0 1 1: 0.8'
        """
        table = np.round(np.clip(np.asarray(factors, float), LEAST, MOST), 2)
        return cells_text(
            CellFactor(i, j - self.y_minus, k + 1, float(table[i, j, k]))
            for i, j, k in np.argwhere(table != 1.0).tolist()
        )

    @cached_property
    def cell_factors(self) -> Array:
        """Product of the entries in each cell: columns from the bending plane, rows from -y, chambers."""
        table = np.ones((self.half_x + 1, self.y_minus + self.y_plus + 1, self.count))
        for i, j, k, factor in self.grading.entries:
            table[self._cells_of(i, j, k)] *= factor
        return table

    def _cells_of(self, i: int | None, j: int | None, k: int | None) -> tuple[Any, Any, Any]:
        return (
            slice(None) if i is None else i,
            slice(None) if j is None else j + self.y_minus,
            slice(None) if k is None else k - 1,
        )

    def _of_cells(self, p: Array) -> Array:
        """Factors of cells, at their centres, linear along each axis between them; (n,) at points (n, 3)."""
        table, u = self.cell_factors, self.cell
        place = np.stack([np.abs(p[:, 0]) / u, p[:, 1] / u + self.y_minus, p[:, 2] / u - 0.5], axis=1)
        place = np.clip(place, 0.0, np.array(table.shape) - 1.0)
        low = np.minimum(place.astype(int), np.maximum(np.array(table.shape) - 2, 0))
        share = place - low
        found = np.zeros(len(p))
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, share, 1.0 - share), axis=1)
            at = np.minimum(low + corner, np.array(table.shape) - 1)
            found += weight * table[tuple(at.T)]
        return found

    def misplaced(self) -> str:
        """The first entry of `cells` that names no cell of the envelope, as text; "" where all do."""
        for entry in self.grading.entries:
            i, j, k, _ = entry
            inside = (
                (i is None or i <= self.half_x)
                and (j is None or -self.y_minus <= j <= self.y_plus)
                and (k is None or 1 <= k <= self.count)
            )
            if not inside:
                return cells_text([entry])
        return ""


def _hats(places: Array, at: Array) -> Array:
    """Shares (n, m) of ascending places (m,) in linear interpolation at (n,), constant beyond both ends."""
    return np.stack([np.interp(at, places, row) for row in np.eye(len(places))], axis=1)
