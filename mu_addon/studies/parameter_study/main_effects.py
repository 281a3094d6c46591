"""First-order effects of a parameter study's inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ...arrays import Array

# Points that share one value of an input, or one of so many parts of its range.
MOST_LEVELS = 8


@attrs.frozen(eq=False)
class Effect:
    """Mean figure (b,) and its standard error (b,) by groups of an input's values.

    places (b,): mean values of a numeric input; labels: texts of another input. share: of the figure's
    variance that the groups explain, corrected for their number, 0 .. 1; nan if undetermined.
    """

    places: Array
    labels: tuple[str, ...]
    mean: Array
    error: Array
    share: float


def main_effect(values: Sequence[Any], figure: Array) -> Effect:
    """Dependence of a figure (n,) on one input alone, averaged over the others."""
    numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    groups, labels = _groups(values, numeric)
    mean = np.array([figure[g].mean() for g in groups])
    error = np.array([figure[g].std(ddof=1) / np.sqrt(len(g)) if len(g) > 1 else np.nan for g in groups])
    places = (
        np.array([np.mean([values[i] for i in g]) for g in groups])
        if numeric
        else np.arange(float(len(groups)))
    )
    return Effect(places, () if numeric else labels, mean, error, _explained(groups, figure))


def _groups(values: Sequence[Any], numeric: bool) -> tuple[list[Array], tuple[str, ...]]:
    if numeric:
        x = np.array(values, dtype=float)
        distinct = np.unique(x)
        if len(distinct) <= MOST_LEVELS:
            return [np.flatnonzero(x == v) for v in distinct], ()
        # Equal numbers of points, so that no mean hangs on one of them; at least three in each.
        count = max(2, min(MOST_LEVELS, len(x) // 3))
        return [np.asarray(g) for g in np.array_split(np.argsort(x, kind="stable"), count)], ()
    texts = np.array([str(v) for v in values])
    labels = tuple(dict.fromkeys(texts.tolist()))
    return [np.flatnonzero(texts == label) for label in labels], labels


def _explained(groups: Sequence[Array], figure: Array) -> float:
    """Share of the variance between groups, corrected for chance: epsilon squared (Kelley 1935)."""
    n, k = len(figure), len(groups)
    whole = float(((figure - figure.mean()) ** 2).sum())
    if n <= k or whole <= 0 or k < 2:
        return float("nan")
    within = sum(float(((figure[g] - figure[g].mean()) ** 2).sum()) for g in groups)
    return max(0.0, 1.0 - (within / (n - k)) / (whole / (n - 1)))
