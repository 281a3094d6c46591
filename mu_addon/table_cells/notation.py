"""Numbers in the cells of a column: the signs for decimals and thousands, and cells that are not numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array

DECIMALS = (".", ",")
OTHER = {".": ",", ",": "."}
MISSING = ("", "nan", "n/a", "na", "#n/a", "null", "none", "-", "--", "---")
# ASCII substitutes of typographic minus signs, spaces and apostrophes, of Arabic signs, and of digits.
_SIGNS = str.maketrans(
    dict.fromkeys("\u2212\u2013\ufe63\uff0d\u2010\u2011", "-")
    | dict.fromkeys("\u00a0\u202f\u2009\u2007\u2006\u3000", " ")
    | dict.fromkeys("\u2019\u02bc\u00b4`", "'")
    | {"\uff0c": ",", "\uff0e": ".", "\u060c": ",", "\u066b": ".", "\u066c": "'"}
    | dict.fromkeys("\u200e\u200f\u061c")  # marks of direction
    | {chr(first + digit): str(digit) for first in (0x0660, 0x06F0, 0xFF10) for digit in range(10)}
)
_EXPONENT = r"(?:[eEdD][+-]?\d{1,3})?"
_SIGNED = r"[+-]? ?"
_PLAIN = {
    d: re.compile(rf"{_SIGNED}(?:\d+{re.escape(d)}?\d*|{re.escape(d)}\d+){_EXPONENT}") for d in DECIMALS
}


def _grouped(decimal: str) -> re.Pattern[str]:
    """Groups of thousands, with the same sign throughout; the first does not begin with 0."""
    d, other = re.escape(decimal), re.escape(OTHER[decimal])
    indian = rf"|[1-9]\d?(?:{other}\d\d)+{other}\d{{3}}" if decimal == "." else ""
    return re.compile(rf"{_SIGNED}(?:[1-9]\d{{0,2}}([{other}' ])\d{{3}}(?:\1\d{{3}})*{indian})(?:{d}\d*)?")


_GROUPED = {d: _grouped(d) for d in DECIMALS}
# One sign for decimals and thousands, the last of them for decimals.
_BOTH = {
    d: re.compile(rf"{_SIGNED}[1-9]\d{{0,2}}(?:{re.escape(d)}\d{{3}})+{re.escape(d)}\d+") for d in DECIMALS
}
_LIKE = re.compile(rf"{_SIGNED}(?:\d+(?:[.,' ]\d{{2,3}})*(?:[.,]\d*)?|[.,]\d+){_EXPONENT}")
_WITH_UNIT = re.compile(r"([+-]? ?[\d.,' ]*\d[.,]?(?:[eE][+-]?\d+)?) ?([^\d\s.,+-][^\d\s]{0,9})")
# A negative number as accountants write it; in a row of units "(1)" is none.
_IN_BRACKETS = re.compile(r"\(([\d.,' ]*\d[.,]\d+)\)")
# Numbers that float() reads like the pattern of a decimal point.
_SIMPLE = re.compile(r"[-+0-9.eE\n]*")


@attrs.frozen(eq=False)
class Numbers:
    """The numbers of a column's cells.

    values (n,): nan where a cell is empty or no number; decimal: the decimal sign; sure: the cells determine
    it, or contain none; unreadable: mask of cells that are neither number nor empty; both: mask of cells with
    one sign for decimals and thousands.
    """

    values: Array
    decimal: str
    sure: bool
    unreadable: tuple[int, ...]
    both: tuple[int, ...] = ()


def plain_signs(cell: str) -> str:
    """A cell with ASCII minus signs, spaces and apostrophes; "(1.5)" as "-1.5"."""
    cell = cell if cell.isascii() else cell.translate(_SIGNS).strip()
    negative = _IN_BRACKETS.fullmatch(cell) if cell.startswith("(") else None
    return f"-{negative[1]}" if negative else cell


def is_like_number(cell: str) -> bool:
    """Return True if a cell looks like a number, with either decimal sign."""
    return _LIKE.fullmatch(plain_signs(cell)) is not None


def unit_behind(cell: str) -> str:
    """Unit after the number in a cell such as "12.5 N", "" without a unit or a number."""
    match = _WITH_UNIT.fullmatch(plain_signs(cell))
    return match[2] if match else ""


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell, nan where a value is missing, None for any other text."""
    cell = plain_signs(cell)
    if cell.casefold() in MISSING:
        return float("nan")
    if not (_PLAIN[decimal].fullmatch(cell) or _GROUPED[decimal].fullmatch(cell)):
        return None
    for sign in ",.' ":
        if sign != decimal:
            cell = cell.replace(sign, "")
    value = float(cell.replace(decimal, ".").replace("d", "e").replace("D", "e"))
    return value if np.isfinite(value) else None


def judged(cells: Sequence[str], usual: str = "", forced: str = "") -> Numbers:
    """The numbers of a column's cells, by the decimal sign that reads most of them.

    usual: the sign if the cells are ambiguous; forced: the sign in any case.
    """
    fast = _simple(cells) if forced != "," else None
    if fast is not None and (forced or fast.sure or usual == "."):
        return fast
    signs = (forced,) if forced else DECIMALS
    found = {d: [number(cell, d) for cell in cells] for d in signs}
    strict = {d: sum(v is not None for v in found[d]) for d in signs}
    twice = {d: _both(cells, found[d], d) for d in signs}
    counts = {d: (strict[d] + len(twice[d]), strict[d]) for d in signs}
    fit = [d for d in signs if counts[d] == max(counts.values())]
    differ = len(fit) > 1 and any(
        a is not None and b is not None and a == a and a != b
        for a, b in zip(*(found[d] for d in fit), strict=True)
    )
    decimal = usual if differ and usual in fit else fit[0]
    values = found[decimal]
    for i, value in twice[decimal].items():
        values[i] = value
    unreadable = tuple(i for i, value in enumerate(values) if value is None)
    numbers = np.array([np.nan if value is None else value for value in values])
    return Numbers(numbers, decimal, not differ, unreadable, tuple(twice[decimal]))


def _both(cells: Sequence[str], found: Sequence[float | None], decimal: str) -> dict[int, float]:
    """Numbers, by position, of cells that are numbers only if the decimal sign also divides thousands."""
    both = {}
    for i, value in enumerate(found):
        if value is None and _BOTH[decimal].fullmatch(cell := plain_signs(cells[i])):
            head, _, tail = cell.replace(" ", "").rpartition(decimal)
            both[i] = float(f"{head.replace(decimal, '')}.{tail}")
    return both


def _simple(cells: Sequence[str]) -> Numbers | None:
    """Numbers of digits and points alone, read many times as fast; None if there is anything else."""
    if not _SIMPLE.fullmatch("\n".join(cells)):
        return None
    try:
        values = np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return None
    if np.isinf(values).any():
        return None
    dotted = [cell for cell in cells if "." in cell]
    sure = not dotted or any(not _GROUPED[","].fullmatch(cell) for cell in dotted)
    return Numbers(values, ".", sure, ())


def with_units(cells: Sequence[str]) -> list[tuple[str, str]]:
    """Number and unit of cells such as "12.5 N", the cell itself and "" where it has none."""
    found = [(cell, _WITH_UNIT.fullmatch(plain_signs(cell))) for cell in cells]
    return [(match[1].strip(), match[2]) if match else (cell, "") for cell, match in found]
