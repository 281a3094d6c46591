"""Tables of TOML files, read as what declares them; a fault says file, line and key.

table = read_toml(path, "ring", "give a ring.toml").of_format(1)
ring = table.made(Ring)                  # an attrs class: keys, types and bounds are those of its fields
wall = table.inner("wall").number("thickness_mm", 0.1, 10.0)
"""

from __future__ import annotations

import math
import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar, Union

import attrs

from .errors import InputError, did_you_mean
from .reading import parse_toml, text_in

# What fields of these types hold is checked by their converter or validator, if they have one.
_PLAIN = {float: "a number", int: "a whole number", str: "text in quotes", bool: "true or false"}
_SEVERAL = {float: "numbers", int: "whole numbers", str: "texts in quotes"}
Made = TypeVar("Made")


@attrs.frozen
class TomlTable:
    """A table of a TOML document, the document itself if `name` is empty.

    origin: name of the file; text: its content, for lines; name: dotted; nth: from 1, of one of several
    tables of the name, as [[name]].
    """

    values: Mapping[str, Any]
    origin: str = ""
    text: str = ""
    name: str = ""
    nth: int = 0

    def at(self, key: str = "", name: str | None = None) -> str:
        """File, line and name of a key, or of the table; name: of another table."""
        name = self.name if name is None else name
        number = self.nth if name == self.name else 0
        line = _line_of(self.text, name, number, key)
        if line is None and number:
            line = _line_of(self.text, name, number, "")
        elif line is None:
            line = _line_of(self.text, f"{name}.{key}" if name else key, 0, "")
        shown = f"[[{name}]] {number}" if number and not line else f"[{name}]" if name else ""
        parts = [self.origin, f"line {line}" if line else "", f"{shown} {key}".strip()]
        return ", ".join(part for part in parts if part) or "TOML text"

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def only(self, known: Sequence[str], elsewhere: Mapping[str, Sequence[str]] | None = None) -> Self:
        """The table; raises InputError for a key that is not known.

        elsewhere: keys by where they belong, "in [chambers]".
        """
        for key in self.values:
            if key not in known:
                belongs = [place for place, keys in (elsewhere or {}).items() if key in keys]
                hint = f"; it belongs {', '.join(belongs)}" if belongs else did_you_mean(key, known)
                raise InputError(
                    f"unknown key {key!r}{hint}", self.at(key), f"known here: {', '.join(known)}"
                )
        return self

    def only_tables(self, known: Mapping[str, Sequence[str]]) -> Self:
        """The document, whose tables and keys must be among `known`, by table; raises InputError."""
        places = {f"in [{name}]" if name else "at the top level": keys for name, keys in known.items()}
        for key, value in self.values.items():
            if isinstance(value, dict) and key in known:
                self.inner(key).only(known[key], places)
            elif isinstance(value, dict) and key not in known[""]:
                tables = [name for name in known if name]
                raise InputError(
                    f"unknown key {key!r}{did_you_mean(key, tables)}",
                    self.at("", key),
                    f"known here: {', '.join(tables)}",
                )
            elif key in known:
                self.inner(key)
        TomlTable({k: v for k, v in self.values.items() if k not in known}, self.origin, self.text).only(
            known[""], places
        )
        return self

    def of_format(self, known: int, remedy: str = "") -> Self:
        """The document; raises InputError where it is of another format."""
        found = self.values.get("format")
        if found is None:
            what = "the file does not say its format"
            raise InputError(what, self.at("format"), f"add format = {known} at its top")
        if found != known or isinstance(found, bool):
            remedy = remedy or f"write format = {known}; a newer version may have written the file"
            raise InputError(f"format = {found!r} is not known here", self.at("format"), remedy)
        return self

    def without(self, keys: Sequence[str], why: str) -> None:
        """Raise InputError where one of the keys is given."""
        for key in keys:
            if key in self.values:
                raise InputError(f"{why}: {key} does not apply there", self.at(key), "leave it out")

    def inner(self, key: str) -> TomlTable:
        """The table of a key, empty if it is not there; raises InputError for what is no table."""
        table = self._inner(key, self.values.get(key, {}))
        if not isinstance(table.values, Mapping):
            raise InputError(f"{key} is not a table", self.at(key), f"write it as a table, [{table.name}]")
        return table

    def tables(self, key: str) -> list[TomlTable]:
        """The tables [[key]], which may be missing; raises InputError for what is no list of tables."""
        found = self.values.get(key, [])
        if not isinstance(found, list) or not all(isinstance(one, Mapping) for one in found):
            raise InputError(f"{key} is not a list of tables", self.at(key), f"begin each with [[{key}]]")
        return [TomlTable(one, self.origin, self.text, key, n) for n, one in enumerate(found, 1)]

    def take(self, key: str, hint: Any, default: Any = attrs.NOTHING) -> Any:
        """The value of a key as a type, the default if it is not there; raises InputError."""
        if key in self.values:
            return self._value(hint, self.values[key], key)
        if default is attrs.NOTHING:
            raise InputError(f"{key} is missing", self.at(key), f"write {key} = ..: {_words(hint)}")
        return default

    def word(self, key: str, choices: Sequence[str] = (), default: Any = attrs.NOTHING) -> Any:
        """A text that is not empty, one of the choices if there are any; raises InputError."""
        value = self.take(key, str, default)
        if key in self.values and not value.strip():
            raise InputError(f"{key} = {value!r} is empty", self.at(key), f'write {key} = "..."')
        return self._one_of(key, value, choices) if choices and key in self.values else value

    def words(self, key: str, choices: Sequence[str] = ()) -> tuple[str, ...]:
        """A list of texts, empty if it is not there, of the choices if there are any; raises InputError."""
        found: tuple[str, ...] = self.take(key, tuple[str, ...], ())
        return tuple(self._one_of(key, word, choices) for word in found) if choices else found

    def _one_of(self, key: str, value: str, choices: Sequence[str]) -> str:
        if value in choices:
            return value
        what = f"{key} = {value!r} is not known{did_you_mean(value, choices)}"
        raise InputError(what, self.at(key), f"choose one of {', '.join(choices)}")

    def number(
        self,
        key: str,
        low: float = -math.inf,
        high: float = math.inf,
        default: Any = attrs.NOTHING,
        above: bool = False,
    ) -> Any:
        """A finite number within bounds; above: low is none of them. Raises InputError."""
        value = self.take(key, float, default)
        return value if key not in self.values else self.bounded(key, value, low, high, above)

    def bounded(self, key: str, value: float, low: float, high: float, above: bool = False) -> float:
        """A key's number; raises InputError where it is out of bounds."""
        if not math.isfinite(value):
            raise InputError(f"{key} = {value:g} is not a finite number", self.at(key), "give a number")
        if not low <= value <= high or (above and value == low):
            range_ = f"above {low:g}, up to {high:g}" if above else f"from {low:g} to {high:g}"
            raise InputError(f"{key} = {value:g} is out of bounds", self.at(key), f"give a number {range_}")
        return value

    def setting(self, described: Any, default: Any = None) -> Any:
        """The value of a setting by its description (`design.quantity.Description`); raises InputError."""
        with self.located():
            return described.checked(
                self.values.get(described.name, described.default if default is None else default)
            )

    def made(self, kind: type[Made], **given: Any) -> Made:
        """An instance of an attrs class, each value of the type of its field.

        given: values in addition to those of the table. Tables become classes, arrays tuples, and integers
        floats where the class has a float. Raises InputError.
        """
        hints = typing.get_type_hints(kind)
        fields = {f.alias: f for f in attrs.fields(kind) if f.init and f.alias not in given}  # type: ignore[arg-type]
        self.only(list(fields))
        values = {key: self._of_field(fields[key], hints, value) for key, value in self.values.items()}
        for key, field in fields.items():
            if field.default is attrs.NOTHING and key not in values:
                self.take(key, hints[field.name])
        with self.located():
            return kind(**values, **given)

    def _of_field(self, field: Any, hints: Mapping[str, Any], value: Any) -> Any:
        hint = hints[field.name]
        checks_itself = hint in _PLAIN and (field.converter is not None or field.validator is not None)
        return value if checks_itself else self._value(hint, value, field.alias)

    @contextmanager
    def located(self) -> Iterator[None]:
        """Context that gives an InputError on a key, as `key` or `[section] key`, its place."""
        try:
            yield
        except InputError as error:
            match = re.fullmatch(r"(?:\[([\w.]+)\] ?)?([\w.-]*)", error.where)
            if self.origin and error.where.startswith(self.origin):
                raise
            where = self.at(match[2], match[1]) if match else f"{self.at()}, {error.where}"
            raise InputError(error.what, where, error.remedy) from error
        except (TypeError, ValueError) as error:
            what = f"a value is not offered: {error.args[0]}"
            raise InputError(what, self.at(), "correct that key") from error

    def _value(self, hint: Any, value: Any, key: str) -> Any:
        """A value of TOML as a type; key: its name, with its place in a list."""
        origin, inner = typing.get_origin(hint), typing.get_args(hint)
        if origin in (Union, types.UnionType):
            hint = next(option for option in inner if option is not type(None))
            return self._value(hint, value, key)
        if hint is Any or (origin is typing.Literal and value in inner):
            return value
        if origin is tuple and isinstance(value, list):
            each = [inner[0]] * len(value) if inner[-1] is Ellipsis else list(inner)
            if len(each) == len(value):
                items = enumerate(zip(each, value, strict=True))
                return tuple(self._value(h, v, f"{key}[{i}]") for i, (h, v) in items)
        if origin in (dict, Mapping) and isinstance(value, Mapping):
            return {name: self._inner(key, value)._value(inner[1], one, name) for name, one in value.items()}
        if attrs.has(hint):
            if not isinstance(value, Mapping):
                raise InputError(f"{value!r} is not a table", self.at(key), "write it as a table")
            return self._inner(key, value).made(hint)
        if hint is float and type(value) is int:
            return float(value)
        if hint in _PLAIN and type(value) is hint:
            return value
        words = _words(hint)
        fault = f"is not {words}" if hint in _PLAIN or origin is tuple else "does not fit"
        raise InputError(f"{key} = {value!r} {fault}", self.at(key), f"give {words}")

    def _inner(self, key: str, values: Mapping[str, Any]) -> TomlTable:
        name = f"{self.name}.{key}" if self.name else key
        return TomlTable(values, self.origin, self.text, name, self.nth)


def _words(hint: Any) -> str:
    """What a value of a type is, as text."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is tuple:
        count = "" if inner[-1] is Ellipsis else f"{len(inner)} "
        return f"a list of {count}{_SEVERAL.get(inner[0], 'values')}"
    if origin is typing.Literal:
        return " or ".join(map(repr, inner))
    if origin in (dict, Mapping) or attrs.has(hint):
        return "a table"
    return _PLAIN.get(hint, "the value that a run writes there")


def _line_of(text: str, name: str, number: int, key: str) -> int | None:
    """Number, from 1, of the line with a key of the n-th table of a name, or with the table; None without.

    A table within a line has that line.
    """
    if not text or not (name or key):
        return None
    key = re.split(r"[\[.]", key)[0]
    inside, count = name == "", 0
    for line, words in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[+\s*([\w.-]+)\s*\]", words):
            inside = header[1] == name
            count += inside
            inside = inside and count == (number or 1)
            if inside and not key:
                return line
        elif inside and key and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", words):
            return line
    before, dot, last = name.rpartition(".")
    return _line_of(text, before, number, last) if dot and not count else None


def read_toml(path: Path, what: str = "inputs", remedy: str = "choose another folder") -> TomlTable:
    """The document of a TOML file; raises InputError. what, remedy: of a file that cannot be read."""
    return parsed_toml(text_in(path, what, remedy), str(path))


def parsed_toml(text: str, origin: str, remedy: str = "correct that line") -> TomlTable:
    """The document of TOML text; origin: name of the file. Raises InputError."""
    return TomlTable(parse_toml(text, origin, remedy), origin, text)
