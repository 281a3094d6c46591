"""Tables in HTML and in Excel's XML of 2003, which many programs write under the name .xls."""

from __future__ import annotations

from html.parser import HTMLParser

_ROWS, _CELLS, _TABLES = ("tr", "row", "ss:row"), ("td", "th", "cell", "ss:cell"), ("table", "worksheet")


def is_markup(text: str) -> bool:
    """Return True if a text is HTML, or XML of a spreadsheet."""
    head = text[:2000].lstrip("\ufeff \r\n\t").casefold()
    return head.startswith(("<html", "<!doctype html", "<table", "<?xml", "<meta", "<head", "<style"))


def rows_of_markup(text: str) -> list[list[str]]:
    """Rows of all its tables as cells, in order; empty without a table."""
    reader = _Reader()
    reader.feed(text)
    reader.close()
    return reader.rows


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
            self.rows[-1] += [""] * (min(int(span), 1000) if span.isdigit() and int(span) > 1 else 1)
            self.at = len(self.rows[-1]) - (int(span) if span.isdigit() and 1 < int(span) <= 1000 else 1)
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
