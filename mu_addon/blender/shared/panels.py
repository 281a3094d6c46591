"""Base classes of the panels in the sidebar tab MU, and drawing shared by several of them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Any, NamedTuple

from ...design.quantity import Description
from .blender_property import described_fields
from .updates import Signal
from .wording import heading

CHARACTERS = 34
"""Letters in one line of a panel of usual width: labels do not wrap."""
_AMOUNT = re.compile(r"(?<=\d) (?=%|(?:mm|kPa|N|s|min|h|MB|GB)\b)")
_HARD_SPACE = "\N{NO-BREAK SPACE}"


class TabPanel:
    """A panel in the sidebar tab MU."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "MU"


class RootPanel(TabPanel):
    """A panel of the active root object, see `find_root`; `show(layout, context, root)` fills it."""

    @classmethod
    def shows(cls, root) -> bool:
        """Return False while the panel has nothing to show of `root`."""
        return True

    @classmethod
    def poll(cls, context):
        root = cls.find_root(context)
        return root is not None and cls.shows(root)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.show(layout, context, self.find_root(context))


def wrapped(layout, text: str, icon: str = "NONE", width: int = CHARACTERS) -> None:
    """Draw labels that show a text in several lines; no line ends between a number and its unit."""
    column = layout.column(align=True)
    column.scale_y = 0.85
    for paragraph in text.split("\n"):
        for line in textwrap.wrap(_AMOUNT.sub(_HARD_SPACE, paragraph), width) or [""]:
            column.label(text=line.replace(_HARD_SPACE, " "), icon=icon)
            icon = "BLANK1" if icon != "NONE" else "NONE"


def alert(layout, text: str, icon: str = "ERROR"):
    """Draw a red box with a text; return the box."""
    box = layout.box()
    box.alert = True
    wrapped(box, text, icon)
    return box


NEXT_STEP = Signal()
"""Asked with a unit: the operator that the top of the sidebar offers as its next step, or ""."""


def large_button(layout, operator: str, icon: str, root=None, **settings) -> None:
    """Draw the main button of a panel or, where the top of the sidebar offers it for `root`, say so."""
    row = layout.row()
    if root is not None and operator in NEXT_STEP.answers(root):
        row.label(text="The button is at the top", icon="TRIA_UP")
        return
    row.scale_y = 1.4
    row.operator(operator, icon=icon, **settings)


def fold(layout, name: str, title: str, wrong: bool = False, icon: str = "NONE", closed: bool = True):
    """Draw a fold, with a red head if something in it is wrong; return its layout, None if closed."""
    header, body = layout.panel(name, default_closed=closed)
    header.alert = wrong
    header.label(text=title, icon="ERROR" if wrong else icon)
    return body


class Field(NamedTuple):
    """A setting in a panel: its description, what draws it into a layout, True if its value breaks a rule."""

    description: Description
    draw: Callable[[Any], object]
    wrong: bool = False


def draw_settings(layout, fields: Iterable[Field], enabled: bool = True) -> dict[str, Any]:
    """Draw usual settings, then a fold for each group of advanced ones; return the open folds by title.

    layout: as wide as its panel, as Blender's folds need it.
    """
    groups: dict[str, list[Field]] = {"": []}
    for one in fields:
        groups.setdefault(one.description.group, []).append(one)
    found = {}
    for title, inside in groups.items():
        body = layout
        if title:
            body = fold(layout, f"MU_{title}", heading(title), any(one.wrong for one in inside))
        if body:
            found[title], column = body, body.column(align=True)
            column.enabled = enabled
            for one in inside:
                one.draw(column)
    return found


def fields_of(owner, hidden: Collection[str] = ()) -> list[Field]:
    """The settings of a property group, in its order, without hidden ones."""
    shown = {name: d for name, d in described_fields(owner).items() if name not in hidden}
    return [field_of(owner, name, d) for name, d in shown.items()]


def field_of(owner, name: str, d: Description) -> Field:
    """A setting that is drawn as the property of this name."""
    return Field(d, partial(_draw, owner=owner, name=name))


def _draw(layout, owner, name: str) -> None:
    layout.prop(owner, name)


def plain_row(layout, align: bool = True):
    """A row whose fields have no labels beside them."""
    row = layout.row(align=align)
    row.use_property_split = False
    return row
