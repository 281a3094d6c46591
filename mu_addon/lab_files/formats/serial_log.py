"""Text of a serial monitor: a clock and an arrow before each line, or `label:value` pairs."""

from __future__ import annotations

import re
from collections import Counter

from ...table_cells.dialect import Row, delimiter_of, is_reading, lines_of, split
from ..sheet import Content, Sheet

# The Arduino IDE writes an arrow behind the clock, others > or brackets, and some only labels follow.
TEXT = 1
_CLOCK = r"((?:\d{4}-\d\d-\d\d[ T])?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?)"
_ARROW = re.compile(rf"\s*(?:{_CLOCK}(?:\s*-?>|\s(?=[^\W\d]))|\[{_CLOCK}\])\s*(.*)")
# Tuples, lists and JSON objects, as boards print them.
_ENCLOSED = re.compile(r"\((.*)\)|\[(.*)\]|\{(.*)\}")
_PAIR = re.compile(
    r"\s*([^\W\d][\w .%/()-]*?)\s*[:=]\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s?([^\s\d,;|:=]*)"
    r"(?:\s*[,;|]\s*|\s+|$)"
)
# Lines by which a file is judged.
_JUDGED = 400


def read(content: Content) -> tuple[Sheet, ...] | None:
    """The one sheet of a log most of whose lines have an arrow, or the same labels."""
    lines = lines_of(content.text)
    near = [line for line in lines[:_JUDGED] if line.strip()]
    arrows = 2 * sum(_ARROW.match(line) is not None for line in near) > len(near)
    apart = [_ARROW.match(line) if arrows else None for line in lines]
    texts = [_bare(found[3] if found else line) for found, line in zip(apart, lines, strict=True)]
    clocks = [found[1] or found[2] if found else "" for found in apart]
    labels = Counter(tuple(label for label, _, _ in _pairs(text)) for text in texts[:_JUDGED])
    most, times = labels.most_common(1)[0] if labels else ((), 0)
    if most and 2 * times > len(near):
        return (Sheet("", _rows_of_pairs(texts, clocks, most), "", ".", content.decimal),)
    if not arrows and 2 * sum(_bare(line) != line for line in near) <= len(near):
        return None
    delimiter = delimiter_of(texts)
    rows = tuple(
        Row(n, _timed(split(t, delimiter), c)) for n, (t, c) in enumerate(zip(texts, clocks, strict=True), 1)
    )
    return (Sheet("", rows, delimiter, "." if delimiter == "," else "", content.decimal),)


def _bare(text: str) -> str:
    """A line without the brackets around it, and the quotes within these."""
    found = _ENCLOSED.fullmatch(text.strip())
    return next(part for part in found.groups() if part is not None).replace('"', "") if found else text


def _timed(cells: tuple[str, ...], clock: str) -> tuple[str, ...]:
    """Cells behind their clock; titles behind that of the clock."""
    if not clock or not cells:
        return cells
    return (clock if any(map(is_reading, cells)) else "Time", *cells)


def _pairs(text: str) -> list[tuple[str, str, str]]:
    """Label, number and unit of each pair of a line; none where it holds anything else."""
    if ";" in text:
        text = re.sub(r"(?<=\d),(?=\d)", ".", text)
    found, place = [], 0
    while place < len(text):
        match = _PAIR.match(text, place)
        if match is None:
            return []
        found.append((match[1], match[2], match[3]))
        place = match.end()
    return found


def _rows_of_pairs(texts: list[str], clocks: list[str], labels: tuple[str, ...]) -> tuple[Row, ...]:
    """Rows of values below one of labels, with their units; lines with other labels as their text."""
    rows: list[Row] = []
    titled = False
    for n, (text, clock) in enumerate(zip(texts, clocks, strict=True), 1):
        pairs = _pairs(text)
        if tuple(label for label, _, _ in pairs) != labels:
            rows.append(Row(n, (text.strip(),)))
            continue
        if not titled:
            titles = tuple(f"{label} [{unit}]" if unit else label for label, _, unit in pairs)
            rows.append(Row(0, ("Time", *titles) if clock else titles))
            titled = True
        rows.append(Row(n, _timed(tuple(value for _, value, _ in pairs), clock)))
    return tuple(rows)
