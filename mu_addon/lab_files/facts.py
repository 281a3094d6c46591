"""Sizes and names of a specimen in the lines above its table."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping

from ..table_cells.notation import number
from .proposal import Proposal
from .units import unit_of

_LENGTH = re.compile(
    r"gau?ge length|dimension\W+length|grip separation|messlange|einspannlange|anfangslange|initial length|"
    r"specimen length|\bheight\b|\bhohe\b|probenhohe|longueur|lunghezza|longitud|\bl0\b"
)
_WIDTH = re.compile(r"width|breite|largeur|larghezza|anchura|szerokosc|\bb0\b")
_THICKNESS = re.compile(r"thickness|dicke|epaisseur|spessore|espesor|grubosc|\ba0\b")
_DIAMETER = re.compile(r"diameter|durchmesser|diametre|diametro|srednica|\bd0\b")
_AREA = re.compile(r"\barea\b|querschnitt|section area|\bs0\b|aire\b")
_SECTION = re.compile(r"section|querschnitt")
_NAME = re.compile(
    r"specimen (label|name|id)|sample (name|id)|probenbezeichnung|probenname|specimen$|sample$|probe$"
)
# In a line of text a number and its unit follow its name at once.
_NUMBER = r"([-+]?\d[\d.,]*)"
_BRACKET = r"[(\[]([^()\[\]]+)[)\]]"
_BEHIND = re.compile(
    rf"[\s:;=,]*(?:[a-z]\d?\b[\s:;=]*)?(?:of |is |{_BRACKET}[\s:;=]*)?{_NUMBER}[\s;]*([^\s\d,;.)]+\d?)?"
)
_PAIR = re.compile(rf"\D{{0,20}}?{_NUMBER}\s*[x\u00d7*]\s*{_NUMBER}\s*(\w+)\s*$")

Facts = Mapping[str, tuple[str, ...]]


def specimen(draft: Proposal) -> str:
    """Name of the specimen in the file, "" without one."""
    facts = draft.block.facts.items()
    return next((cells[0] for key, cells in facts if cells and _NAME.search(key)), "")


def section_mm(draft: Proposal) -> tuple[Proposal, list[float] | None]:
    """Width and thickness in mm by an answer or the file; a round section as a square of equal area."""
    lines, decimal = draft.block.facts, draft.block.decimal
    if "section_mm" in draft.answers:
        return draft, draft.numbers("section_mm", (2,))
    width, thickness, diameter, area = (
        _size_mm(lines, pattern, decimal) for pattern in (_WIDTH, _THICKNESS, _DIAMETER, _AREA)
    )
    pair = [width, thickness] if width and thickness else _pair_mm(lines, _SECTION, decimal)
    if pair:
        return draft.concluding(f"section of {pair[0]:g} x {pair[1]:g} mm, as the file says"), pair
    if not (area or diameter):
        return draft, None
    words = f"of {area:g} mm2" if area else f"round, {diameter:g} mm"
    side = round(math.sqrt(area or 0.25 * math.pi * (diameter or 0.0) ** 2), 6)
    words = f"section {words}, as the file says: given as a square of that area"
    return draft.concluding(words), [side, side]


def length_mm(draft: Proposal) -> tuple[Proposal, float | None]:
    """Length in mm by an answer or the file."""
    answered = draft.positive("length_mm")
    length = answered or _size_mm(draft.block.facts, _LENGTH, draft.block.decimal)
    if length and not answered:
        draft = draft.concluding(f"length of {length:g} mm, as the file says")
    return draft, length


def _size_mm(facts: Facts, pattern: re.Pattern[str], decimal: str) -> float | None:
    """A positive length in mm, or area in mm2, that the lines state; None without it or its unit."""
    for key, cells, text, end in _named(facts, pattern):
        value = None
        if cells and end <= len(key):
            unit = cells[1] if len(cells) > 1 else (re.search(_BRACKET, key) or ["", key[end:]])[1]
            value = _in_mm(cells[0], unit, decimal)
        behind = _BEHIND.match(text, end)
        if value is None and behind:
            value = _in_mm(behind[2].rstrip(".,"), behind[3] or behind[1] or "", decimal)
        if value is not None:
            return value
    return None


def _pair_mm(facts: Facts, pattern: re.Pattern[str], decimal: str) -> list[float] | None:
    """Two lengths in mm as in "section: 10 x 2 mm"; None without them."""
    for *_, text, end in _named(facts, pattern):
        if both := _PAIR.match(text, end):
            values = [value for side in both.group(1, 2) if (value := _in_mm(side, both[3], decimal))]
            if len(values) == 2:
                return values
    return None


def _named(facts: Facts, pattern: re.Pattern[str]) -> Iterator[tuple[str, tuple[str, ...], str, int]]:
    """Lines that have a name: their key, cells and text, and where the name ends in it."""
    for key, cells in facts.items():
        text = " ".join((key, *cells))
        if found := pattern.search(text):
            yield key, cells, text, found.end()


def _in_mm(text: str, unit: str, decimal: str) -> float | None:
    value = number(text, decimal)
    unit = unit.strip().replace("\u00b2", "2")
    squared = unit.endswith("2")
    known = unit_of(unit.removesuffix("2").removesuffix("^")) if unit else None
    if value is None or not value > 0 or not known or known[0] != "mm":
        return None
    return float(value * (known[1] ** 2 if squared else known[1]))
