"""Least squares for sums of terms: factors by linear algebra, exponents by nonlinear least squares."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import attrs
import numpy as np
from scipy import optimize

from ..arrays import Array
from .coupon import Coupon, isochoric_stress, isochoric_stretches
from .law_forms import EXPONENTS, Form

# Exponents of which every combination is tried, and how many of the best are refined.
GRID = np.array(
    [-12.0, -8, -6, -5, -4, -3, -2, -1.5, -1, -0.5, 0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 16, 20]
)
STARTS = 6


@attrs.frozen(eq=False)
class Problem:
    """Weighted least squares of a form: principal stretches (n, 3) and target (n,), stress over scale.

    scale (n,): divisors of the residuals, in MPa.
    """

    form: Form
    stretches: Array
    target: Array
    scale: Array

    @classmethod
    def of(cls, form: Form, coupons: Sequence[Coupon], scale: Array) -> Problem:
        """The problem of a form and coupons; scale (n,): divisors of the residuals, in MPa."""
        stretches = np.concatenate([isochoric_stretches(c.mode, c.stretch) for c in coupons])
        stress = np.concatenate([c.stress_MPa for c in coupons])
        return cls(form, stretches, stress / scale, scale)

    def terms(self, exponents: Array) -> Array:
        """Stress (n, k) over scale, without unit, of every term with factor 1, for exponents (k,).

        A form with fixed terms does not use the exponents.
        """
        return self.form.terms(self.stretches, exponents) / self.scale[:, None]

    def solve(self, exponents: Array) -> tuple[Array, Array]:
        """Best factors (k,) in MPa for exponents (k,), and the weighted residuals (n,), without unit."""
        return linear(self.terms(exponents), self.target, self.form.least)

    def jacobian(self, row: Array) -> Array:
        """Derivatives (n, count) of weighted stress by the parameters of a row (p,), per their units.

        By central differences. Raises InputError for a law that does not split the volume off.
        """
        at = [self.form.law.parameter_names.index(name) for name in self.form.names]
        step = 1e-6 * np.maximum(np.abs(row[at]), 1e-6 * np.abs(row[at]).max())
        k, n = len(at), len(self.target)
        rows = np.tile(row, (k, 2, n, 1))
        for j, place in enumerate(at):
            rows[j, 0, :, place] += step[j]
            rows[j, 1, :, place] -= step[j]
        stretches = np.tile(self.stretches, (2 * k, 1))
        s = isochoric_stress(self.form.law, rows.reshape(-1, len(row)), stretches).reshape(k, 2, n)
        return ((s[:, 0] - s[:, 1]) / (2 * step[:, None])).T / self.scale[:, None]


def linear(terms: Array, target: Array, least: Sequence[float]) -> tuple[Array, Array]:
    """Factors (k,) that minimise |terms factors - target| above their bounds, and the residuals (n,).

    terms (n, k), target (n,), least (k,): lower bounds. Factors are in the unit of target over that of terms.
    """
    # Terms may differ by twenty orders of magnitude; without scaling the small ones drown.
    size = np.linalg.norm(terms, axis=0)
    scaled = terms / size
    if all(low == 0 for low in least):
        factors, _ = optimize.nnls(scaled, target)
    else:
        bounds = (np.asarray(least), np.inf)
        factors = optimize.lsq_linear(scaled, target, bounds, method="bvls").x
    return factors / size, scaled @ factors - target


def best_exponents(problem: Problem) -> Array:
    """Exponents (k,), without unit, of the best fit of an Ogden form.

    Every combination of GRID is tried; the STARTS best are refined by nonlinear least squares, within
    EXPONENTS.
    """
    k = problem.form.exponents
    # Distances between columns are those of a triangle of as many rows, however many values there are.
    table = np.column_stack([problem.terms(GRID), problem.target])
    size = np.linalg.norm(table, axis=0)
    *grid, target = np.asarray(np.linalg.qr(table / size, mode="r")).T
    columns = np.column_stack(grid)
    tried = []
    for chosen in itertools.combinations(range(len(GRID)), k):
        _, residual = linear(columns[:, chosen], target, (0.0,) * k)
        tried.append((float(residual @ residual), chosen))
    tried.sort()
    best, found = np.inf, np.zeros(k)
    for _, chosen in tried[:STARTS]:
        start = GRID[list(chosen)]
        # Two equal exponents are one term, and 0 is a limit that the law cannot be given.
        result = optimize.least_squares(
            lambda a: problem.solve(nonzero_exponents(a))[1],
            start,
            bounds=EXPONENTS,
            xtol=1e-10,
            ftol=1e-13,
            gtol=1e-13,
            x_scale=np.maximum(np.abs(start), 1.0),
            max_nfev=200,
        )
        if result.cost < best:
            best, found = result.cost, nonzero_exponents(result.x)
    return found


def nonzero_exponents(exponents: Array) -> Array:
    """Exponents (k,), without unit, with those nearer to 0 than 1e-3 moved to -1e-3 or 1e-3; array (k,)."""
    small = np.abs(exponents) < 1e-3
    return np.where(small, np.where(exponents < 0, -1e-3, 1e-3), exponents)
