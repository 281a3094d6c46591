"""Zero and sign of a load's columns, decided by their whole course instead of their largest value."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from ..arrays import Array
from .decisions import kept_by
from .kind import LOADED
from .proposal import Proposal

_LOADS = ("strain", "displacement_mm", "stress_kPa", "force_N")
# A jump is a step above this multiple of the usual one and this share of the range, in one column alone.
_JUMP_USUAL, _JUMP_RANGE = 10.0, 0.1
# Rows within which a jump of another column is of the same event, and one back of a spike.
_TOGETHER, _SPIKE = 2, 3
# Rows, and usual steps, that a column has moved where a jump ends the part that counts.
_MOVED = 5
# A displacement that begins farther from zero than this share of its range is a place of the machine.
_OFFSET = 0.02
# Jumps of a column that are named at most.
_MOST_JUMPS = 3
# Mean over range that decides the direction.
_DECISIVE = 0.1


def with_zero(draft: Proposal) -> Proposal:
    """Shift a displacement that begins at a position of the machine to begin at zero."""
    found = draft.columns.get("displacement_mm")
    if found is None or draft.choice("zero", ("as_read",)):
        return draft
    first = float(found[0])
    if abs(first) <= _OFFSET * float(np.ptp(found)):
        return draft
    return draft.with_column("displacement_mm", found - first).concluding(
        f"displacement_mm: minus its first value, {first:g} mm, the machine's position {kept_by('zero')}"
    )


def with_signs(draft: Proposal) -> Proposal:
    """The loads with their signs; jumps of one column alone are named."""
    loads = {name: draft.columns[name] for name in _LOADS if name in draft.table}
    if draft.kind not in LOADED or not loads:
        return draft
    for name, values in loads.items():
        for row in _jumps(loads, name)[:_MOST_JUMPS]:
            words = f"jumps by {values[row] - values[row - 1]:.4g} at line {draft.lines[row]}"
            draft = draft.concluding(f"{name}: {words} while the test goes on; check it")
    pressed = draft.kind == "lattice_compression"
    found = () if draft.choice("sign", ("as_read",)) else _turned(loads, pressed)
    for name in found:
        draft = draft.with_column(name, 0.0 - loads[name]).concluding(
            f"{name}: sign turned, positive in {'compression' if pressed else 'tension'} {kept_by('sign')}"
        )
    if not pressed and not found and all(np.mean(values) < 0 for values in loads.values()):
        draft = draft.concluding("force and displacement are negative: read as compression of the coupon")
    return draft


def _turned(loads: Mapping[str, Array], compression: bool) -> tuple[str, ...]:
    """Names of the loads (n,) whose sign is to be turned.

    compression: a block, positive where it is pressed. Else a coupon, whose stretch and load have one sign:
    all stay where all are negative, in a compression test.
    """
    courses = {name: _course(loads, name) for name in loads}
    ways = {name: _way(course) for name, course in courses.items()}
    known = [name for name, way in ways.items() if way]
    # Of a cycle about zero the direction is that of the column which it follows.
    first = known[-1] if known else next(reversed(courses), "")
    for name in courses:
        if not ways[name] and name != first:
            rows = min(len(courses[name]), len(courses[first]))
            along = np.cov(courses[name][:rows], courses[first][:rows])[0, 1] if rows > 1 else 0.0
            ways[name] = (ways[first] or 1) * int(np.sign(along))
    negative = tuple(name for name, way in ways.items() if way < 0)
    return negative if compression or len(negative) < len(ways) else ()


def _jumps(loads: Mapping[str, Array], name: str) -> Array:
    """Rows (k,) of a load before which it jumps while the others go on."""
    others = [np.flatnonzero(_steep(values)) for other, values in loads.items() if other != name]
    own = np.flatnonzero(_steep(loads[name]))
    apart = np.abs(own[:, None] - np.concatenate([*others, []])).min(axis=1, initial=np.inf)
    return own[apart > _TOGETHER] + 1


def _steep(values: Array) -> Array:
    """Mask (n - 1,) of the steps that are jumps."""
    step = np.abs(np.diff(values))
    if not len(step):
        return np.zeros(0, bool)
    return step > max(_JUMP_USUAL * float(np.median(step)), _JUMP_RANGE * float(np.ptp(values)))


def _course(loads: Mapping[str, Array], name: str) -> Array:
    """Values (m,) less the first and without spikes, up to the first jump after which nothing can be said."""
    course = np.asarray(loads[name] - loads[name][0], float)
    rows = [int(row) for row in _jumps(loads, name)]
    for begin, end in itertools.pairwise(rows):
        back = abs(course[end] - course[begin - 1])
        if end - begin <= _SPIKE and back < 0.5 * abs(course[begin] - course[begin - 1]):
            course[begin:end] = course[begin - 1]
    for row in rows:
        before = course[:row]
        usual = float(np.median(np.abs(np.diff(before)))) if row > 1 else 0.0
        if row >= _MOVED and _steep(course)[row - 1] and abs(before[-1]) > _MOVED * usual > 0.0:
            return before
    return course


def _way(course: Array) -> int:
    """1 or -1 for the direction in which a course goes for most of the record, 0 if in neither."""
    mean, extent = float(course.mean()), float(np.ptp(course))
    return int(np.sign(mean)) if abs(mean) > _DECISIVE * extent else 0
