"""What a fit leaves of a record, beside all that it has fitted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ..fit import Fit, Fitter
from ..record import KNOWN, Record, Series
from ..spanned import basis, unit

# Directions of a test's columns, each of unit length, that hold less than this are none.
NEAR = 0.03
# A column of which less than this share remains after projection has no information.
ABSORBED = 1e-3


@attrs.frozen(eq=False)
class Left:
    """What a fit leaves of a record of N values: its whitened residual, beside all that it has fitted.

    spare: what the noise may spare of a gain in chi squared, by group of series.
    """

    fitter: Fitter
    fit: Fit
    spare: Mapping[str, float]

    @property
    def record(self) -> Record:
        """The record."""
        return self.fitter.record

    @property
    def residual(self) -> Array:
        """Whitened residual (N,)."""
        return self.fit.residual

    @cached_property
    def clocked(self) -> list[Series]:
        """Series with a clock, of unknown spread."""
        return [s for s in self.record.series if s.group != KNOWN and not math.isnan(s.sample_s)]

    @cached_property
    def fitted(self) -> Array:
        """Orthonormal columns (N, k) that span what is fitted, zeros among it."""
        return np.hstack([self.fitter.zeros_basis, basis(self.fit.jacobian, NEAR)])

    @cached_property
    def response(self) -> Array:
        """See `Fitter.response`."""
        return self.fitter.response(self.fit.values)

    @cached_property
    def channels(self) -> dict[str, Array]:
        """Rows of each channel."""
        series = self.record.series
        names = dict.fromkeys(s.channel for s in series if s.group != KNOWN)
        return {
            c: np.concatenate([np.arange(s.at.start, s.at.stop) for s in series if s.channel == c])
            for c in names
        }

    def saved(self, series: Iterable[Series]) -> float:
        """What the noise may spare of a gain in these series."""
        return sum(self.spare[group] for group in dict.fromkeys(s.group for s in series))

    def place(self, s: Series, block: int) -> str:
        """Experiment, channel and time of a block of a series, as text."""
        return f"{self.record.experiments[s.experiment].name}, {s.channel}, {s.time_s[block]:.4g} s"

    def gained(self, white: Array, rows: Any = slice(None)) -> tuple[float, int]:
        """Chi squared that whitened columns (n, d) of some rows take beside what is fitted, and their rank.

        Near dependences are left out, as in `basis`; so is a column that is fitted but for rounding.
        """
        one, q = unit(white), self.fitted[rows]
        onto = q.T @ one
        gram = one.T @ one - onto.T @ onto
        along = one.T @ self.residual[rows] - onto.T @ (self.fitted.T @ self.residual)
        size = np.sqrt(np.maximum(np.diag(gram), 0.0))
        kept = size > 1e-6
        size = size[kept]
        squares, vectors = np.linalg.eigh(gram[np.ix_(kept, kept)] / np.outer(size, size))
        resolved = squares > NEAR**2
        parts = vectors.T @ (along[kept] / size)
        return float(np.sum(parts[resolved] ** 2 / squares[resolved])), int(resolved.sum())

    def deviates(self, columns: Array) -> Array:
        """Normal deviates (m,) of columns (N, m), each alone beside what is fitted; 0 if that has it."""
        white = self.fitter.whitened(columns)
        before = np.linalg.norm(white, axis=0)
        white -= self.fitted @ (self.fitted.T @ white)
        length = np.linalg.norm(white, axis=0)
        resolved = length > ABSORBED * np.maximum(before, 1e-300)
        return np.where(resolved, white.T @ self.residual / np.where(resolved, length, 1.0), 0.0)
