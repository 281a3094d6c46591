"""Text on a serial line: `label:value` pairs, CSV, or JSON, a line at a time.

A value may have its unit behind it, and volts with a prefix are converted; a label's value that is a word is
left out. A value's name may mark it as the device's clock or its running number (see CLOCKS and NUMBERS);
everything else is a channel.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

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

# Beyond these no float counts by one, and no clock ever ran (s; 300 years).
_MOST_COUNT, _MOST_S = 2.0**53, 1e10

_LABEL = r"[A-Za-z_][A-Za-z0-9_.%/()\- ]*"
# Possessive (++, *+): a line of noise costs time in proportion to its length.
_NUMBER = r"[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?|nan|NaN"
_TO_VOLT = {"mV": 1e-3, "uV": 1e-6, "µV": 1e-6, "kV": 1e3}
_UNITS = (
    *_TO_VOLT, "V", "mA", "uA", "µA", "A", "mW", "W", "kOhm", "kohm", "Ohm", "ohm", "kΩ", "Ω", "%RH", "%",
    "°C", "°F", "degC", "degF", "deg", "°", "rad", "kPa", "MPa", "hPa", "Pa", "mbar", "bar", "psi", "mmHg",
    "mm", "cm", "m", "kN", "mN", "N", "kg", "g", "lbs", "lb", "lux", "lx", "kHz", "Hz", "us", "µs", "ms",
    "s", "K", "C", "F",
)  # fmt: skip
# Of Greek letters and signs both that Unicode has; before a unit blanks, behind it no word and no other pair.
_UNIT = rf"(?:\s*+({'|'.join(_UNITS)})(?![\w%°/]|\s*+[:=]))?"
_END = r"(?:\s*+[,;|]|\s++|$)"
_PAIR = re.compile(rf"\s*+({_LABEL}+)\s*+[:=]\s*+({_NUMBER}){_UNIT}{_END}")
# Letters alone: with a digit it may be a number that was damaged, as infinities are.
_WORD_PAIR = re.compile(rf"\s*+{_LABEL}+\s*+[:=]\s*+(?!(?i:inf|infinity|nan)\b)[A-Za-z][A-Za-z_-]++{_END}")
_NAME = re.compile(rf"{_LABEL}\Z")
_VALUE = re.compile(rf"({_NUMBER}){_UNIT}\Z")
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_SAME_SIGNS = str.maketrans({"\u03bc": "\u00b5", "\u2126": "\u03a9", "\u00ba": "\u00b0"})

Pairs = dict[str, float]


def pairs_of(line: str) -> Pairs | None:
    """Values by label of a text line `light:512,ref:300`, or None where the line is not such pairs.

    A `>` before them, as Teleplot has it, is passed over. With semicolons between pairs a comma is decimal.

    >>> pairs_of("light:512,ref:300")
    {'light': 512.0, 'ref': 300.0}
    >>> pairs_of("light=1.23 V dark=20 mV state=OPEN")
    {'light': 1.23, 'dark': 0.02}
    """
    found, _ = _pairs_until(line)
    return None if found is None else _readable(found)


def _pairs_until(line: str) -> tuple[Pairs | None, str]:
    """The pairs of a line and "", or None and the rest that is not a pair or repeats a name."""
    line = line.translate(_SAME_SIGNS).removeprefix(">")
    if ";" in line:
        line = _DECIMAL_COMMA.sub(".", line)
    found: Pairs = {}
    place = 0
    while place < len(line):
        match = _PAIR.match(line, place)
        if match is None and (word := _WORD_PAIR.match(line, place)):
            place = word.end()
            continue
        if match is None or match[1].strip() in found:
            return None, line[place:].strip()
        found[match[1].strip()] = _value(match[2], match[3])
        place = match.end()
    return found, ""


def _value(number: str, unit: str | None) -> float:
    return float(number) * _TO_VOLT.get(unit or "", 1.0)


def why_unread(line: str) -> str:
    """Return the reason why a line is neither pairs, CSV nor JSON."""
    if not any(character.isdigit() for character in line):
        return "it holds no number"
    if line.startswith("{"):
        return "it is not a whole JSON object of numbers"
    if ":" in line or "=" in line:
        found, rest = _pairs_until(line)
        if found:
            return "a number in it is too large"
        return f"{rest[:40]!r} is not a `label:value` pair" if found is None else "no value in it is a number"
    cell = next((cell for cell in _cells(line) if not _VALUE.match(cell)), None)
    if cell is None:
        return "a number is too large"
    return f"{cell[:40]!r} is not a number, and has no label before it" if cell else "a value is missing"


def json_of(line: str) -> Pairs | None:
    """Numbers by name of a JSON object, or None for any other line.

    Values that are neither number nor true or false are left out; None also for a repeated name.
    """
    if not line.startswith("{"):
        return None
    try:
        value = json.loads(line, object_pairs_hook=_named_once)
        found = {k: float(v) for k, v in value.items() if isinstance(v, int | float)}
    # Numbers that no float holds, brackets without end.
    except (ValueError, OverflowError, RecursionError):
        return None
    return _readable(found)


def _named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON; ValueError where a name occurs twice, as where two lines ran into one."""
    value = dict(pairs)
    if len(value) < len(pairs):
        raise ValueError("a name occurs twice")
    return value


def _readable(found: Pairs) -> Pairs | None:
    """`found`, or None if it is empty or a number, a clock or a running number is out of range."""
    if not found or any(math.isinf(value) for value in found.values()):
        return None
    counts = [found[name] for name in NUMBERS if name in found]
    times = [found[name] * tick_s for name, (tick_s, _) in CLOCKS.items() if name in found]
    sensible = all(abs(n) < _MOST_COUNT for n in counts) and all(abs(t) < _MOST_S for t in times)
    return found if sensible else None


def pairs_of_row(columns: list[str], row: list[float]) -> Pairs | None:
    """Values of a CSV row by column name, or None where a clock or running number is too large.

    row: as many numbers as columns, in the device's units.
    """
    return _readable(dict(zip(columns, row, strict=True)))


def header_of(line: str) -> list[str] | None:
    """Column names of a CSV header, valid and distinct, or None for any other line."""
    names = _cells(line)
    named = all(_NAME.match(name) for name in names) and len(set(names)) == len(names)
    return names if names and named else None


def row_of(line: str) -> list[float] | None:
    """Numbers of a CSV row, in the device's units, or None where a field is not a number or is infinite.

    >>> row_of("1.5,2"), row_of("time,light")
    ([1.5, 2.0], None)
    """
    matches = [_VALUE.match(cell) for cell in _cells(line.translate(_SAME_SIGNS))]
    row = [_value(match[1], match[2]) for match in matches if match is not None]
    return None if not row or len(row) < len(matches) or any(map(math.isinf, row)) else row


def _cells(line: str) -> list[str]:
    """Cells between semicolons, commas, tabs or bars, or between blanks where there is none of these.

    Brackets around a line and one separator at its end are no part of it. Between semicolons a comma is
    decimal.
    """
    if line[:1] + line[-1:] in ("()", "[]"):
        line = line[1:-1]
    for separator in ";,\t|":
        if separator in line:
            line = line.removesuffix(separator)
            cells = [cell.strip() for cell in line.split(separator)]
            return [_DECIMAL_COMMA.sub(".", cell) for cell in cells] if separator == ";" else cells
    return line.split()
