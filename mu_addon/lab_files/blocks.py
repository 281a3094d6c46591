"""Tables in the rows of a file, judged by column: a row belongs to one if its columns have numbers.

A row with a cell that is not a number, a line of text or a blank line does not end a table; unread parts
are listed with lines and reason.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise, zip_longest

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..table_cells.clock import clock, is_clock
from ..table_cells.dialect import BRACKET, Row, split
from ..table_cells.notation import is_like_number, judged, unit_behind
from .cells import ReadColumn, in_one_notation, read_column
from .columns import Column, column, shown
from .sheet import Sheet
from .units import is_unit, plain

# A line that names the specimen whose table follows, such as "Specimen 2".
_SPECIMEN = re.compile(
    r"(specimen|sample|probe|probekorper|eprouvette|provino|probeta|probka|monster|prov|obrazec|vzorek)"
    r"\W*[\w.-]{1,20}"
)
# A line of one cell is kept, such as "Compression test", but no prose.
_LONGEST_LINE = 80
# Fewer rows of numbers are a table of results or settings, not a record.
FEWEST = 3
# Rows of titles, units and names of specimens above the numbers, and rows that may lie between them.
_MOST_TITLE_ROWS, _MOST_BETWEEN = 4, 3
# Rows by which the columns of a table are known while its end is sought.
_JUDGED = 30
# What begins a line that is a comment, titles included.
_COMMENT = re.compile(r"^(#+|%+|//+|;+)\s*")
_LONGEST_UNIT = 10
# Letters of a line shown in a list.
_LONGEST_SHOWN = 50


@attrs.frozen
class Unread:
    """A part of a file that is not read: its lines, or a column, and the reason."""

    what: str
    why: str
    lines: tuple[int, ...] = ()

    @property
    def words(self) -> str:
        """The same as text, such as "line 62: 'OVERLOAD' in 'Load (N)' is not a number"."""
        return f"{self.what or spans(self.lines)}: {self.why}"


def spans(lines: Sequence[int]) -> str:
    """Line numbers as text, such as "lines 3 to 7, 9"."""
    runs: list[list[int]] = []
    for line in sorted(set(lines)):
        if runs and line == runs[-1][1] + 1:
            runs[-1][1] = line
        else:
            runs.append([line, line])
    words = ", ".join(f"{a} to {b}" if b > a else str(a) for a, b in runs)
    return f"line{'s' if len(set(lines)) > 1 else ''} {words}"


@attrs.frozen(eq=False)
class Block:
    """A table of one record.

    columns: the quantity of each; values (n, columns) as in the file, nan where one is missing or unreadable;
    lines (n,) in the file; label: name above its columns, "" without one; facts: of the rows above, the cells
    after a name in lower case, none for a line of one cell; decimal: the decimal sign; bad: text of the cells
    that are not numbers, by row and column; unread: columns that are not read; unsure: both decimal signs are
    possible; noted: conclusions; clock: the column of times of day, or None.
    """

    sheet: str
    label: str
    decimal: str
    columns: tuple[Column, ...]
    values: Array
    lines: Array
    facts: dict[str, tuple[str, ...]]
    bad: dict[tuple[int, int], str] = attrs.field(factory=dict)
    unread: tuple[Unread, ...] = ()
    unsure: bool = False
    noted: tuple[str, ...] = ()
    clock: int | None = None


@attrs.frozen(eq=False)
class Tables:
    """The records of a sheet in their order, the unread lines, and those of titles and facts."""

    blocks: tuple[Block, ...]
    unread: tuple[Unread, ...]
    head: tuple[int, ...]


def tables(sheet: Sheet, fewest: int = 2) -> Tables:
    """Records of a sheet of `fewest` columns or more; those side by side are divided. Raises InputError."""
    return _Finding(sheet, fewest).tables()


class _Finding:
    """Search for the tables of a sheet."""

    def __init__(self, sheet: Sheet, fewest: int) -> None:
        self.sheet, self.rows, self.fewest = sheet, sheet.rows, fewest
        self.numeric = [row.numeric for row in self.rows]
        if self._start(0) is None:
            self.numeric = [_numeric_with_units(row) for row in self.rows]
        self.facts: dict[str, tuple[str, ...]] = {}
        self.specimen = ""
        # Of the last table: its titles, and the columns that have numbers.
        self.titles: list[Row] = []
        self.titled: frozenset[int] = frozenset()
        self.unread: list[Unread] = []

    def tables(self) -> Tables:
        found: list[Block] = []
        begin = 0
        while (start := self._start(begin)) is not None:
            members, skipped, end = self._extent(start)
            if len(members) < FEWEST:
                # Results or settings: facts of the table that follows.
                start = members[-1] + 1
                if self._start(start) is None:
                    break
                self._note_numbers(begin, range(begin, start))
                self.facts = self.facts | _facts(self.rows[begin:start])
                begin = start
                continue
            found += self._table(begin, start, members, skipped)
            begin = end
        if found:
            self._leave_text([row for row in self.rows[begin:] if row.filled], "below the table")
        taken = {int(line) for block in found for line in block.lines}
        taken |= {line for one in self.unread for line in one.lines}
        head = [row.line for row in self.rows if row.filled and not taken.intersection(row.lines)]
        return Tables(tuple(found), tuple(self.unread), tuple(head))

    def _leave(self, rows: Sequence[Row], why: str) -> None:
        """List rows as unread."""
        if rows:
            self.unread.append(Unread("", why, tuple(line for row in rows for line in row.lines)))

    def _leave_text(self, rows: Sequence[Row], why: str) -> None:
        """List rows as unread, with their text."""
        by_text: dict[str, list[Row]] = {}
        for row in rows:
            by_text.setdefault(" ".join(row.filled), []).append(row)
        for text, same in by_text.items():
            begin = text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."
            self._leave(same, f"{begin!r}: {why}")

    def _note_numbers(self, begin: int, places: Sequence[int]) -> None:
        """List rows of numbers outside every record, also a row that was cut after its first number.

        A row with a number directly below such a row, or below the last record, which ends before row
        `begin`, is not a fact of the next table.
        """
        rows, last = [], begin - 1 if begin else -2
        for k in places:
            cut = k == last + 1 and bool(self.numeric[k] & self.usual)
            if cut or len(self.numeric[k]) > 1 or self._begins_with_number(k):
                rows.append(self.rows[k])
                last = k
        self._leave(rows, f"numbers above a table, fewer than {FEWEST} rows")

    def _begins_with_number(self, k: int) -> bool:
        """Return True if the first filled cell of a row is a number: a fact begins with its name."""
        first = next((place for place, cell in enumerate(self.rows[k].cells) if cell), -1)
        return first in self.numeric[k]

    def _start(self, begin: int) -> int | None:
        """The first row from `begin` on that shares its columns of numbers with one of the next three."""
        filled = [k for k in range(begin, len(self.rows)) if self.rows[k].cells]
        for at, k in enumerate(filled):
            if len(self.numeric[k]) < self.fewest:
                continue
            for j in filled[at + 1 : at + 4]:
                if _names_columns(self.rows[j]) and self.numeric[k]:
                    # Settings above the titles, as "range 0.0 3.0".
                    break
                if len(self.numeric[k] & self.numeric[j]) >= self.fewest:
                    return k
        return None

    def _extent(self, start: int) -> tuple[list[int], list[int], int]:
        """The rows of a table, the rows within it that lack two of its numbers, and its end."""
        near = [m for m in self.numeric[start : start + _JUDGED] if len(m) >= self.fewest]
        counts = Counter(k for m in near for k in m)
        usual = frozenset(k for k, count in counts.items() if 2 * count >= len(near))
        self.usual = usual = usual if len(usual) > 1 else frozenset(counts)
        least = min(2, len(usual))
        members, pending, skipped = [start], list[int](), list[int]()
        for k in range(start + 1, len(self.rows)):
            if len(self.numeric[k] & usual) >= least:
                if k > members[-1] + 1 and self._begins_anew(members, pending, k):
                    break
                skipped += pending
                pending = []
                members.append(k)
            elif self.rows[k].filled:
                pending.append(k)
        return members, skipped, members[-1] + 1

    def _begins_anew(self, members: Sequence[int], between: Sequence[int], k: int) -> bool:
        """Return True if another record begins at row k, after rows without numbers."""
        if _specimen(self._at(between)):
            return True
        order = self._order(members, k)
        titles = [row for row in self._at(between) if _is_titles(row)]
        if not titles:
            # A first column that begins again is another record's.
            return order is not None and order < 0
        width = len(self.rows[k].filled)
        known = any(sum(bool(column(c).quantity) or is_unit(c) for c in row.filled) > 1 for row in titles)
        before = self.rows[max(0, members[0] - _MOST_TITLE_ROWS) : members[0]]
        same = any(row.filled == above.filled for row in titles for above in before)
        if order is not None and order > 0 and (same or not known):
            return False
        return known or same or any(len(row.filled) >= width for row in titles)

    def _at(self, places: Sequence[int]) -> list[Row]:
        return [self.rows[k] for k in places]

    def _order(self, members: Sequence[int], k: int) -> int | None:
        """1 if the first growing column goes on growing at row k, -1 if it falls back, else None."""
        first, last = members[0], members[-1]
        # Of the last rows one may be damaged.
        places = (first, members[-min(2, len(members))], last, k)
        for place in sorted(self.usual):
            cells = [_cell(self.rows[i].cells, place) for i in places]
            clocks = all(map(is_clock, cells))
            read = clock(cells).seconds if clocks else judged(cells, self.sheet.usual).values
            a, before, b, c = read
            if np.isfinite(read).all() and (b > a or (first == last and c != b)):
                low = min(before, b)
                return 1 if c > low else -1 if c < low - 0.5 * (low - a) or first == last else None
        return None

    def _table(self, begin: int, start: int, members: Sequence[int], skipped: Sequence[int]) -> list[Block]:
        """Records of a table whose rows are known."""
        above = self.rows[begin:start]
        titles, damaged = self._titles(range(begin, start))
        used = {row.line for row in titles} | {row.line for row in damaged}
        remarks = [row for row in above if row.line not in used and row.filled]
        self.facts = self.facts | _facts(remarks)
        self.specimen = _specimen(remarks) or self.specimen
        self._leave_text(damaged, "between the titles and the first row that is read")
        if titles or not self.titles:
            self._note_numbers(begin, [k for k in range(begin, start) if self.rows[k] in remarks])
        else:
            titles = self.titles if self.titled == self.usual else []
            self._leave_text(
                [row for row in remarks if row.filled != (self.specimen,)], "between two records"
            )
        self._leave_text(self._at(skipped), "no row of numbers, within the table")
        blocks = _block(self.sheet, titles, self._at(members), self.facts, self.fewest)
        self.titles, self.titled = titles, self.usual
        read = {int(line) for block in blocks for line in block.lines}
        self._leave([row for row in self._at(members) if row.line not in read], "no two columns of numbers")
        return [attrs.evolve(block, label=block.label or self.specimen) for block in blocks]

    def _titles(self, places: range) -> tuple[list[Row], list[Row]]:
        """Rows of titles, units and labels above the numbers, and damaged rows of numbers below them."""
        width = max(self.usual) + 1
        found: list[Row] = []
        damaged: list[Row] = []
        for k in reversed(places):
            row = self._title_row(k, width)
            if not row.filled:
                continue
            if not (_is_titles(row) or (self.fewest == 1 and _known(row))):
                within = self.numeric[k] & self.usual
                if len(row.filled) == len(found) == 1 and _is_units(found[0]):
                    # A remark between titles and units.
                    continue
                if found or len(damaged) == _MOST_BETWEEN or not (within or len(row.filled) == 1):
                    break
                damaged.insert(0, row)
                continue
            if len(found) == _MOST_TITLE_ROWS:
                break
            if found and not _is_units(found[0]) and not _is_units(row):
                same = len(row.filled) >= len(found[0].filled) > 2
                above, below = _known(row), _known(found[0])
                if same and len(found) == 1 and above > 1 and not below:
                    # Words below the titles, of an event or a remark.
                    damaged = [found.pop(), *damaged]
                elif not (_is_label_row(row, found[0]) or (same and above > below)):
                    break
            if found and _is_units(row):
                if len(found) > 1 or _known(found[0]):
                    break
                damaged = [found.pop(), *damaged]
            found.insert(0, row)
        return (found, damaged) if found else ([], [])

    def _title_row(self, k: int, width: int) -> Row:
        """A row above the numbers split into its titles, also with another separator."""
        row = self.rows[k]
        cells = (_COMMENT.sub("", row.cells[0]) or row.cells[0], *row.cells[1:]) if row.cells else row.cells
        if len([c for c in cells if c]) == 1 and width > 1:
            text = next(c for c in cells if c)
            for delimiter in ("\t", ";", ",", "spaces"):
                parts = split(text, delimiter)
                known = any(column(part).quantity or is_unit(part) for part in parts)
                if len(parts) == width and all(parts) and known:
                    return attrs.evolve(row, cells=parts)
            words = BRACKET.sub("\u00a0", text).split(" ")
            if len(words) == width and self.sheet.delimiter == "spaces":
                return attrs.evolve(row, cells=tuple(word.replace("\u00a0", " ") for word in words))
        return attrs.evolve(row, cells=cells)


def _numeric_with_units(row: Row) -> frozenset[int]:
    """Positions of a row's cells that hold a number, also one followed by its unit."""
    return row.numeric | {k for k, cell in enumerate(row.cells) if is_unit(unit_behind(cell))}


def _is_titles(row: Row) -> bool:
    """Return True if a row may be titles or units: text in two cells or more, and no reading."""
    filled = row.filled
    numbers = [cell for cell in filled if not is_unit(cell) and row.cells.index(cell) in row.numeric]
    return len(filled) >= 2 and not numbers


def _names_columns(row: Row) -> bool:
    """Return True if a row certainly holds titles: words in every cell, and the first names a time."""
    cells = row.cells
    words = len(cells) > 1 and all(cell and not cell[0].isdigit() for cell in cells) and _is_titles(row)
    return words and column(cells[0]).quantity == "time"


def _is_units(row: Row) -> bool:
    """Return True if a row is of units: all in brackets, or most known and all short."""
    filled = row.filled
    if all(re.fullmatch(r"[(\[].*[)\]]", cell) for cell in filled):
        return True
    known = sum(is_unit(cell) and cell != "-" for cell in filled)
    return (
        2 * known >= len(filled) and all(is_unit(c) or len(c) <= _LONGEST_UNIT for c in filled) and known > 0
    )


def _is_label_row(row: Row, titles: Row) -> bool:
    """Return True if a row names the specimens of several columns each."""
    return 2 <= len(row.filled) < len(titles.filled) and len(row.cells) > len(row.filled)


def _known(row: Row) -> int:
    """Number of a row's cells that name a quantity."""
    return sum(bool(column(cell).quantity) for cell in row.cells)


def _block(
    sheet: Sheet,
    titles: Sequence[Row],
    rows: Sequence[Row],
    facts: dict[str, tuple[str, ...]],
    fewest: int,
) -> list[Block]:
    units = next((row for row in titles if _is_units(row)), None)
    named = [row for row in titles if row is not units]
    if units is not None and not named:
        # Columns that are known by their units alone.
        named, units = [], units
    labelled = next((k for k, two in enumerate(pairwise(named)) if _is_label_row(*two)), None)
    above = () if labelled is None else named.pop(labelled).cells
    joined = (
        " ".join(filter(None, cells)) for cells in zip_longest(*(r.cells for r in named[-2:]), fillvalue="")
    )
    pairs = tuple(zip_longest(above, joined, fillvalue=""))
    # A cell above an empty one is the title of its column.
    labels = tuple(label if head else "" for label, head in pairs)
    heads = tuple(head or label for label, head in pairs)
    width = max(len(row.cells) for row in rows)
    _require_divided(sheet, heads, rows)
    lines = np.array([row.line for row in rows])
    read = {k: read_column(sheet, [_cell(row.cells, k) for row in rows], lines) for k in range(width)}
    read = in_one_notation(sheet, read)
    columns: dict[int, Column] = {}
    unread: list[Unread] = []
    for k, one in read.items():
        title, unit = _cell(heads, k), _cell(units.cells if units else (), k)
        if one.numbers:
            columns[k] = attrs.evolve(column(title, unit or one.unit), place=k + 1)
            if one.clock:
                unit, factor = ("", None) if one.halves else ("clock", 1.0)
                columns[k] = attrs.evolve(columns[k], quantity="time", unit=unit, factor=factor)
        elif one.words:
            unread.append(Unread(shown(title, k + 1), one.words))
    beyond = ((k, title) for k, title in enumerate(heads) if k >= width and title)
    unread += [Unread(shown(title, k + 1), "no cell in it") for k, title in beyond]
    parts: list[Block] = []
    for group in _side_by_side(columns):
        values = np.stack([read[k].scaled for k in group], axis=1)
        # Of records side by side, the shorter ends where its cells are empty.
        filled = np.array([any(_cell(row.cells, k) for k in group) for row in rows])
        if filled.sum() < FEWEST or len(group) < fewest:
            continue
        places = np.cumsum(filled) - 1
        bad = {
            (int(places[i]), n): text
            for n, k in enumerate(group)
            for i, text in read[k].bad.items()
            if filled[i]
        }
        label = next((_cell(labels, k) for k in range(group[-1], -1, -1) if _cell(labels, k)), "")
        parts.append(
            Block(
                sheet=sheet.name,
                label=label,
                decimal=next((read[k].decimal for k in group if read[k].decimal), sheet.usual or "."),
                columns=tuple(columns[k] for k in group),
                values=values[filled],
                lines=lines[filled],
                facts=facts,
                bad=bad,
                unread=tuple(unread) if not parts else (),
                unsure=any(read[k].unsure for k in group),
                clock=next((n for n, k in enumerate(group) if read[k].clock), None),
                noted=tuple(
                    f"{shown(columns[k].title, k + 1)}: {noted}"
                    for k in group
                    for noted in _noted(read[k], k, rows)
                ),
            )
        )
    return parts


def _noted(one: ReadColumn, k: int, rows: Sequence[Row]) -> list[str]:
    """Conclusions on column k: how it was read, or computed."""
    computed = dict.fromkeys(row.computed for row in rows if k == 0 and row.computed)
    return [*([one.noted] if one.noted else []), *computed]


def _require_divided(sheet: Sheet, heads: Sequence[str], rows: Sequence[Row]) -> None:
    """Raise InputError if commas separate columns as well as decimals."""
    named = sum(map(bool, heads))
    if sheet.delimiter != "," or named < 2 or any("." in cell for row in rows[:99] for cell in row.cells):
        return
    widths = sorted(len(row.cells) for row in rows)
    if widths[len(widths) // 2] >= 2 * named - 1 and widths[-1] > named:
        raise InputError(
            f"{widths[-1]} cells under {named} titles: commas separate columns as well as decimals",
            f"line {rows[0].line}",
            "export it with semicolons or tabs between columns, or with decimal points",
        )


def _cell(cells: Sequence[str], k: int) -> str:
    return cells[k] if k < len(cells) else ""


def _side_by_side(columns: dict[int, Column]) -> list[list[int]]:
    """Groups of columns, a new one at each repetition of a group's first title."""
    groups: list[list[int]] = []
    for k, one in columns.items():
        first = columns[groups[-1][0]].title if groups else None
        if not groups or (one.title and one.title == first):
            groups.append([])
        groups[-1].append(k)
    return groups


def _facts(rows: Sequence[Row]) -> dict[str, tuple[str, ...]]:
    """Facts in rows above a table, as in `Thickness;3.0;mm`, `Thickness: 3.0 mm` and `Thickness = 3.0`."""
    found: dict[str, tuple[str, ...]] = {}
    for row in rows:
        cells = list(row.filled)
        if not cells:
            continue
        match = re.match(r"([^:=]{2,60})[:=]\s*(.*)$", cells[0])
        if match and not (cells[1:] and is_like_number(cells[1])):
            cells = [match[1], *([match[2]] if match[2] else []), *cells[1:]]
        if len(cells) == 2:
            # A value with its unit in one cell.
            apart = re.match(r"([+-]?[\d.,]+)\s*([^\d\s.,].*)$", cells[1])
            if apart:
                cells = [cells[0], apart[1], apart[2]]
        if len(cells) == 3 and is_unit(cells[1]) and is_like_number(cells[2]):
            cells = [cells[0], cells[2], cells[1]]
        if len(cells) >= 2 or len(cells[0]) <= _LONGEST_LINE:
            found[plain(cells[0]).strip()] = tuple(cells[1:])
    return found


def _specimen(rows: Sequence[Row]) -> str:
    """Name of a specimen on the last separate line; "" if there is none."""
    lines = [row.filled[0] for row in rows if len(row.filled) == 1]
    return next((line for line in reversed(lines) if _SPECIMEN.fullmatch(plain(line))), "")
