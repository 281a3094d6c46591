"""TOML text from plain data and comments: the library writes keys and values, the layout is made here.

A table in a table becomes `[outer.inner]`; one inside a list is written on one line. None values are left
out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs


@attrs.frozen
class Commented:
    """A value or table with comments: lines `above` it, and words `beside` a value on its line."""

    value: Any
    above: tuple[str, ...] = ()
    beside: str = ""


def toml_value(value: Any) -> str:
    """A boolean, number, text, array, or a list or table of them, on one line of TOML."""
    return str(_item(value).as_string())


def toml_key(name: str) -> str:
    """A key, quoted where needed."""
    from tomlkit.items import SingleKey

    return str(SingleKey(name).as_string())


def toml_text(values: Mapping[str, Any], head: str = "") -> str:
    """TOML text of values and tables, which may be `Commented`; head: comment lines at its beginning."""
    lines = [_comment(line) for line in head.splitlines()]
    return "\n".join([*lines, *_lines(values, ())]).lstrip("\n") + "\n"


def _lines(values: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    """Lines of a table's values, then of the tables inside it."""
    noted = {key: _noted(value) for key, value in values.items()}
    lines: list[str] = []
    for key, one in noted.items():
        if one.value is None or isinstance(one.value, Mapping):
            continue
        beside = f"  {_comment(one.beside)}" if one.beside else ""
        lines += [*map(_comment, one.above), f"{toml_key(key)} = {toml_value(one.value)}{beside}"]
    for key, one in noted.items():
        if not isinstance(one.value, Mapping):
            continue
        inner = (*path, toml_key(key))
        # A table that holds nothing but tables needs no header of its own.
        plain = not one.value or any(not isinstance(_noted(v).value, Mapping) for v in one.value.values())
        if one.above or plain:
            lines.append("")
        lines += map(_comment, one.above)
        lines += [f"[{'.'.join(inner)}]"] if plain else []
        below = _lines(one.value, inner)
        # A comment on tables stands right above the first of them.
        lines += below[1:] if one.above and not plain else below
    return lines


def _noted(value: Any) -> Commented:
    return value if isinstance(value, Commented) else Commented(value)


def _comment(line: str) -> str:
    return line if line.startswith("#") else f"# {line}".rstrip()


def _item(value: Any) -> Any:
    import tomlkit

    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        table = tomlkit.inline_table()
        for key, inner in value.items():
            table.append(key, _item(inner))
        return table
    if isinstance(value, list | tuple):
        array = tomlkit.array()
        for inner in value:
            array.append(_item(inner))
        return array
    return tomlkit.item(value)
