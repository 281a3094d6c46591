"""Base classes of operators and panels of the active unit, and the fields of its parameters in panels."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from typing import Any

from ...design.parameters import SECTIONS
from ...design.quantity import Description, describe
from ...design.wall_material import Wall, offered
from ..shared.operators import RootOperator, RootPoll
from ..shared.panels import Field, RootPanel, draw_settings
from ..shared.wording import label
from .broken import broken
from .fields import description, field, shown_value
from .object import active_root

NO_UNIT = "Select a Monolithic Unit, or add one: Add > Mesh > Monolithic Unit"
# Panel place of each section's parameters. A new section of the core appears under Design.
PLACES = {
    "chambers": "design",
    "lattice": "lattice",
    "grading": "grading",
    "waveguide": "path",
    "material": "simulate",
    "wall": "simulate",
    "print": "print",
}


class UnitPoll(RootPoll):
    """The poll of an operator on the active unit."""

    find_root = staticmethod(active_root)
    no_root = NO_UNIT


class UnitOperator(UnitPoll, RootOperator):
    """An operator that acts at once on the active unit."""


class ValidUnitOperator(UnitOperator):
    """An operator on the active unit that needs parameters within the design rules."""

    @classmethod
    def trouble(cls, root):
        broken = root.mu_unit.trouble
        return f"A design rule is broken: {broken.splitlines()[0]}" if broken else ""


class UnitPanel(RootPanel):
    """A panel of the active unit."""

    bl_parent_id = "MU_PT_unit"
    bl_options = {"DEFAULT_CLOSED"}
    find_root = staticmethod(active_root)
    place: tuple[str, ...] = ()
    """Places of `PLACES` whose parameters the panel shows."""

    def draw_header(self, context):
        """Draw a mark if one of the panel's parameters breaks a rule, also while it is closed."""
        root = self.find_root(context)
        if self.place and root is not None and _blamed(root, self.place):
            self.layout.label(text="", icon="ERROR")

    @classmethod
    def mark(cls, root) -> str:
        """Icon of the state of the panel's part of the work, at the right of its header; "" for none."""
        return ""

    def draw_header_preset(self, context):
        """Draw the state's mark, also while the panel is closed."""
        root = active_root(context)
        if root is not None and (icon := self.mark(root)):
            self.layout.label(text="", icon=icon)


DONE, OUTDATED = "CHECKMARK", "FILE_REFRESH"
"""Marks of a part of the work that is done, and of one that was done before the unit changed."""


def _blamed(root, places: Collection[str]) -> bool:
    """Return True if a parameter that is shown at one of these places breaks a rule."""
    found = broken(root)
    sections = [s.section for s in SECTIONS if PLACES.get(s.section, "design") in places]
    return found is not None and found.blames(sections)


def parameter(column, root, section: str, d: Description) -> None:
    """Draw the field of one parameter; if it breaks a rule red, with the nearest valid value as a button.

    The button is next to the field, so that nothing below it moves.
    """
    group = getattr(root.mu_unit, section)
    found = broken(root)
    if found is None or (section, d.name) not in found.fits:
        column.prop(group, field(group, d))
        return
    row = column.row(align=True)
    row.alert = True
    row.prop(group, field(group, d))
    value = found.fits[section, d.name]
    if value is not None:
        right = row.row(align=True)
        right.alert = False
        # Half as wide as the field, so that the field's unit is not cut: "2.25 m" would be metres.
        right.scale_x = 0.6
        fix_button(right, root, section, d.name, value, found.text, short=True)


def fix_button(layout, root, section: str, name: str, value, why: str, short: bool = False) -> None:
    """Draw a button that sets a parameter to a valid value: "Neck Ø 24 mm", or "→ 24" beside its field."""
    d = description(section, name)
    shown = shown_value(getattr(root.mu_unit, section), d, value)
    text = f"→ {shown.removesuffix(' mm')}" if short else f"{label(d)} {shown}"
    button = layout.operator("mu.fit", text=text)
    button.section, button.name, button.why = section, name, why


def parameters(layout, root, place: str) -> dict[str, Any]:
    """Draw fields of every section that belongs to a place, see `draw_settings`; return the open folds."""
    fields = []
    for section in SECTIONS:
        if PLACES.get(section.section, "design") == place:
            group = getattr(root.mu_unit, section.section)
            shown = offered(group.law, group.friction_share) if section is Wall else None
            every = (d for d in describe(section) if shown is None or d.name in shown)
            fields += [unit_field(root, section.section, d) for d in every]
    return draw_settings(layout, fields)


def unit_field(root, section: str, d: Description) -> Field:
    """The field of a unit's parameter."""
    found = broken(root)
    wrong = found is not None and (section, d.name) in found.fits
    return Field(d, partial(parameter, root=root, section=section, d=d), wrong)
