"""Columns of a CSV line by line: their names, by a header or numbered, and how many most rows have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from .formats import ENOUGH, SURE
from .text_lines import Pairs, header_of, pairs_of_row, row_of


class CsvColumns:
    """Meaning of a CSV stream's columns, from header and rows; `refused`: lines that were no headers."""

    def __init__(self) -> None:
        self.refused: list[bytes] = []
        self._columns: list[str] | None = None
        # A header that waits for its first row, and how many other rows came since.
        self._header: tuple[list[str], bytes] | None = None
        self._header_rows = 0
        self._width, self._other_widths = 0, [0, 0]
        self._rows_of: Counter[int] = Counter()
        self._columns_of: dict[int, list[str]] = {}

    def learn(self, rows: Sequence[Sequence[float]]) -> None:
        """Number of columns of most rows, so that a damaged first row does not set it."""
        self._width, self._other_widths = 0, [0, 0]
        if rows:
            self._width = Counter(map(len, rows)).most_common(1)[0][0]

    @staticmethod
    def is_unsure(rows: Sequence[Sequence[float]]) -> bool:
        """True if the first rows are too few and too different to determine the number of columns."""
        commonest = max(Counter(map(len, rows)).values(), default=0)
        return len(rows) < SURE and 4 * commonest < 3 * len(rows)

    def take(self, line: str, piece: bytes, first: bool) -> Pairs | None:
        """Values by column of a row, an empty dictionary of a header, None of any other line.

        piece: the line as it came. first: the line may lack its beginning, and is no row.
        """
        row = row_of(line)
        if row is None:
            header = header_of(line)
            if header is None:
                return None
            self._refuse_header()
            self._header, self._header_rows = (header, piece), 0
            return {}
        if first:
            return None
        if self._header is not None and len(self._header[0]) == len(row):
            self._columns, self._header = self._header[0], None
        self._header_rows += 1
        if self._header_rows >= ENOUGH:
            self._refuse_header()
        columns = self._columns_for(len(row))
        pairs = None if columns is None else pairs_of_row(columns, row)
        if columns is not None and pairs is not None:
            self._rows_of[len(row)] += 1
            self._columns_of[len(row)] = columns
        return pairs

    def _columns_for(self, count: int) -> list[str] | None:
        """The columns of a row of so many numbers, or None where rows have another number of them."""
        width = self._width if self._columns is None else len(self._columns)
        if count != width and self._rows_of[count] > self._rows_of[width]:
            # Back to what there was before a few damaged rows.
            self._columns = self._columns_of[count]
        elif count != width:
            # Rows of another width that keep coming are the device's new ones.
            times = self._other_widths[1] + 1 if self._other_widths[0] == count else 1
            self._other_widths = [count, times]
            if times < ENOUGH:
                return None
            self._columns = None
        if self._columns is None:
            self._columns = [f"channel{k + 1}" for k in range(count)]
        self._other_widths = [0, 0]
        return self._columns

    def _refuse_header(self) -> None:
        """A header without a following row of its width was not a header."""
        if self._header is not None:
            self.refused.append(self._header[1])
            self._header = None
