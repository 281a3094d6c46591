"""Tables in HTML, or in the XML of a spreadsheet."""

from __future__ import annotations

from html.parser import HTMLParser

from ...errors import InputError
from ...table_cells.dialect import Row
from ..sheet import Content, Sheet

TEXT = 1
_ROWS, _CELLS, _TABLES = ("tr", "row", "ss:row"), ("td", "th", "cell", "ss:cell"), ("table", "worksheet")


def read(content: Content) -> tuple[Sheet, ...] | None:
    """All tables of a page in one sheet, in order; raises InputError for a page without one."""
    head = content.text[:2000].lstrip("\ufeff \r\n\t").casefold()
    if not head.startswith(("<html", "<!doctype html", "<table", "<?xml", "<meta", "<head", "<style")):
        return None
    reader = _Reader()
    reader.feed(content.text)
    reader.close()
    if not reader.rows:
        raise InputError(
            "the file is HTML or XML without a table",
            str(content.path),
            "export the table as CSV or a workbook",
        )
    cells = enumerate(reader.rows, 1)
    rows = tuple(Row(n, tuple(" ".join(cell.split()) for cell in row)) for n, row in cells)
    return (Sheet("", rows, "", "", content.decimal),)


class _Reader(HTMLParser):
    """Collects cells; an unclosed one ends with the next."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.rows: list[list[str]] = []
        self.within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Start a row or a cell, at its named position and with its span."""
        if tag in _ROWS or (tag in _TABLES and self.rows):
            self.rows.append([])
            self.within = False
        elif tag in _CELLS and self.rows:
            given = {name.rpartition(":")[2]: value for name, value in attrs}
            at = given.get("index") or ""
            if at.isdigit() and len(self.rows[-1]) < int(at) - 1 < 1000:
                self.rows[-1] += [""] * (int(at) - 1 - len(self.rows[-1]))
            span = given.get("colspan") or "1"
            self.at = len(self.rows[-1])
            self.rows[-1] += [""] * (min(max(int(span), 1), 1000) if span.isdigit() else 1)
            self.within = True
        elif tag == "br" and self.within:
            self.rows[-1][self.at] += " "

    def handle_endtag(self, tag: str) -> None:
        """End a cell."""
        if tag in _CELLS:
            self.within = False

    def handle_data(self, data: str) -> None:
        """Add text to a cell."""
        if self.within:
            self.rows[-1][self.at] = f"{self.rows[-1][self.at]}{data}".strip("\r\n\t")
