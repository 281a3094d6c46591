"""Parameters with their unit, bounds, meaning and source, for panels, files and reports."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import attrs

from ..errors import InputError, did_you_mean

if TYPE_CHECKING:
    # The command line's --help reads settings, and must be fast.
    import numpy as np

PAPER = "paper"

Number = TypeVar("Number", float, "np.ndarray[Any, Any]")


def in_MPa(value_kPa: Number) -> Number:
    """Convert a pressure, stress or modulus from kPa (files, panels) to MPa (mechanics).

    >>> in_MPa(50.0)
    0.05
    """
    return value_kPa / 1e3


def in_kPa(value_MPa: Number) -> Number:
    """Convert a pressure, stress or modulus from MPa (mechanics) to kPa (files, panels).

    >>> in_kPa(0.05)
    50.0
    """
    return value_MPa * 1e3


class Description(NamedTuple):
    """Description of one parameter: type, default, unit, closed bounds in that unit, meaning and source.

    fixed: it is a length that is the same at every scale. A choice among names has `choices` and no bounds, a
    text (of type str) neither.
    """

    name: str
    type: type
    default: Any
    unit: str
    low: float
    high: float
    text: str
    source: str
    fixed: bool
    choices: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """The bounds or the choices as text; "" for a flag or a text."""
        if self.type is bool or (self.type is str and not self.choices):
            return ""
        return " or ".join(self.choices) if self.choices else f"{self.low:.8g} to {self.high:.8g}"

    @property
    def assumed(self) -> bool:
        """True if the source paper gives no value."""
        return self.source.startswith("assumed")

    def checked(self, value: Any) -> Any:
        """The value as its type; raises InputError for another type, a value out of bounds, no choice."""
        if self.type is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if self.type is int and isinstance(value, float) and value.is_integer():
            value = int(value)
        if type(value) is not self.type:
            words = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
            raise InputError(
                f"{self.name} = {value!r} is not {words[self.type]}",
                self.name,
                _correction(value, self.type, self.unit, self.text),
            )
        if self.choices and value not in self.choices:
            raise InputError(f"{self.name} = {value!r} is not known", self.name, f"choose {self.allowed}")
        if self._is_out_of_bounds(value):
            unit = f" {self.unit}" if self.unit else ""
            shown = f"{value:g}" if self.type is float else value
            raise InputError(
                f"{self.name} = {shown}{unit} is out of bounds", self.name, f"choose {self.allowed}{unit}"
            )
        return value

    def _is_out_of_bounds(self, value: Any) -> bool:
        if self.type not in (int, float):
            return False
        bounded = math.isfinite(value) or value == self.high
        return not (bounded and self.low <= value <= self.high)

    def field(self) -> Any:
        """The attrs field of a job that has this setting."""
        return attrs.field(default=self.default, converter=self.checked)


def described(
    name: str,
    default: Any,
    text: str,
    *,
    unit: str = "",
    low: float = math.nan,
    high: float = math.nan,
    choices: tuple[str, ...] = (),
) -> Description:
    """A setting of a job, stated once: its field, option, property and node setting are made from this."""
    return Description(name, type(default), default, unit, low, high, text, "", False, choices)


def quantity(
    default: Any, unit: str, low: float, high: float, text: str, source: str, fixed: bool = False
) -> Any:
    """attrs field of a parameter with bounds low and high in `unit`; "" is the unit of counts and flags.

    The arguments are those of `Description`. Setting a value of another type or out of bounds raises
    InputError.
    """
    kind = type(default)
    metadata = {
        "type": kind,
        "unit": unit,
        "low": low,
        "high": high,
        "text": text,
        "source": source,
        "fixed": fixed,
    }
    return attrs.field(
        default=default, metadata=metadata, converter=_real if kind is float else None, validator=_check
    )


def choice(default: str, names: Callable[[], Sequence[str]], text: str, source: str) -> Any:
    """attrs field of a parameter that is one of `names()`, which is called whenever a value is checked.

    Setting another value raises InputError.
    """
    metadata = {
        "type": str,
        "unit": "",
        "low": math.nan,
        "high": math.nan,
        "text": text,
        "source": source,
        "fixed": False,
        "names": names,
    }
    return attrs.field(default=default, metadata=metadata, validator=_check_choice)


def text_quantity(default: str, canonical: Callable[[str], str], text: str, source: str) -> Any:
    """attrs field of a parameter that is a text in a given form, such as a list of entries.

    canonical: one text for all with the same meaning; raises InputError for an invalid one. Setting anything
    but a text raises InputError.
    """
    metadata = {
        "type": str,
        "unit": "",
        "low": math.nan,
        "high": math.nan,
        "text": text,
        "source": source,
        "fixed": False,
    }

    def convert(value: Any) -> Any:
        return canonical(value) if isinstance(value, str) else value

    def check(instance: Any, field: Any, value: Any) -> None:
        if not isinstance(value, str):
            raise InputError(f"{field.name} = {value!r} is not a text", where(instance, field.name), text)

    return attrs.field(default=default, metadata=metadata, converter=convert, validator=check)


def describe(section: type) -> Iterator[Description]:
    """Descriptions of the parameters of an attrs class, in order; fields without a source are left out."""
    for field in attrs.fields(section):
        if "source" in field.metadata:
            m = field.metadata
            yield Description(
                field.name,
                m["type"],
                field.default,
                m["unit"],
                m["low"],
                m["high"],
                m["text"],
                m["source"],
                m["fixed"],
                tuple(m["names"]()) if "names" in m else (),
            )


def where(instance: Any, name: str) -> str:
    """A parameter's name as it is written in a file: `[section] name`, or `name` at the top level."""
    section = getattr(type(instance), "section", "")
    return f"[{section}] {name}" if section else name


def _real(value: Any) -> Any:
    """Convert 12 and numpy's numbers to floats; anything else is left for the validator to refuse."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _correction(value: Any, kind: type, unit: str, text: str) -> str:
    """What to write in place of a value of another type; of a number in quotes, with its unit, the number."""
    number, _, given = value.strip().partition(" ") if isinstance(value, str) else ("", "", "")
    try:
        float(number)
    except ValueError:
        return text
    if kind not in (int, float) or given not in ("", unit):
        return f"{text}, in {unit}" if unit else text
    return f"write {number}, without quotes{' and unit' if given else ''}: {text}"


def _check(instance: Any, field: Any, value: Any) -> None:
    m = field.metadata
    kind, unit = m["type"], f" {m['unit']}" if m["unit"] else ""
    if type(value) is not kind:
        named = {bool: "true or false", int: "a whole number", float: "a number"}[kind]
        raise InputError(
            f"{field.name} = {value!r} is not {named}",
            where(instance, field.name),
            _correction(value, kind, m["unit"], m["text"]),
        )
    if kind is bool:
        return
    if not (math.isfinite(value) and m["low"] <= value <= m["high"]):
        raise InputError(
            f"{field.name} = {value:g}{unit} is out of bounds",
            where(instance, field.name),
            f"choose a value from {m['low']:g} to {m['high']:g}{unit}",
        )


def _check_choice(instance: Any, field: Any, value: Any) -> None:
    names = tuple(field.metadata["names"]())
    if not isinstance(value, str):
        raise InputError(
            f"{field.name} = {value!r} is not a name", where(instance, field.name), field.metadata["text"]
        )
    if value not in names:
        raise InputError(
            f"{field.name} = {value!r} is not known{did_you_mean(value, names)}",
            where(instance, field.name),
            f"choose one of {', '.join(names)}",
        )
