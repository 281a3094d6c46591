"""TOML text of tables of described values, with comments."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from ..toml_writer import Commented, toml_text, toml_value
from .quantity import Description


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
