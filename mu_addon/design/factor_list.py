"""Texts of factors by place, as "0 2 *: 0.8; 1 2 3: 1.2": of struts by cell, of walls by chamber."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import attrs

from ..errors import InputError

LEAST, MOST = 0.5, 2.0
"""Bounds of every factor."""
_PLACE = {"number": r"\d{1,4}", "number or *": r"\*|\d{1,4}", "whole or *": r"\*|-?\d{1,4}"}

Place = tuple[int | None, ...]


@attrs.frozen
class FactorList:
    """A parameter of a unit, by section and key, that is such a text.

    words: kinds of a place's numbers, of which * is all (None); what: an entry, with its article; example: of
    a place.
    """

    section: str
    key: str
    words: tuple[str, ...]
    what: str
    example: str

    def parsed(self, text: str) -> dict[Place, float]:
        """Factors other than 1 by their place, in one order; raises InputError."""
        places = r"\s+".join(f"({_PLACE[word]})" for word in self.words)
        found: dict[Place, float] = {}
        for entry in filter(str.strip, text.split(";")):
            match = re.fullmatch(rf"\s*{places}\s*:\s*(\S{{1,40}})\s*", entry)
            try:
                factor = float(match[len(self.words) + 1]) if match else math.nan
            except ValueError:
                factor = math.nan
            shown = repr(entry.strip()[:40])
            if match is None or not math.isfinite(factor):
                raise self.refused(f"{shown} is not {self.what}", f'write "{self.example}: 0.8"')
            if not LEAST <= factor <= MOST:
                raise self.refused(
                    f"the factor {factor:g} of {shown} is out of bounds",
                    f"choose a value from {LEAST:g} to {MOST:g}",
                )
            place = tuple(None if word == "*" else int(word) for word in match.groups()[:-1])
            if place in found:
                raise self.refused(
                    f"{self.key} lists {entry.split(':')[0].strip()!r} twice", "give each entry once"
                )
            found[place] = factor
        order = sorted(found, key=lambda place: tuple((n is not None, n or 0) for n in place))
        return {place: found[place] for place in order if found[place] != 1.0}

    def text(self, factors: Mapping[Place, float]) -> str:
        """The text of factors by their place, in the given order, as `parsed` takes it."""
        return "; ".join(f"{place_text(p)}: {float(f)!r}" for p, f in factors.items() if f != 1.0)

    def canonical(self, text: str) -> str:
        """One text for all with the same meaning; raises InputError."""
        return self.text(self.parsed(text))

    def place(self, text: str) -> Place:
        """The place of a text without a factor; raises InputError."""
        # Any factor but 1, which would be no entry.
        [found] = self.parsed(f"{text}: 1.5" if ";" not in text else "?")
        return found

    def refused(self, what: str, remedy: str) -> InputError:
        """The error of the parameter."""
        return InputError(what, f"[{self.section}] {self.key}", remedy)


def place_text(place: Place) -> str:
    """A place as it is written: "0 2 *"."""
    return " ".join("*" if number is None else str(number) for number in place)
