"""Intervals of fitted parameters: linearised, or by the profile of the fit where the law is not linear."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np
from scipy import optimize
from scipy.special import stdtrit

from ..arrays import Array
from .law_forms import EXPONENTS, Form
from .regression import Problem, linear, nonzero_exponents

# The profile is followed until it is this close to its limit.
CLOSE = 0.02
# How far a factor is followed, as the logarithm of its ratio to the best one.
FARTHEST = 14.0


@attrs.frozen
class Parameter:
    """A fitted parameter with its 95 % interval, in the unit that its name gives.

    Bounds are nan where the data do not determine it; note says why.
    """

    name: str
    value: float
    low95: float
    high95: float
    note: str = ""


def intervals(
    problem: Problem, row: Array, residual: Array, memory: float, profile: Problem | None
) -> tuple[Parameter, ...]:
    """95 % intervals of the parameters of a fitted row (count,), from its weighted residuals (n,).

    memory: number of correlated residuals that are worth one independent value; it widens every interval by
    its square root. profile: None for linearised intervals. Else the problem, or one of fewer rows, whose
    profile likelihood bounds Ogden's parameters: the best fit with one parameter fixed becomes worse by
    Student's t.
    """
    form = problem.form
    at = [form.law.parameter_names.index(name) for name in form.names]
    free, notes = _free(form, row)
    J = problem.jacobian(row)
    # A term may be so small that its exponent changes nothing.
    silent = free & (np.linalg.norm(J, axis=0) == 0)
    notes = [
        "the data do not support this term" if s else note for s, note in zip(silent, notes, strict=True)
    ]
    free &= ~silent
    J = J[:, free]
    n, p = len(residual), int(np.sum(free))
    independent = n / memory - p
    half = np.full(form.count, np.nan)
    margin = np.nan
    if independent > 0 and p:
        # Half an interval squared, of a parameter whose column of J has length 1 and is square to the rest.
        variance = float(residual @ residual) / (n - p) * memory
        margin = variance * float(stdtrit(independent, 0.975)) ** 2
        size = np.linalg.norm(J, axis=0)
        _, s, V = np.linalg.svd(J / size, full_matrices=False)
        if s[-1] > 1e-7 * s[0]:
            half[free] = np.sqrt(margin * ((V.T / s) ** 2).sum(axis=1)) / size
        else:
            notes = [note or "not determined: another parameter compensates for it" for note in notes]
    else:
        notes = [note or "too few independent values" for note in notes]
    found = []
    for k, (name, place) in enumerate(zip(form.names, at, strict=True)):
        low, high = row[place] - half[k], row[place] + half[k]
        note = notes[k]
        if profile is not None and form.exponents and np.isfinite(half[k]):
            low, high, note = _profiled(profile, row, k, half[k], margin)
        found.append(Parameter(name, float(row[place]), float(low), float(high), note))
    return tuple(found)


def _free(form: Form, row: Array) -> tuple[Array, list[str]]:
    """Parameters away from their bounds, and a note for each that is at one."""
    free, notes = np.ones(form.count, bool), [""] * form.count
    if form.exponents:
        for p in range(form.exponents):
            if row[2 * p] == 0:
                free[2 * p : 2 * p + 2] = False
                notes[2 * p : 2 * p + 2] = ["the data do not support this term"] * 2
            elif not EXPONENTS[0] + 1e-6 < row[2 * p + 1] < EXPONENTS[1] - 1e-6:
                free[2 * p + 1] = False
                notes[2 * p + 1] = "at the bound of the search"
    else:
        for k, low in enumerate(form.least):
            if row[k] <= low:
                free[k] = False
                notes[k] = f"held at {low:g}"
    return free, notes


def _profiled(problem: Problem, row: Array, k: int, half: float, margin: float) -> tuple[float, float, str]:
    """Interval of the k-th parameter of an Ogden law: mu_p for even k, alpha_p for odd."""
    p, value = k // 2, float(row[k])
    exponents = row[1 : 2 * problem.form.exponents : 2]
    if k % 2:
        low, low_open = _end(
            _fixed_exponent(problem, exponents, p), value, half, margin, -1, value - EXPONENTS[0]
        )
        high, high_open = _end(
            _fixed_exponent(problem, exponents, p), value, half, margin, 1, EXPONENTS[1] - value
        )
        return value + low, value + high, "not bounded by the data" if low_open or high_open else ""
    # A factor keeps its sign; its logarithm makes the profile nearly even.
    size = min(half / abs(value), 1.0)
    ends = []
    for side in (-1, 1):
        fixed = _fixed_factor(problem, exponents, p, value)
        ends.append(_end(fixed, 0.0, size, margin, side, FARTHEST))
    low, high = sorted(value * np.exp(step) for step, _ in ends)
    if not ends[0][1] and not ends[1][1]:
        return low, high, ""
    note = "0 is not excluded" if ends[0][1] else "not bounded by the data"
    return (min(low, 0.0), high, note) if value > 0 else (low, max(high, 0.0), note)


def _end(
    fixed: Callable[[float], float], value: float, half: float, margin: float, side: int, farthest: float
) -> tuple[float, bool]:
    """Distance from a parameter's value at which the sum of squares has grown by `margin`.

    fixed: least sum of squares at a value; half: a guess. Returns the step, and True if it reached
    `farthest`.
    """
    best = fixed(value)
    inside, outside = 0.0, np.inf
    step = min(half, 0.9 * farthest)
    for _ in range(25):
        # Near the best fit it grows with the square of the step.
        ratio = np.sqrt(max(fixed(value + side * step) - best, 0.0) / margin)
        if abs(ratio - 1) < CLOSE:
            break
        if ratio < 1:
            inside = step
            if step >= farthest:
                return side * farthest, True
        else:
            outside = step
        guess = step / ratio if ratio > 0.3 else 3 * step
        if not inside < guess < outside:
            guess = (inside + outside) / 2 if np.isfinite(outside) else 3 * step
        step = min(guess, farthest)
    return side * step, False


def _fixed_exponent(problem: Problem, exponents: Array, p: int) -> Callable[[float], float]:
    """Least sum of squares with the p-th exponent fixed, by that exponent."""
    last = np.delete(exponents, p)

    def least(value: float) -> float:
        nonlocal last

        def residual(others: Array) -> Array:
            return problem.solve(nonzero_exponents(np.insert(others, p, value)))[1]

        if not len(last):
            r = residual(last)
            return float(r @ r)
        result = optimize.least_squares(residual, last, bounds=EXPONENTS, xtol=1e-8, ftol=1e-10, max_nfev=60)
        last = result.x
        return float(2 * result.cost)

    return least


def _fixed_factor(problem: Problem, exponents: Array, p: int, mu: float) -> Callable[[float], float]:
    """Least sum of squares with the p-th mu fixed, by the logarithm of its ratio to `mu`."""
    last = np.array(exponents)
    # c_p = mu_p alpha_p/2 is not negative, so the exponent keeps the sign of mu.
    low, high = np.full(len(last), EXPONENTS[0]), np.full(len(last), EXPONENTS[1])
    low[p], high[p] = (1e-3, EXPONENTS[1]) if mu > 0 else (EXPONENTS[0], -1e-3)
    others = np.arange(len(last)) != p

    def least(ratio: float) -> float:
        nonlocal last

        def residual(a: Array) -> Array:
            terms = problem.terms(nonzero_exponents(a))
            own = terms[:, p] * (mu * np.exp(ratio) * a[p] / 2)
            if not others.any():
                return own - problem.target
            return linear(terms[:, others], problem.target - own, (0.0,) * int(others.sum()))[1]

        result = optimize.least_squares(
            residual, last, bounds=(low, high), xtol=1e-8, ftol=1e-10, max_nfev=60
        )
        last = result.x
        return float(2 * result.cost)

    return least
