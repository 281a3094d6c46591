"""Result of an optimisation in sentences: targets met, obstacles, changes and reasons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Array
from .freedoms import Freedom
from .robustness import Verified
from .search import Found, Observed
from .targets import Target


def outcome(found: Found, targets: Sequence[Target]) -> str:
    """The outcome in a sentence or two."""
    count = len(found.observed)
    if found.feasible:
        if len(found.proposed) > 1:
            return f"{len(found.proposed)} units meet every target, of {count} computed."
        return f"A unit that meets every target was found; {count} were computed."
    best = found.observed[found.proposed[0]]
    if not best.sound:
        return f"None of {count} units could be simulated: widen the freedoms, or lower the pressures."
    judged = [t for t in targets if t.quantity is not None]
    margins = np.zeros_like(best.values) if best.margins is None else best.margins
    missed = [
        f"{t.name} is {v:.4g}{f' ± {margin:.2g}' if margin else ''} instead of {t.words}"
        for t, v, margin in zip(judged, best.values, margins, strict=True)
        if not t.met(v, margin)
    ]
    words = f"No unit of {count} meets every target. The nearest misses: {'; '.join(missed)}."
    if found.in_the_way:
        words += f" Without {' or '.join(found.in_the_way)} the others can be met."
    elif len(missed) > 1:
        words += " No single target is the obstacle: leaving out any one of them is not enough."
    return words


def verdict(checked: Sequence[Verified]) -> str:
    """Result of the proposed units on a finer mesh and in the print check, in a sentence; "" without any."""
    if not checked:
        return ""
    met = sum(bool(c.met.all()) and not c.why for c in checked)
    robust = sum(c.is_robust for c in checked)
    printed = sum(c.print_worst == "error" for c in checked)
    words = f"Met in full on a finer mesh: {met} of {len(checked)} proposed, robustly {robust}."
    return words + (f" The print check refuses {printed}." if printed else "")


def changes(freedoms: Sequence[Freedom], start: Sequence[Any], design: Sequence[Any]) -> list[str]:
    """Each freedom that changed, as text, the largest change over its range first."""

    def size(i: int) -> float:
        f = freedoms[i]
        return 1.0 if f.discrete else abs(f.place(float(design[i])) - f.place(float(start[i])))

    changed = [i for i in range(len(freedoms)) if design[i] != start[i]]
    return [
        f"{freedoms[i].name}: {shown(start[i])} to {shown(design[i])} {freedoms[i].unit}".rstrip()
        + _at_bound(freedoms[i], design[i])
        for i in sorted(changed, key=size, reverse=True)
    ]


def reasons(
    freedoms: Sequence[Freedom], targets: Sequence[Target], observed: Observed, start: Sequence[Any]
) -> list[str]:
    """For each target the freedoms that moved it most from the start, by the slopes at the end."""
    continuous = [i for i, f in enumerate(freedoms) if not f.discrete]
    judged = [t for t in targets if t.quantity is not None]
    found = []
    for row, target in zip(observed.slopes, judged, strict=True):
        if not np.isfinite(row).all() or not len(row):
            continue
        moves = np.array([float(observed.design[i]) - float(start[i]) for i in continuous]) * row
        order = np.argsort(-np.abs(moves))[:2]
        parts = [
            f"{freedoms[continuous[k]].name} by {moves[k]:+.3g} {target.unit}".rstrip()
            for k in order
            if abs(moves[k]) > 1e-3 * (np.abs(moves).max() or 1.0) and moves[k]
        ]
        if parts:
            found.append(f"{target.name}: {', '.join(parts)}")
    return found


def sensitivities(freedoms: Sequence[Freedom], observed: Observed) -> Array:
    """Slopes (q, c) times a tenth of each continuous freedom's range."""
    widths = np.array([f.high - f.low for f in freedoms if not f.discrete])
    return np.asarray(0.1 * widths * observed.slopes)


def _at_bound(freedom: Freedom, value: Any) -> str:
    if freedom.discrete:
        return ""
    place = freedom.place(float(value))
    return " (its lower bound)" if place < 1e-3 else " (its upper bound)" if place > 1 - 1e-3 else ""


def shown(value: Any) -> str:
    """A freedom's value in a text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
