"""A column of a table as numbers: by which decimal sign, in which unit behind them, or why it has none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..table_cells.clock import clock, is_clock
from ..table_cells.notation import DECIMALS, OTHER, Numbers, judged, number, unit_behind, with_units
from .sheet import Sheet
from .units import unit_of

# Cells with the other decimal sign from which these alternate; fewer are damaged cells.
_ALTERNATING = 3
# Readings above so many times the others were no thousands.
_FAR = 10.0


@attrs.frozen(eq=False)
class ReadColumn:
    """A column read as numbers, or the reason why not.

    values (n,): nan where a cell holds none; bad: text of these by row; cells: without their units; numbers:
    False where it holds none, and words say what it holds; decimal: the decimal sign, unsure if both are
    possible; clock: dates or times of day, halves: of two parts; unit: behind the numbers, factors (n,) to it
    where it changes; noted: a conclusion.
    """

    values: Array
    bad: Mapping[int, str] = attrs.field(factory=dict)
    cells: tuple[str, ...] = ()
    numbers: bool = True
    decimal: str = ""
    unsure: bool = False
    clock: bool = False
    halves: bool = False
    unit: str = ""
    words: str = ""
    noted: str = ""
    factors: Array | None = None

    @property
    def scaled(self) -> Array:
        """Values in the column's one unit, where rows have units of their own."""
        return self.values if self.factors is None else self.values * self.factors


def read_column(sheet: Sheet, cells: list[str], lines: Array) -> ReadColumn:
    """A column of numbers, of a clock or of words, by most of its cells.

    lines (n,): of the cells. Raises InputError where decimal points and commas alternate.
    """
    filled = [cell for cell in cells if cell]
    if not filled:
        return _no_numbers("")
    clocks = sum(map(is_clock, filled))
    if 2 * clocks > len(filled):
        return _clock(cells)
    apart, unit, factors = _without_units(cells)
    found = judged(apart, sheet.usual, sheet.forced)
    _require_one_sign(found, apart, lines)
    if sheet.forced:
        _require_forced(sheet, found.unreadable, apart, lines)
    if 2 * len(found.unreadable) >= len(filled):
        usual = Counter(filled).most_common(1)[0][0]
        if usual.startswith("="):
            return _no_numbers(
                f"formulas without stored values, such as {usual!r}: save the values in a spreadsheet program"
            )
        if len(set(filled)) == 1 and len(filled) == len(cells):
            return _no_numbers(f"{usual!r} in every row")
        return _no_numbers(f"words, such as {usual!r}")
    noted = ""
    if found.both:
        noted = (
            f"{found.decimal!r} separates decimals as well as thousands from line {lines[found.both[0]]} on: "
            f"{cells[found.both[0]]} is read as {found.values[found.both[0]]:.10g}"
        )
    bad = {i: cells[i] for i in found.unreadable}
    unsure = not found.sure and not sheet.forced
    if factors is not None:
        k = int(np.argmax(np.isfinite(factors) & (factors != 1.0)))
        other = unit_behind(cells[k])
        noted = f"its unit changes from {unit!r} to {other!r} at line {lines[k]}: each row is read in its own"
    return ReadColumn(
        found.values, bad, tuple(apart), True, found.decimal, unsure, unit=unit, noted=noted, factors=factors
    )


def _no_numbers(words: str) -> ReadColumn:
    """A column without numbers, and the reason, "" for one without cells."""
    return ReadColumn(np.empty(0), numbers=False, words=words)


def _without_units(cells: list[str]) -> tuple[list[str], str, Array | None]:
    """Cells without the units behind their numbers, the unit, and factors (n,) to it where it changes."""
    apart = with_units(cells)
    units = Counter(unit for _, unit in apart if unit)
    if not units:
        return cells, "", None
    usual = next((unit for _, unit in apart if unit_of(unit)), units.most_common(1)[0][0])
    read, one = unit_of(usual) or ("", 1.0)
    same = {unit: known[1] / one for unit in units if (known := unit_of(unit)) and known[0] == read}
    same = same or {usual: 1.0}
    if 2 * sum(units[unit] for unit in same) < sum(map(bool, cells)):
        return cells, "", None
    values = [text if unit in same else cell for (text, unit), cell in zip(apart, cells, strict=True)]
    # Of a number without a unit among those of several nothing is known.
    alone = 1.0 if len(same) == 1 else np.nan
    factors = np.array([same.get(unit, alone) for _, unit in apart])
    return values, usual, None if len(same) == 1 else factors


def _require_one_sign(found: Numbers, cells: Sequence[str], lines: Array) -> None:
    """Raise InputError for a column in which decimal points and commas alternate."""
    other = OTHER[found.decimal]
    if not any(other in cell for cell in cells):
        return
    apart = [i for i in found.unreadable if number(cells[i], other) is not None]
    single = [i for i, cell in enumerate(cells) if cell.count(found.decimal) == 1 and other not in cell]
    usual = float(np.nanmax(np.abs(found.values[single]), initial=0.0))
    # Read as thousands, these are far from the rest, and as decimals among it.
    thousands = [
        i
        for i, cell in enumerate(cells)
        if cell.count(other) == 1
        and found.decimal not in cell
        and abs(found.values[i]) > _FAR * usual > 0
        and abs(number(cell, other) or np.inf) <= 2 * usual
    ]
    if len(apart) < _ALTERNATING and not thousands:
        return
    first, then = (single or [0])[0], (apart or thousands)[0]
    raise InputError(
        f"decimal points and commas alternate in a column: {cells[first]!r} in line {lines[first]}, "
        f"{cells[then]!r} in line {lines[then]}",
        f"line {lines[then]}",
        "export it again with one decimal sign, or replace the other one in a text editor",
    )


def _require_forced(sheet: Sheet, unreadable: Sequence[int], cells: Sequence[str], lines: Array) -> None:
    """Raise InputError for a number that can be read with the other decimal sign only."""
    other = OTHER[sheet.forced]
    for i in unreadable:
        if number(cells[i], other) is not None:
            raise InputError(
                f"{cells[i]!r} is not a number where {sheet.forced!r} is the decimal sign",
                f"line {lines[i]}",
                f"answer decimal={other}, or leave the decimal sign to the columns",
            )


def _clock(cells: list[str]) -> ReadColumn:
    found = clock(cells)
    if np.nanmax(found.seconds, initial=0.0) == 0.0:
        return _no_numbers("the same date in every row")
    return ReadColumn(found.seconds, {i: cells[i] for i in found.unreadable}, clock=True, halves=found.halves)


def in_one_notation(sheet: Sheet, read: dict[int, ReadColumn]) -> dict[int, ReadColumn]:
    """The columns, ambiguous ones read with the decimal sign of the others."""
    taken = [
        one.decimal
        for one in read.values()
        if not one.unsure and any("." in cell or "," in cell for cell in one.cells)
    ]
    if not taken or sheet.forced:
        return {k: attrs.evolve(one, unsure=one.unsure and not sheet.usual) for k, one in read.items()}
    usual = max(DECIMALS, key=taken.count)
    return {
        k: attrs.evolve(one, values=judged(one.cells, usual).values, decimal=usual, unsure=False)
        if one.unsure
        else one
        for k, one in read.items()
    }
