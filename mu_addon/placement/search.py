"""Search for the best of many paths: all are ranked by a cheap prediction, the best checked exactly."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array, pareto
from ..errors import InputError

# Paths checked at first; of these taken from all predictions, so that their error is known there too; then at
# a time. The risk left at the end: a probability, see `probability_of_better`.
FIRST, _SPREAD, _BATCH, _RISK = 12, 4, 4, 0.05


@attrs.frozen(eq=False)
class Search:
    """A search's outcome over n paths: predicted and exact J_hat (n,) in mm, and the number of the best path.

    exact_mm is NaN where unchecked. risk: probability that an unchecked path beats the best, as
    `probability_of_better` has it; complete: True if every path was checked or the risk is as small as asked
    for; left_out (k,): numbers of paths that turned out impossible.
    """

    predicted_mm: Array
    exact_mm: Array
    best: int
    risk: float
    complete: bool
    left_out: Array

    @property
    def checked(self) -> Array:
        """Numbers (k,) of the paths that were checked, by ascending exact J_hat."""
        order = np.argsort(self.exact_mm)
        return order[: np.count_nonzero(np.isfinite(self.exact_mm))]


def probability_of_better(predicted_mm: Array, exact_mm: Array) -> float:
    """Upper bound of the probability that some unchecked path beats the best checked one.

    predicted_mm, exact_mm (n,): J_hat of every path, exact NaN where unchecked. The logarithm of exact over
    predicted is taken as normal with the checked paths' mean and variance; Student's t gives the probability
    for each unchecked path, and their sum bounds that for any. This is an estimate, not a proof: it assumes
    that predictions of unchecked paths err as those of checked ones do.
    """
    from scipy.stats import t

    known = np.isfinite(exact_mm)
    if known.all():
        return 0.0
    error = np.log(exact_mm[known] / predicted_mm[known])
    n = len(error)
    spread = error.std(ddof=1) * np.sqrt(1 + 1 / n)
    needed = np.log(exact_mm[known].min() / predicted_mm[~known]) - error.mean()
    if spread == 0:
        return float((needed > 0).any())
    return float(min(t.cdf(needed / spread, n - 1).sum(), 1.0))


def searching(
    predicted_mm: Array, most: int = 100, J_mm: Callable[[Any], float] = float
) -> Generator[list[int], Sequence[Any], Search]:
    """Yield numbers of paths to solve, get the solution of each, and return the search.

    predicted_mm (n,): positive predictions of J_hat; most: paths to solve. J_mm: of a solution, its exact
    J_hat in mm, NaN of a path that is impossible and left out. Raises InputError where a prediction is not
    positive or no path is possible.
    """
    predicted_mm = np.asarray(predicted_mm, float)
    if not len(predicted_mm) or not (predicted_mm > 0).all():
        raise InputError("there is no path, or one with a predicted deviation of zero", "search")
    order = np.argsort(predicted_mm, kind="stable")
    across = np.linspace(0, len(order) - 1, _SPREAD + 2).astype(int)[1:-1]
    # Two at least, or there is no error to speak of.
    now = np.unique(np.append(order[: max(FIRST - _SPREAD, 2)], order[across]))
    exact = np.full(len(order), np.nan)
    possible = np.ones(len(order), bool)
    while True:
        exact[now] = [J_mm(one) for one in (yield now.tolist())]
        possible[now] = np.isfinite(exact[now])
        checked = int(np.isfinite(exact).sum())
        left = order[np.isnan(exact[order]) & possible[order]]
        # An error has no spread below two.
        if checked >= 2 or not len(left):
            if not checked:
                raise InputError("none of the paths is possible", "search", "allow other paths")
            risk = probability_of_better(predicted_mm[possible], exact[possible])
            if risk <= _RISK or checked >= most:
                out = np.flatnonzero(~possible)
                return Search(predicted_mm, exact, int(np.nanargmin(exact)), risk, risk <= _RISK, out)
        now = left[: min(_BATCH, most - checked)]


def front(length: Array, deviation_mm: Array) -> Array:
    """Numbers (k,) of the paths that are Pareto-optimal in length (longer is better) and deviation.

    length (n,) in cells or mm; deviation_mm (n,), NaN where unknown: such paths are left out. Ascending in
    length.

    >>> front(np.array([2.0, 3.0, 4.0]), np.array([0.2, 0.1, 0.4])).tolist()
    [1, 2]
    """
    found = pareto(np.column_stack([-length, deviation_mm]))
    return found[np.argsort(length[found], kind="stable")]
