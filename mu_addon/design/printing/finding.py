"""Findings of the printability check: a value, its limit, its locations, and its severity."""

from __future__ import annotations

from typing import Any, Literal

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import connected
from .printer import Limit, Printer

Severity = Literal["error", "warning", "pass", "info"]
Points = NDArray[np.float64]

NOWHERE: Points = np.empty((0, 3))
MOST_PLACES = 50
"""Number of places kept of one finding; its `count` is the total."""


@attrs.frozen(eq=False)
class Finding:
    """One check's outcome: `error` must not be printed, `warning` needs a decision, `info` has no limit.

    value and limit are in `unit`; places (n, 3) are in mm in the frame of the surface, the worst first.
    """

    check: str
    severity: Severity
    what: str
    value: float
    limit: float | None = None
    unit: str = ""
    places: Points = NOWHERE
    count: int = 0
    source: str = ""
    assumed: bool = False
    remedy: str = ""

    @property
    def is_fault(self) -> bool:
        """True if something must be done: severity `error` or `warning`."""
        return self.severity in ("error", "warning")

    def plain(self) -> dict[str, Any]:
        """Its fields by name, for a file; arrays stay arrays."""
        return attrs.asdict(self)


def clustered(points: Points, badness: NDArray[np.float64] | None = None, reach: float = 1.0) -> Points:
    """One place (k, 3) in mm for each group of points (n, 3) in mm within about `reach` mm of each other.

    It is the group's point of the greatest badness (n,), the group of the worst first; or, without badness,
    its mean, the largest group first.
    """
    from scipy.spatial import cKDTree

    if not len(points):
        return NOWHERE
    # Points in one small box are near one another: linking boxes keeps the pairs few.
    box = np.unique(np.floor(points / (reach / 2.0)).astype(np.int64), axis=0, return_inverse=True)
    cells, index = box[0], np.ravel(box[1])
    pairs = cKDTree(cells * (reach / 2.0)).query_pairs(reach, output_type="ndarray")
    group = connected(len(cells), *pairs.T)[index]
    size = np.bincount(group)
    if badness is None:
        middle = [np.bincount(group, points[:, k]) / size for k in range(3)]
        return np.stack(middle, axis=1)[np.argsort(-size, kind="stable")]
    order = np.lexsort((-badness, group))
    first = order[np.searchsorted(group[order], np.arange(len(size)))]
    return points[first[np.argsort(-badness[first], kind="stable")]]


def judged(
    check: str,
    bad: bool,
    severity: Severity,
    what: str,
    value: float,
    limit: Limit,
    places: Points = NOWHERE,
    remedy: str = "",
    unit: str = "mm",
    shown: Points = NOWHERE,
) -> Finding:
    """Finding of `severity` at its places (k, 3) in mm if bad, with the remedy; else `pass`.

    shown (n, 3): the places of one that passes.
    """
    return Finding(
        check,
        severity if bad else "pass",
        what,
        value,
        limit.value,
        unit,
        (places if bad else shown)[:MOST_PLACES],
        max(1, len(places)) if bad else 0,
        limit.source,
        limit.assumed,
        remedy if bad else "",
    )


def none_of(name: str, number: int, places: Points, what: tuple[str, str], remedy: str) -> Finding:
    """Finding on faults that must not occur: `error` for any number of them, else `pass`.

    places (k, 3) in mm; what: the text for one fault and for several, which follows their number.
    """
    none = Limit(0.0, "a printable surface has none", False)
    return judged(name, number > 0, "error", counted(number, *what), float(number), none, places, remedy, "")


def at_least(
    name: str,
    value: float,
    printer: Printer,
    key: str,
    what: str,
    severity: Severity,
    places: Points = NOWHERE,
    remedy: str = "",
) -> Finding:
    """Finding on a value in mm that must reach the printer's limit `key`: `severity` if below, else `pass`.

    what: the text; places (k, 3) in mm; remedy: what to do, shown only if the value is below the limit.
    """
    limit = printer.limits[key]
    return judged(name, value < limit.value, severity, what, value, limit, places, remedy)


def counted(number: int, one: str, several: str) -> str:
    """The number with the fitting text: `1 triangle lies on another`, `3 triangles lie on others`."""
    return f"{number} {one if number == 1 else several}"
