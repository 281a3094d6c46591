"""Parameters with their unit, bounds, meaning and source, for panels, files and reports."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import attrs

from ..errors import InputError, did_you_mean

if TYPE_CHECKING:
    # The command line's --help reads settings, and must be fast.
    import numpy as np

PAPER = "paper"

Number = TypeVar("Number", float, "np.ndarray[Any, Any]")
Groups = Mapping[str, tuple[str, ...]]
"""Names of the advanced parameters of a section by the title of their group; none for all of the section."""


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
    text (of type str) neither. group: of an advanced one, the title below which help and panels fold it; ""
    of a usual one.
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
    group: str = ""

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
        if self.type is int and isinstance(value, float) and value.is_integer():
            value = int(value)
        return self.required(value)

    def required(self, value: Any) -> Any:
        """As `checked`, but a fraction is no whole number, whatever its value."""
        if self.type is float and isinstance(value, (int, float)) and not isinstance(value, bool):
            try:
                value = float(value)
            except OverflowError:
                value = math.inf
        if type(value) is not self.type:
            words = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
            raise InputError(
                f"{self.name} = {value!r} is not {words[self.type]}",
                self.name,
                _correction(value, self.type, self.unit, self.text),
            )
        if self.choices and value not in self.choices:
            hint = did_you_mean(str(value), self.choices)
            what = f"{self.name} = {value!r} is not known{hint}"
            raise InputError(what, self.name, f"choose {self.allowed}")
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
    group: str = "",
) -> Description:
    """A setting of a job, stated once: its field, option, property and node setting are made from this."""
    return Description(name, type(default), default, unit, low, high, text, "", False, choices, group)


def quantity(
    default: Any, unit: str, low: float, high: float, text: str, source: str, fixed: bool = False
) -> Any:
    """attrs field of a parameter with bounds low and high in `unit`; "" is the unit of counts and flags.

    The arguments are those of `Description`. Setting a value of another type or out of bounds raises
    InputError.
    """
    return _parameter(Description("", type(default), default, unit, low, high, text, source, fixed))


def choice(default: str, names: Callable[[], Sequence[str]], text: str, source: str) -> Any:
    """attrs field of a parameter that is one of `names()`, which is called whenever a value is checked.

    Setting another value raises InputError.
    """
    return _parameter(_of_text(default, text, source), names)


def text_quantity(default: str, canonical: Callable[[str], str], text: str, source: str) -> Any:
    """attrs field of a parameter that is a text in a given form, such as a list of entries.

    canonical: one text for all with the same meaning; raises InputError for an invalid one. Setting anything
    but a text raises InputError.
    """
    return _parameter(_of_text(default, text, source), canonical=canonical)


def _of_text(default: str, text: str, source: str) -> Description:
    return Description("", str, default, "", math.nan, math.nan, text, source, False)


def _parameter(
    described: Description,
    names: Callable[[], Sequence[str]] = tuple,
    canonical: Callable[[Any], Any] = lambda value: value,
) -> Any:
    def checked(value: Any, instance: Any, field: Any) -> Any:
        try:
            value = _of_field(field).required(value)
        except InputError as error:
            raise InputError(error.what, where(instance, field.name), error.remedy) from error
        return canonical(value)

    converter: Any = attrs.Converter(checked, takes_self=True, takes_field=True)
    metadata = {"described": described, "names": names}
    return attrs.field(default=described.default, metadata=metadata, converter=converter)


def _of_field(field: Any, group: str = "") -> Description:
    described, names = field.metadata["described"], field.metadata["names"]
    found: Description = described._replace(name=field.name, choices=tuple(names()), group=group)
    return found


def describe(section: type) -> Iterator[Description]:
    """Descriptions of the parameters of an attrs class, in order; fields without a source are left out.

    Its `advanced`, of type `Groups`, says which of them have a group.
    """
    groups = _groups(section)
    fields = attrs.fields(section)
    return (_of_field(f, groups.get(f.name, "")) for f in fields if "described" in f.metadata)


@cache
def _groups(section: type) -> dict[str, str]:
    """Group of each advanced parameter of a class, by name."""
    every = [f.name for f in attrs.fields(section)]
    advanced: Groups = getattr(section, "advanced", {})
    return {name: title for title, names in advanced.items() for name in names or every}


def where(instance: Any, name: str) -> str:
    """A parameter's name as it is written in a file: `[section] name`, or `name` at the top level."""
    section = getattr(type(instance), "section", "")
    return f"[{section}] {name}" if section else name


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
