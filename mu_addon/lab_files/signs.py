"""Signs of the columns of a load, decided by their whole course instead of their largest value."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

LOADS = ("strain", "displacement_mm", "stress_kPa", "force_N")
# A jump is a step above this multiple of the usual one and this share of the range, in one column alone.
_JUMP_USUAL, _JUMP_RANGE = 10.0, 0.1
# Rows within which a jump of another column belongs to the same event of the test.
_TOGETHER = 2
# Share of the values at either end that does not count, and mean over range that decides the direction.
_TAIL, _DECISIVE = 0.02, 0.1


def turned(columns: Mapping[str, Array], compression: bool) -> tuple[str, ...]:
    """Names of the columns (n,) whose sign is to be turned.

    compression: a block, positive where it is pressed. Else a coupon, whose stretch and load have one sign:
    all stay where all are negative, in a compression test.
    """
    courses = {name: _course(columns, name) for name in LOADS if name in columns}
    ways = {name: _way(course) for name, course in courses.items()}
    known = [name for name, way in ways.items() if way]
    # Of a cycle about zero the direction is that of the column which it follows.
    first = known[-1] if known else next(reversed(courses), "")
    for name in courses:
        if not ways[name] and name != first:
            along = float(np.dot(_centred(courses[name]), _centred(courses[first])))
            ways[name] = (ways[first] or 1) * int(np.sign(along))
    negative = tuple(name for name, way in ways.items() if way < 0)
    return negative if compression or len(negative) < len(ways) else ()


def jumps(columns: Mapping[str, Array], name: str) -> Array:
    """Rows (k,) of a load's column before which it jumps while the others go on."""
    others = [np.flatnonzero(_steep(columns[c])) for c in LOADS if c in columns and c != name]
    own = np.flatnonzero(_steep(columns[name]))
    apart = np.abs(own[:, None] - np.concatenate([*others, []])).min(axis=1, initial=np.inf)
    return own[apart > _TOGETHER] + 1


def _steep(values: Array) -> Array:
    """Mask (n - 1,) of the steps that are jumps."""
    step = np.abs(np.diff(values))
    usual = float(np.median(step[step > 0])) if (step > 0).any() else 0.0
    return step > max(_JUMP_USUAL * usual, _JUMP_RANGE * float(np.ptp(values)))


def _course(columns: Mapping[str, Array], name: str) -> Array:
    """Values (n,) from the first on, without jumps and without the largest and smallest."""
    step = np.diff(columns[name])
    step[jumps(columns, name) - 1] = 0.0
    course = np.concatenate([[0.0], np.cumsum(step)])
    return np.clip(course, *np.quantile(course, [_TAIL, 1.0 - _TAIL]))


def _way(course: Array) -> int:
    """1 or -1 for the direction in which a course goes for most of the record, 0 if in neither."""
    mean, extent = float(course.mean()), float(np.ptp(course))
    return int(np.sign(mean)) if abs(mean) > _DECISIVE * extent else 0


def _centred(course: Array) -> Array:
    return course - course.mean()
