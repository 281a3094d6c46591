"""Text on a serial line: `label:value` pairs, CSV, or JSON, a line at a time.

A value's name may say that it is the device's clock or its running number (see CLOCKS and NUMBERS);
everything else is a channel.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

# Seconds a tick, and the ticks after which such a clock begins again (Arduino's are 32 bit), or none.
CLOCKS: Mapping[str, tuple[float, int | None]] = {
    "time_us": (1e-6, 1 << 32),
    "t_us": (1e-6, 1 << 32),
    "micros": (1e-6, 1 << 32),
    "time_ms": (1e-3, 1 << 32),
    "t_ms": (1e-3, 1 << 32),
    "millis": (1e-3, 1 << 32),
    "time_s": (1.0, None),
    "t_s": (1.0, None),
}
NUMBERS = ("sequence", "seq", "n")

_LABEL = r"[A-Za-z_][A-Za-z0-9_.%/()\- ]*"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|NaN"
_PAIR = re.compile(rf"\s*({_LABEL}?)\s*[:=]\s*({_NUMBER})\s*(?:[,;\t ]|$)")
_NAME = re.compile(rf"{_LABEL}\Z")
_VALUE = re.compile(rf"(?:{_NUMBER})\Z")

Pairs = dict[str, float]


def pairs_of(line: str) -> Pairs | None:
    """Values by label of `light:512,ref:300`, or None if the whole line is not such pairs."""
    found: Pairs = {}
    place = 0
    while place < len(line):
        match = _PAIR.match(line, place)
        if match is None:
            return None
        found[match[1].strip()] = float(match[2])
        place = match.end()
    return found or None


def json_of(line: str) -> Pairs | None:
    """Numbers by name of a JSON object, or None; what is neither number nor true or false is left out."""
    if not line.startswith("{"):
        return None
    try:
        value = json.loads(line)
    except ValueError:
        return None
    if not isinstance(value, dict):
        return None
    return {str(k): float(v) for k, v in value.items() if isinstance(v, int | float)} or None


def header_of(line: str) -> list[str] | None:
    """Column names of a CSV header, or None if the line is none: names, none of them a number or twice."""
    names = _cells(line)
    named = all(_NAME.match(name) for name in names) and len(set(names)) == len(names)
    return names if names and named else None


def row_of(line: str) -> list[float] | None:
    """Numbers of a CSV row, or None if any is none."""
    cells = _cells(line)
    return [float(cell) for cell in cells] if cells and all(_VALUE.match(cell) for cell in cells) else None


def _cells(line: str) -> list[str]:
    """What commas, semicolons or tabs part, or blanks where there is none of these."""
    for separator in ",;\t":
        if separator in line:
            return [cell.strip() for cell in line.split(separator)]
    return line.split()
