"""TOML whose errors give line numbers, and tables of described values with comments."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from ..errors import InputError, did_you_mean
from ..reading import parse_toml
from ..toml_writer import Commented, toml_text, toml_value
from .quantity import Description


def parse(text: str, keys: Mapping[str, Sequence[str]], origin: str) -> dict[str, Any]:
    """The document of a TOML text, whose tables and keys must be among `keys`; table "" is the top level.

    origin: name of the file, for messages. Raises InputError with file, line and the nearest known key.
    """
    document = parse_toml(text, origin)
    for key, value in document.items():
        if isinstance(value, dict) and key in keys:
            for inner in value:
                if inner not in keys[key]:
                    raise _unknown(f"[{key}] {inner}", inner, keys[key], keys, text, origin)
        elif key in keys or isinstance(value, dict):
            if key in keys:
                remedy = f"write it as a table, [{key}]"
                raise InputError(f"{key} is not a table", place(origin, line_of(text, key)), remedy)
            raise _unknown(f"[{key}]", key, [k for k in keys if k], keys, text, origin)
        elif key not in keys[""]:
            raise _unknown(key, key, keys[""], keys, text, origin)
    return document


def compose(
    head: Mapping[str, Any], tables: Mapping[str, Sequence[tuple[Description, Any]]], comments: bool
) -> str:
    """TOML text of top-level values and of tables of described values, by name of the table.

    comments: write meaning, unit and source above each value.
    """
    return toml_text(
        {
            **head,
            **{
                name: {d.name: Commented(value, _notes(d, value) if comments else ()) for d, value in rows}
                for name, rows in tables.items()
            },
        }
    )


def _notes(d: Description, value: Any) -> tuple[str, ...]:
    """Comment lines: meaning, unit and source of a value, and the default where it is another."""
    default = "" if value == d.default else f" (of the default, {toml_value(d.default)})"
    note = f"{d.text}{f', in {d.unit}' if d.unit else ''}; {d.source}{default}"
    return tuple(textwrap.wrap(note, 100, initial_indent="# ", subsequent_indent="#   "))


@contextmanager
def located(text: str, origin: str) -> Iterator[None]:
    """Context that adds file and line to an InputError which names a key as `[section] key`."""
    try:
        yield
    except InputError as error:
        line = line_of(text, error.where)
        raise InputError(error.what, f"{place(origin, line)}, {error.where}", error.remedy) from error


def line_of(text: str, where: str) -> int | None:
    """Number, from 1, of the line with `[section] key`, `[section]` or `key`; None if there is none."""
    match = re.fullmatch(r"(?:\[(\w+)\])?\s*(.*)", where)
    wanted, key = (match[1] or "", match[2]) if match else ("", where)
    section = ""
    for number, line in enumerate(text.splitlines(), 1):
        header = re.match(r"\s*\[\s*([\w.-]+)\s*\]", line)
        if header:
            section = header[1]
            if section == wanted and not key:
                return number
        elif key and section == wanted and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return number
    return None


def place(origin: str, line: int | None) -> str:
    """`file, line n` as far as both are known, else "TOML text"."""
    parts = [part for part in (origin, f"line {line}" if line else "") if part]
    return ", ".join(parts) or "TOML text"


def _unknown(
    where: str, key: str, here: Sequence[str], keys: Mapping[str, Sequence[str]], text: str, origin: str
) -> InputError:
    elsewhere = [table for table, names in keys.items() if key in names]
    if elsewhere:
        hint = f"; it belongs {f'in [{elsewhere[0]}]' if elsewhere[0] else 'at the top level'}"
    else:
        hint = did_you_mean(key, here)
    return InputError(
        f"unknown key {key!r}{hint}",
        f"{place(origin, line_of(text, where))}, {where}",
        f"known here: {', '.join(here)}",
    )
