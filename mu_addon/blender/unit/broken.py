"""A broken rule for the panel: the fault, its fields, and valid values."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

import attrs

from ...design.parameters import SECTIONS, Unit
from ...design.quantity import describe
from ...design.repairs import Repair, nearest_fit, repairs
from ...errors import InputError, MuError
from ..shared.blender_property import exact
from ..shared.wording import in_panel
from .properties import section_of, to_unit

Place = tuple[str, str]
_PLACES = {(section.section, d.name) for section in SECTIONS for d in describe(section)}


@attrs.frozen
class Broken:
    """A broken rule and its remedy, a line each; fits: the valid value of each field, or None.

    repairs: every broken rule, in order, with the value that repairs it.
    """

    text: str
    fits: dict[Place, float | int | None]
    repairs: list[Repair] = attrs.field(factory=list)

    def blames(self, sections: Collection[str]) -> bool:
        """Return True if a parameter of one of these sections breaks a rule."""
        places = (*self.fits, *((repair.section, "") for repair in self.repairs))
        return any(section in sections for section, _ in places)


_good: dict[str, Unit] = {}
"""By UUID: the last valid design in this session."""
_found: dict[str, tuple[Any, Broken]] = {}
"""By UUID: the last result, with its parameters."""


def keep(root: Any, unit: Unit) -> None:
    """Store a valid design: a later difference from it is blamed for a broken rule."""
    _good[root.mu_unit.uuid] = unit


def words(error: MuError) -> str:
    """Text of an error, with parameters by the names of their fields, and true lengths."""
    true = getattr(error, "true_size", None) or error
    lines = [true.what] if isinstance(error, InputError) and _places(error.where) else [true.what, true.where]
    return "\n".join(in_panel(text) for text in (*lines, true.remedy) if text)


def _places(where: str) -> list[Place]:
    """Parameters named by the `where` of a rule: "[chambers] wall_mm"."""
    found = re.match(r"\[(\w+)\] (.+)", where)
    named = [(found[1], name.strip()) for name in found[2].split(",")] if found else []
    return [place for place in named if place in _PLACES]


def broken(root: Any) -> Broken | None:
    """Rule that a unit's parameters break, or None; evaluated again only where they changed."""
    props = root.mu_unit
    if not props.trouble:
        return None
    values = {s.section: section_of(props, s.section) for s in SECTIONS}
    key = exact(props.scale), repr(values), props.trouble
    kept = _found.get(props.uuid)
    if kept is None or kept[0] != key:
        kept = _found[props.uuid] = key, _look(props, values)
    return kept[1]


def _look(props: Any, values: dict[str, dict[str, Any]]) -> Broken:
    try:
        to_unit(props)
    except InputError as error:
        named = _places(error.where)
        places = dict.fromkeys(named)
        good = _good.get(props.uuid)
        if good is not None:
            for section, own in values.items():
                for name, value in own.items():
                    if value != getattr(getattr(good, section), name):
                        places[section, name] = None
        try:
            sections = {s.section: s(**values[s.section]) for s in SECTIONS}
        except InputError:
            return Broken(words(error), places)
        scale = exact(props.scale)
        fits = {place: nearest_fit(sections, scale, *place) for place in places}
        # A changed parameter that cannot repair anything is not blamed: its field would be red for no reason.
        fits = {place: value for place, value in fits.items() if value is not None or place in named}
        mending = repairs(sections, scale)
        # Every fault is red in its field, with the same button as in the panel's head.
        fits |= {(r.section, r.name): r.value for r in mending if r.value is not None}
        return Broken(words(error), fits, mending)
    return Broken(props.trouble, {})


def forget() -> None:
    """Drop every design, as another file is open."""
    _good.clear()
    _found.clear()
