"""Tables of a text of TOML whose values are refused by file, line and key."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import attrs

from ..errors import InputError, did_you_mean
from ..reading import is_finite
from .quantity import Description

_HEADING = re.compile(r"\s*\[+\s*([\w.]+)\s*\]")
_KEY = re.compile(r"\s*[\"']?([\w-]+)[\"']?\s*=")


@attrs.frozen
class Row:
    """A table, where it stands, and the lines of its keys as far as they are known.

    heading: what a key is written after in messages, as "[modulus] ".
    """

    table: Mapping[str, Any]
    origin: str
    place: str = ""
    lines: Mapping[str, int] = attrs.field(factory=dict)
    heading: str = ""

    @property
    def where(self) -> str:
        """File and line."""
        return ", ".join(filter(None, (self.origin, self.place))) or "TOML text"

    def refusal(self, what: str, key: str, remedy: str) -> InputError:
        """The error of a key."""
        line = attrs.evolve(self, place=f"line {self.lines[key]}") if key in self.lines else self
        return InputError(what, f"{line.where}, {self.heading}{key}", remedy)

    @contextmanager
    def at(self, key: str = "") -> Iterator[None]:
        """Context that gives an InputError the place of a key, without one of that which it names."""
        try:
            yield
        except InputError as error:
            named = key or error.where.rpartition(" ")[2]
            raise self.refusal(error.what, named, error.remedy) from error

    def require_keys(self, known: Sequence[str], of: str = "") -> None:
        """Raise InputError for a key that is none of these."""
        for key in self.table:
            if key not in known:
                what = f"unknown key {key!r}{of}{did_you_mean(key, known)}"
                raise self.refusal(what, key, f"known: {', '.join(known)}")

    def refuse(self, keys: Sequence[str], why: str) -> None:
        """Raise InputError where one of these is given."""
        for key in keys:
            if key in self.table:
                raise self.refusal(f"{why}: {key} does not apply there", key, "leave it out")

    def number(self, key: str, low: float = -math.inf, high: float = math.inf, unit: str = "") -> float:
        """A finite number within bounds; raises InputError."""
        value: Any = self.table.get(key)
        if not is_finite(value):
            what = f"{key} is missing" if value is None else f"{key} = {value!r} is not a number"
            raise self.refusal(what, key, f"write {key} = ..")
        if not low <= value <= high:
            remedy = f"give {low:g} to {high:g} {unit}".rstrip()
            raise self.refusal(f"{key} = {value:g} is out of bounds", key, remedy)
        return float(value)

    def one_of(self, key: str, known: Sequence[str], default: str | None = None, why: str = "") -> str:
        """One of some words; raises InputError. why: what another one is not."""
        value = self.table.get(key, default)
        if not isinstance(value, str) or value not in known:
            hint = did_you_mean(value, known) if isinstance(value, str) else ""
            what = f"{key} = {value!r} is {why or 'not known'}{hint}"
            raise self.refusal(what, key, f"one of: {', '.join(known)}")
        return value

    def word(self, key: str, default: str | None = None) -> str:
        """A text, not an empty one but by default; raises InputError."""
        value = self.table.get(key, default)
        if not isinstance(value, str) or (value != default and not value.strip()):
            what = f"{key} is missing" if value is None else f"{key} = {value!r} is not a text"
            raise self.refusal(what, key, f'write {key} = "..."')
        return value

    def setting(self, described: Description, default: Any = None) -> Any:
        """Value of a setting, or its default; raises InputError."""
        key = described.name
        value = self.table.get(key, described.default if default is None else default)
        with self.at(key):
            return described.checked(value)


def rows_of(document: Mapping[str, Any], text: str, origin: str, key: str) -> list[Row]:
    """The tables [[key]] of a document; raises InputError. text: the document's, for lines."""
    found = document.get(key, [])
    if not isinstance(found, list) or not all(isinstance(table, dict) for table in found):
        raise InputError(f"{key} is not a list of tables", f"{origin}, {key}", f"begin each with [[{key}]]")
    written = [(line, keys) for heading, line, keys in _headings(text) if heading == key]
    if len(written) != len(found):
        # Tables that are written otherwise, as within brackets, have no line.
        return [Row(table, origin, f"{key} {number}") for number, table in enumerate(found, 1)]
    return [
        Row(table, origin, f"line {line}", keys) for table, (line, keys) in zip(found, written, strict=True)
    ]


def row_of(document: Mapping[str, Any], text: str, origin: str, key: str) -> Row:
    """The table [key] of a document."""
    line, keys = next(((line, keys) for heading, line, keys in _headings(text) if heading == key), (0, {}))
    return Row(document[key], origin, f"line {line}" if line else "", keys, f"[{key}] ")


def top_of(document: Mapping[str, Any], text: str, origin: str) -> Row:
    """A document's own keys."""
    return Row(document, origin, lines=_headings(text)[0][2])


def _headings(text: str) -> list[tuple[str, int, dict[str, int]]]:
    """Name and line of every heading of a text, and lines of the keys below; first those below none."""
    found: list[tuple[str, int, dict[str, int]]] = [("", 0, {})]
    for number, line in enumerate(text.splitlines(), 1):
        if match := _HEADING.match(line):
            found.append((match[1], number, {}))
        elif match := _KEY.match(line):
            found[-1][2].setdefault(match[1], number)
    return found
