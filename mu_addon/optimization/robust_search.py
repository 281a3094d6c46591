"""The search for the units of a design: by their values, or robustly by those expected on a finer mesh."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from .design_file import Design
from .evaluation import Evaluated
from .search import Found, Observed, Search, Values
from .uncertainty import SURE

Simulation = tuple[Values, float, bool]
"""Values of the freedoms, refinement of the mesh, and whether slopes are asked for."""
Course = Generator[list[Simulation], Sequence[Evaluated], Found]

FIRST_PART = 0.6
"""Share of a robust search's evaluations before the finer mesh's change at its best unit is computed."""
LARGEST_CHANGE = 0.5
"""Largest share by which a finer mesh is assumed to change a value."""


def unit_search(design: Design, batch: int) -> Course:
    """Generator of the units to simulate next, that is sent their results; its value is what was found.

    batch: units at a time. A robust search goes by the values expected on the finer mesh: by the change of
    the start, then by that of the best unit.
    """
    search = attrs.evolve(design.search, batch=max(batch, design.search.batch))
    rows: list[tuple[Values, Evaluated]] = []
    if not design.robust:
        return (yield from _course(design, search, rows, None))
    change = yield from _change_by_mesh(design, design.start)
    part = attrs.evolve(search, evaluations=max(1, round(FIRST_PART * search.evaluations)))
    found = yield from _course(design, part, rows, change)
    best = found.observed[found.proposed[len(found.proposed) // 2]]
    if best.sound:
        change = yield from _change_by_mesh(design, best.design)
    return (yield from _course(design, search, rows, change))


def _course(
    design: Design, search: Any, rows: list[tuple[Values, Evaluated]], change: Array | None
) -> Course:
    """A search from the rows known so far, to which it adds; change (q,): by the finer mesh, as a share."""
    known = [observed(*row, change) for row in rows]
    steps = Search(design.freedoms, design.targets, search).steps(design.start, known)
    answer: list[Observed] | None = None
    while True:
        try:
            asked = steps.send(answer)  # type: ignore[arg-type]
        except StopIteration as end:
            found: Found = end.value
            return found
        results = yield [(values, design.settings.refine, True) for values in asked]
        new = list(zip(asked, results, strict=True))
        rows += new
        answer = [observed(*row, change) for row in new]


def _change_by_mesh(
    design: Design, values: Values
) -> Generator[list[Simulation], Sequence[Evaluated], Array]:
    """Share (q,) by which each value changes from the search's mesh to the finer one; 0 where it fails."""
    coarse, fine = yield [(values, design.settings.refine, True), (values, design.check_refine, False)]
    change = fine.values - coarse.values
    share = np.divide(change, coarse.values, out=np.zeros_like(change), where=coarse.values != 0)
    return np.clip(np.nan_to_num(share), -LARGEST_CHANGE, LARGEST_CHANGE)


def observed(values: Values, found: Evaluated, change: Array | None) -> Observed:
    """A simulated unit as input of the search; with `change`, as expected on the finer mesh."""
    if change is None or not found.sound:
        return Observed(values, found.values, found.gradient, found.sound)
    by_mesh, factor = change * found.values, 1.0 + change
    error = np.sqrt(by_mesh**2 + found.by_print**2 + found.by_resin**2)
    slopes = factor[:, None] * found.gradient
    return Observed(values, factor * found.values, slopes, found.sound, SURE * np.nan_to_num(error))
