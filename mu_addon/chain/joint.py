"""A unit as one elastic joint between rigid plates: a potential of their relative motion and pressure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .unit_between_plates import PlateState

# Share of its range up to which a joint is used with a warning; beyond it no equilibrium is reported.
MOST_RANGE = 1.5
# Growth of the potential, in multiples of the range's own energy, beyond its range.
_WALL = 50.0
# Regularisation of the fit's higher terms, against the states' data.
_RIDGE = 1e-6
_DEGREES = (2, 3, 4)


def exponents(degrees: Sequence[int]) -> Array:
    """Exponents (k, 6) of every product of six variables of the degrees given.

    >>> exponents((1,)).sum(), len(exponents((2, 3, 4)))
    (6, 203)
    """
    rows = [
        np.bincount(chosen, minlength=6)
        for degree in degrees
        for chosen in itertools.combinations_with_replacement(range(6), degree)
    ]
    return np.array(rows)


EXPONENTS = exponents(_DEGREES)


def products(y: Array, powers: Array) -> Array:
    """Products (m, k) of six variables y (m, 6) raised to powers (k, 6)."""
    table = np.ones((len(y), 6, int(powers.max(initial=0)) + 1))
    for n in range(1, table.shape[2]):
        table[:, :, n] = table[:, :, n - 1] * y
    found = table[:, 0][:, powers[:, 0]]
    for i in range(1, 6):
        found = found * table[:, i][:, powers[:, i]]
    return np.asarray(found)


def _derived(powers: Array, axis: int) -> tuple[Array, Array]:
    """Factors (k,) and powers (k, 6) of the products' derivatives by one variable."""
    lower = powers.copy()
    lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
    return powers[:, axis].astype(float), lower


_GRADIENT = [_derived(EXPONENTS, i) for i in range(6)]
_PAIRS = list(itertools.combinations_with_replacement(range(6), 2))


def gradient_rows(y: Array) -> Array:
    """Gradients (m, 6, k) of the products of EXPONENTS at y (m, 6)."""
    return np.stack([factor * products(y, lower) for factor, lower in _GRADIENT], axis=1)


def hessian_rows(y: Array) -> Array:
    """Second derivatives (m, 21, k) of the products of EXPONENTS at y (m, 6), the upper triangle by rows."""
    found = []
    for i, j in _PAIRS:
        factor, lower = _GRADIENT[i]
        second, lowest = _derived(lower, j)
        found.append(factor * second * products(y, lowest))
    return np.stack(found, axis=1)


@attrs.frozen(eq=False)
class Joint:
    """A unit between rigid plates, reduced to W(eta; p), a potential of relative motion and pressure.

    eta (6,) is the logarithm of the tip plate's motion relative to the base's: a constant strain times the
    length. A uniform Kirchhoff-Reissner beam therefore has a quadratic W. With eta0(p) of the unloaded plate
    and y = (eta - eta0)/size, W is a polynomial of degree 2 to 4 in y. It has no terms of degree 0 and 1, so
    its force at eta0 is 0. Between pressures every number is a cubic spline (a parabola or line through three
    or two). Relative motion alone counts, so W is objective.

    pressure_kPa (k,) ascending; eta0 (k, 6); size (6,), the range in rad and mm; coefficients (k, 203) in mJ
    of the products of EXPONENTS; centre (k, 3), centre_slope (k, 3, 6) and centre_bend (k, 3, 21): centre of
    mass in mm to second order in y; mass_g; error (6, 6): mean square of the gradient's error at states held
    out of the fit, in (mJ/rad, N)^2.
    """

    name: str
    pressure_kPa: Array
    eta0: Array
    size: Array
    coefficients: Array
    centre: Array
    centre_slope: Array
    centre_bend: Array
    mass_g: float
    error: Array = attrs.field(factory=lambda: np.zeros((6, 6)))

    @cached_property
    def _packed(self) -> Any:
        from scipy.interpolate import CubicSpline, make_interp_spline

        k = len(self.pressure_kPa)
        parts = [self.eta0, self.coefficients, self.centre, self.centre_slope, self.centre_bend]
        table = np.hstack([part.reshape(k, -1) for part in parts])
        if k >= 4:
            return CubicSpline(self.pressure_kPa, table)
        return make_interp_spline(self.pressure_kPa, table, k - 1) if k > 1 else (lambda p: table[0])

    def at(self, pressure_kPa: float) -> JointAt:
        """The joint at one pressure in kPa; raises InputError beyond those it was learned at."""
        low, high = float(self.pressure_kPa[0]), float(self.pressure_kPa[-1])
        if not low - 1e-9 <= pressure_kPa <= high + 1e-9:
            raise InputError(
                f"{pressure_kPa:.6g} kPa is beyond the {low:g} to {high:g} kPa "
                f"that {self.name} was learned for",
                "pressure",
                "widen pressure_kPa of that unit, or keep within it",
            )
        row = np.asarray(self._packed(min(max(pressure_kPa, low), high)))
        cuts = np.cumsum([6, len(EXPONENTS), 3, 18])
        eta0, coefficients, centre, slope_, bend = np.split(row, cuts)
        return JointAt(eta0, self.size, coefficients, centre, slope_.reshape(3, 6), bend.reshape(3, 21))

    def rest_length_mm(self) -> float:
        """Distance in mm of the free plates at no pressure, or at the least one there is."""
        least = float(self.pressure_kPa[np.abs(self.pressure_kPa).argmin()])
        return float(np.linalg.norm(self.at(least).eta0[3:]))


@attrs.frozen(eq=False)
class JointAt:
    """A joint at one pressure; fields as in `Joint`."""

    eta0: Array
    size: Array
    coefficients: Array
    centre: Array
    centre_slope: Array
    centre_bend: Array

    def potential(self, eta: Array) -> Array:
        """W (m,) in mJ at logarithms eta (m, 6), with a wall beyond the range, for Newton's method."""
        y = (np.atleast_2d(eta) - self.eta0) / self.size
        beyond, stiffness = self._wall(y)
        return np.asarray(
            products(y, EXPONENTS) @ self.coefficients + stiffness * (beyond**3).sum(axis=1) / 3
        )

    def gradient(self, eta: Array) -> Array:
        """dW/deta (m, 6) in mJ/rad and N."""
        y = (np.atleast_2d(eta) - self.eta0) / self.size
        beyond, stiffness = self._wall(y)
        found = gradient_rows(y) @ self.coefficients + stiffness * beyond**2 * np.sign(y)
        return np.asarray(found / self.size)

    def hessian(self, eta: Array) -> Array:
        """Second derivatives of W (6, 6) at one logarithm (6,), in mJ/rad^2, N and N/mm."""
        y = (np.atleast_2d(eta) - self.eta0) / self.size
        upper = (hessian_rows(y) @ self.coefficients)[0]
        found = np.zeros((6, 6))
        for (i, j), value in zip(_PAIRS, upper, strict=True):
            found[i, j] = found[j, i] = value
        beyond, stiffness = self._wall(y)
        found[np.diag_indices(6)] += 2 * stiffness * beyond[0]
        return found / np.outer(self.size, self.size)

    def centre_of_mass(self, eta: Array) -> Array:
        """Centre of mass (m, 3) in mm in the base's frame at logarithms eta (m, 6)."""
        y = (np.atleast_2d(eta) - self.eta0) / self.size
        return np.asarray(
            self.centre + y @ self.centre_slope.T + products(y, EXPONENTS[: len(_PAIRS)]) @ self.centre_bend.T
        )

    def centre_gradient(self, eta: Array) -> Array:
        """Change (m, 3, 6) of the centre of mass with eta (m, 6): per rad in mm, and per mm."""
        y = (np.atleast_2d(eta) - self.eta0) / self.size
        bend = np.einsum("mik,jk->mji", gradient_rows(y)[:, :, : len(_PAIRS)], self.centre_bend)
        return np.asarray((self.centre_slope + bend) / self.size)

    def used_range(self, eta: Array) -> Array:
        """Largest component (m,) of eta (m, 6) against eta0 as a share of the range: 1 at its end."""
        return np.asarray(np.abs((np.atleast_2d(eta) - self.eta0) / self.size).max(axis=1))

    def _wall(self, y: Array) -> tuple[Array, float]:
        stiffness = _WALL * float(np.abs(self.coefficients[: len(_PAIRS)]).max())
        return np.maximum(np.abs(y) - MOST_RANGE, 0.0), stiffness


def fitted(states: Sequence[PlateState], free: PlateState, size: Array) -> dict[str, Array]:
    """Coefficients of a joint at one pressure, from its free state and others there.

    Least squares of every state's gradient and stiffness, and of its centre of mass and that one's slope, in
    the range's units, with mirror images; the free state's stiffness is matched exactly. Returns
    coefficients, centre, centre_slope, centre_bend as in `Joint`.
    """
    quadratic = len(_PAIRS)
    scaled = free.hessian * np.outer(size, size)
    scaled = (scaled + scaled.T) / 2
    # A product of a variable with itself has the second derivative 2.
    own = np.array([scaled[i, j] / (2 if i == j else 1) for i, j in _PAIRS])
    every = [*states, *(state.mirrored() for state in states)]
    found = np.zeros(len(EXPONENTS))
    found[:quadratic] = own
    slope_ = free.centre_slope * size
    bend = np.zeros((3, quadratic))
    if every:
        y = np.array([(state.eta - free.eta) / size for state in every])
        rows = np.concatenate([gradient_rows(y), hessian_rows(y)], axis=1)
        wanted = np.array(
            [
                np.concatenate(
                    [
                        state.gradient * size,
                        [(state.hessian * np.outer(size, size))[i, j] for i, j in _PAIRS],
                    ]
                )
                for state in every
            ]
        )
        left = (wanted - rows[:, :, :quadratic] @ own).ravel()
        matrix = rows[:, :, quadratic:].reshape(len(left), -1)
        ridge = _RIDGE * np.linalg.norm(matrix) / np.sqrt(matrix.shape[1])
        held = np.vstack([matrix, ridge * np.eye(matrix.shape[1])])
        found[quadratic:] = np.linalg.lstsq(held, np.concatenate([left, np.zeros(matrix.shape[1])]), None)[0]
        # Slopes too: states along the axes alone leave products of two variables to rounding.
        moved: Array = np.array([state.centre for state in every]) - free.centre - y @ slope_.T
        turned: Array = np.array([state.centre_slope * size for state in every]) - slope_
        of_slopes = gradient_rows(y)[:, :, :quadratic].reshape(-1, quadratic)
        bend = np.linalg.lstsq(
            np.vstack([products(y, EXPONENTS[:quadratic]), of_slopes]),
            np.vstack([moved, turned.transpose(0, 2, 1).reshape(-1, 3)]),
            1e-6,
        )[0].T
    return {"coefficients": found, "centre": free.centre, "centre_slope": slope_, "centre_bend": bend}
