"""Format of a serial line: the one that most of the latest whole pieces can be read as."""

from __future__ import annotations

import re
from collections.abc import Callable

from .framing import END, payload_of
from .text_lines import Pairs, json_of, pairs_of, row_of

ENOUGH = 3
"""Number of pieces or names from which a format, a header or a channel is trusted."""
SURE = 8
"""Number of first lines from which anything that most of them lack is rare or damaged."""
# The latest lines determine the format: a device's output at its start is soon past.
_LATEST_LINES = 20

TEXT_READERS: dict[str, Callable[[str], Pairs | list[float] | None]] = {
    "json": json_of,
    "labels": pairs_of,
    "csv": row_of,
}
FORMATS = ("frames", *TEXT_READERS)

# Select Graphic Rendition of ECMA-48, as device logs have it around a line or a label.
_COLOUR_CODES = re.compile(rb"\x1b\[[0-9;:]*m")

_LATIN_SIGNS = "\u00b0\u00b5\u00ba".encode("latin-1")


def format_of(data: bytes, whole: bool, enough: int, last: str | None) -> str | None:
    """One of FORMATS, or None where too few pieces, less than `enough`, can be read as any.

    whole: the first piece is known to be complete. last: the format before, which needs less evidence.
    """
    frames = [p for p in data.split(END)[0 if whole else 1 : -1] if p]
    framed = sum(payload_of(p) is not None for p in frames)
    if framed >= enough or (framed and last == "frames"):
        return "frames"
    lines = whole_lines(data, whole)[-_LATEST_LINES:]
    read = {
        name: sum(reader(line) is not None for line in lines if line) for name, reader in TEXT_READERS.items()
    }
    best = max(read, key=lambda name: read[name])
    if read[best] >= enough and 2 * read[best] > len(lines):
        return best
    return last if last in TEXT_READERS and any(TEXT_READERS[last](line or "") for line in lines) else None


def whole_lines(data: bytes, whole: bool) -> list[str | None]:
    """The lines of some bytes that are not blank, None for one that is not text; see `format_of`."""
    lines = [text_of(p) for p in data.split(b"\n")[0 if whole else 1 : -1]]
    return [line for line in lines if line != ""]


def without_colour(piece: bytes) -> bytes:
    r"""Bytes without their colour codes (ANSI escape sequences SGR); others, which move a cursor, stay.

    >>> without_colour(b"\x1b[1;32mlight\x1b[0m: 512")
    b'light: 512'
    """
    return _COLOUR_CODES.sub(b"", piece) if b"\x1b" in piece else piece


def text_of(piece: bytes) -> str | None:
    """A line as text without colour codes and surrounding blanks, or None if it is not text."""
    piece = without_colour(piece)
    try:
        line = piece.decode().strip()
    except UnicodeDecodeError:
        # Signs of units in Latin-1, of a sketch that was saved so.
        if not piece.translate(None, _LATIN_SIGNS).isascii():
            return None
        line = piece.decode("latin-1").strip()
    return line if line.replace("\t", " ").isprintable() else None
