"""Agreement of a column with the paper's, and which of the paper's statements a table supports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from mu_addon.report.results import Path

Array = np.ndarray[Any, Any]

HELD, NOT_HELD, UNDECIDED = "held", "not held", "undecided"


@attrs.frozen
class Agreement:
    """One column against the paper's.

    spearman: rank correlation of the ten paths. magnitude: geometric mean of ours over theirs. chosen: the
    path of least J_hat, ours and theirs; tied: ours that the mesh does not tell from it.
    """

    spearman: float
    magnitude: float
    chosen: str
    theirs: str
    tied: tuple[str, ...] = ()

    @property
    def same_choice(self) -> bool:
        """Whether the paper's path is ours, or tied with ours."""
        return self.theirs == self.chosen or self.theirs in self.tied


def agreement(ours: Array, theirs: Array, paths: Sequence[Path], coarser: Array | None = None) -> Agreement:
    """Compare two columns (paths,) in mm; `coarser` is ours on a coarser mesh.

    A path is tied with the best where what it disturbs more is less than what the mesh makes of that.
    """
    best = int(np.argmin(ours))
    tied = []
    for i in range(len(ours)):
        if i != best and coarser is not None and _unclear(ours[i] - ours[best], coarser[i] - coarser[best]):
            tied.append(paths[i].name)
    return Agreement(
        float(spearman(ours, theirs)),
        float(np.exp(np.log(ours / theirs).mean())),
        paths[best].name,
        paths[int(np.argmin(theirs))].name,
        tuple(tied),
    )


def _unclear(margin: float, coarser: float) -> bool:
    """Whether a difference is smaller than its own change by the mesh."""
    return abs(margin) < abs(margin - coarser)


def spearman(one: Array, other: Array) -> Any:
    """Spearman's rank correlation of two columns (..., n), equal values sharing their mean rank."""
    from scipy.stats import rankdata

    ranks = [rankdata(column, axis=-1) for column in (one, other)]
    x, y = (r - r.mean(axis=-1, keepdims=True) for r in ranks)
    return (x * y).sum(axis=-1) / np.sqrt((x * x).sum(axis=-1) * (y * y).sum(axis=-1))


@attrs.frozen
class Statement:
    """One of the paper's statements, whether it holds, and the numbers that say so."""

    text: str
    verdict: str
    numbers: str


@attrs.frozen
class _Comparison:
    """That one figure should be larger than another: by how many mm it is, on either mesh, and its words."""

    margin: float
    coarser: float | None
    words: str

    @property
    def verdict(self) -> str:
        if self.coarser is not None and _unclear(self.margin, self.coarser):
            return UNDECIDED
        return HELD if self.margin > 0 else NOT_HELD


def statements(
    table: Mapping[str, Array], coarser: Mapping[str, Array], paths: Sequence[Path]
) -> list[Statement]:
    """The paper's statements of Table I, judged in a table of columns (paths,) in mm by name.

    coarser: the columns on a coarser mesh, as far as there are. A statement of several comparisons does not
    hold where one of them fails beyond the mesh's doubt, and holds where all hold.
    """
    found = []
    for name, J in table.items():
        other = coarser.get(name)
        text = f"{name}: of paths of equal length, the distal one deviates least"
        found.append(_judged(text, _distal(J, other, paths)))
        text = f"{name}: a path deviates more than any path contained in it"
        found.append(_judged(text, _longer(J, other, paths)))
    scales = sorted((name for name in table if name.endswith("x")), key=lambda name: float(name[:-1]))
    for smaller in scales[:-1]:
        text = f"{scales[-1]} deviates less than {smaller}"
        found.append(_judged(text, [_less(table, coarser, scales[-1], smaller)]))
    return found


def _judged(text: str, comparisons: Sequence[_Comparison]) -> Statement:
    verdicts = [c.verdict for c in comparisons]
    verdict = next((v for v in (NOT_HELD, UNDECIDED) if v in verdicts), HELD)
    closest = min(comparisons, key=lambda c: c.margin)
    counted = f"{verdicts.count(HELD)} of {len(verdicts)} hold; closest: " if len(verdicts) > 1 else ""
    return Statement(text, verdict, counted + closest.words)


def _compared(J: Array, other: Array | None, paths: Sequence[Path], more: int, less: int) -> _Comparison:
    coarser = None if other is None else float(other[more] - other[less])
    words = f"{paths[more].name} {J[more]:.3f}, {paths[less].name} {J[less]:.3f} mm"
    return _Comparison(float(J[more] - J[less]), coarser, words)


def _distal(J: Array, other: Array | None, paths: Sequence[Path]) -> list[_Comparison]:
    """Of paths of one length, the one farthest from the inlet against each of the others."""
    found = []
    for length in sorted({p.length for p in paths}):
        same = [i for i, p in enumerate(paths) if p.length == length]
        distal = max(same, key=lambda i: paths[i].start)
        found += [_compared(J, other, paths, i, distal) for i in same if i != distal]
    return found


def _longer(J: Array, other: Array | None, paths: Sequence[Path]) -> list[_Comparison]:
    """Every path against every one that it holds."""
    return [
        _compared(J, other, paths, i, k)
        for i, a in enumerate(paths)
        for k, b in enumerate(paths)
        if a.length > b.length and a.start <= b.start and a.start + a.length >= b.start + b.length
    ]


def _less(table: Mapping[str, Array], coarser: Mapping[str, Array], least: str, smaller: str) -> _Comparison:
    """Means of all paths of two scales."""
    margin = float(table[smaller].mean() - table[least].mean())
    known = smaller in coarser and least in coarser
    other = float(coarser[smaller].mean() - coarser[least].mean()) if known else None
    words = f"mean of all paths {table[least].mean():.3f} against {table[smaller].mean():.3f} mm"
    return _Comparison(margin, other, words)
