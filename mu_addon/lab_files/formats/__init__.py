"""Formats of laboratory files, one module each.

A format is a function `read` from a file's content to its sheets, None where the content is of another one.
"""

from __future__ import annotations

from collections.abc import Callable

from ..sheet import Content, Sheet
from . import labview, markup, serial_log, text_table, workbook

# The first that reads a content decides; any text is a table.
FORMATS: tuple[Callable[[Content], tuple[Sheet, ...] | None], ...] = (
    workbook.read,
    markup.read,
    labview.read,
    serial_log.read,
    text_table.read,
)
