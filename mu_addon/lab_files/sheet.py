"""A laboratory's file before its tables are found: its content, and the rows of cells made of it."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import attrs

from ..reading import require_rows
from ..table_cells.dialect import Row
from ..table_cells.encoding import decoded
from .columns import known_words


@attrs.frozen
class Sheet:
    """Rows of a file, or of one sheet of a workbook (name "").

    delimiter: between the cells of a text; usual: the decimal sign of ambiguous cells; forced: the sign in
    any case; "" for neither.
    """

    name: str
    rows: tuple[Row, ...]
    delimiter: str = ""
    usual: str = ""
    forced: str = ""


@attrs.frozen(slots=False)
class Content:
    """Bytes of a file; decimal: the decimal sign of a text where it is known, else ""."""

    path: Path
    data: bytes
    decimal: str = ""

    @cached_property
    def text(self) -> str:
        """The bytes as text in any encoding; raises InputError, also beyond the rows that are read."""
        text = decoded(self.data, str(self.path), known_words)
        require_rows(text.count("\n"), str(self.path))
        return text
