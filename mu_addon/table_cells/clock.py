"""Times of day and dates in the cells of a column, as seconds from the first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import attrs
import numpy as np

from ..arrays import Array

_DAY = 86400.0
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATE = (
    r"(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})"
    r"|(?P<a>\d{1,2})[-/.](?P<b>\d{1,2})[-/.](?P<c>\d{4}|\d\d)\.?"
    r"|(?P<dd>\d{1,2})[- ](?P<mon>[A-Za-z]{3})[a-z]*[- ](?P<yy>\d{4})"
)
_TIME = (
    r"(?P<h>\d{1,3}):(?P<min>\d\d)(?::(?P<s>\d\d)(?:[.,:](?P<f>\d+))?|(?P<mf>[.,]\d+))?"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?"
)
_CLOCK = re.compile(rf"(?:{_DATE})?(?:(?:^|[T,]? ?)(?:{_TIME}))?(?: ?(?:Z|UTC|[+-]\d\d:?\d\d))?")


@attrs.frozen(eq=False)
class Clock:
    """Seconds (n,) from the first reading, nan where a cell holds none.

    dated, timed: the cells hold dates, times of day; halves: these have two parts, which may be hours and
    minutes (so read) or minutes and seconds; unreadable: mask of cells that are neither clock nor empty.
    """

    seconds: Array
    dated: bool
    timed: bool
    halves: bool
    unreadable: tuple[int, ...]


def is_clock(cell: str) -> bool:
    """Return True if a cell holds a date, a time of day, or both."""
    return bool(cell) and cell[0].isdigit() and _CLOCK.fullmatch(cell) is not None


def clock(cells: Sequence[str]) -> Clock:
    """The seconds of a column of dates and times of day; one without dates may pass midnight."""
    found = [_CLOCK.fullmatch(cell) if cell else None for cell in cells]
    matches = [match for match in found if match and (match["h"] or _dated(match))]
    month_first = any(int(match["b"] or 0) > 12 for match in matches)
    seconds = np.array([_seconds(match, month_first) if match else np.nan for match in found])
    dated, timed = any(map(_dated, matches)), any(match["h"] for match in matches)
    known = np.flatnonzero(np.isfinite(seconds))
    if len(known):
        if not dated:
            drops = np.diff(seconds[known]) < -_DAY / 2
            seconds[known] += _DAY * np.concatenate([[0], np.cumsum(drops)])
        # Dates are days since year 1: what is left of their seconds has a microsecond's precision.
        seconds = np.round(seconds - seconds[known[0]], 6)
    unreadable = tuple(i for i, cell in enumerate(cells) if cell and not np.isfinite(seconds[i]))
    halves = timed and not any(match["s"] or match["mf"] or match["half"] for match in matches)
    return Clock(seconds, dated, timed, halves, unreadable)


def _dated(match: re.Match[str]) -> bool:
    return bool(match["y"] or match["a"] or match["dd"])


def _seconds(match: re.Match[str], month_first: bool) -> float:
    """Seconds since year 1 or since midnight, nan for a date that no calendar has."""
    try:
        days = _day(match, month_first)
    except ValueError:
        return float("nan")
    if not match["h"]:
        return days * _DAY if _dated(match) else float("nan")
    hours, minutes = int(match["h"]), int(match["min"])
    if match["half"]:
        hours = hours % 12 + (12 if match["half"] in "pP" else 0)
    if match["mf"]:
        return 60.0 * hours + minutes + float("0." + match["mf"][1:])
    parts = float(f"{match['s'] or 0}.{match['f'] or 0}")
    return days * _DAY + 3600.0 * hours + 60.0 * minutes + parts


def _day(match: re.Match[str], month_first: bool) -> int:
    if match["y"]:
        return date(int(match["y"]), int(match["m"]), int(match["d"])).toordinal()
    if match["a"]:
        day, month = (match["b"], match["a"]) if month_first else (match["a"], match["b"])
        year = int(match["c"]) + (2000 if len(match["c"]) == 2 else 0)
        return date(year, int(month), int(day)).toordinal()
    if match["dd"]:
        return date(
            int(match["yy"]), _MONTHS.index(match["mon"].casefold()) + 1, int(match["dd"])
        ).toordinal()
    return 0
