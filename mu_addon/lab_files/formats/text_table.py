"""Text of lines with cells between tabs, semicolons, commas, bars or spaces."""

from __future__ import annotations

from ...table_cells.dialect import rows_of
from ..sheet import Content, Sheet

TEXT = 2


def read(content: Content) -> tuple[Sheet, ...]:
    """The one sheet of any text."""
    rows, delimiter = rows_of(content.text)
    # A comma between columns is not a decimal sign but in quotes.
    usual = "." if delimiter == "," and '"' not in content.text else ""
    return (Sheet("", rows, delimiter, usual, content.decimal),)
