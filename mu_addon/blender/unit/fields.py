"""Blender properties of a unit's parameters; panels show the true length in mm."""

from collections.abc import Callable
from functools import cache
from typing import Any

import bpy

from ...design.anchors import windows
from ...design.parameters import SECTIONS
from ...design.quantity import Description, describe
from ...design.repairs import tied
from ..shared import updates
from ..shared.blender_property import Choice, blender_property, exact, millimetres, step_of
from ..shared.panels import draw_settings, field_of
from ..shared.wording import anchors_of, label, path_symbol, tooltip


def true_length(name: str, title: str, text: str, step: float) -> dict[str, Any]:
    """A field for the length `name`, in mm at scale 1, as it is at the unit's scale.

    Typed or dragged it sets that length, within its bounds.
    """

    def read(group) -> float:
        return exact(getattr(group, name)) * exact(group.id_data.mu_unit.scale)

    def write(group, value: float) -> None:
        setattr(group, name, exact(value / exact(group.id_data.mu_unit.scale)))

    shared = {"name": title, "description": text, "get": read, "set": write, "options": {"SKIP_SAVE"}}
    return {name + TRUE: millimetres(step, **shared)}


def true_scale(unit, d: Description) -> float:
    """True millimetres in a millimetre of a parameter of a unit."""
    return 1.0 if d.fixed else exact(unit.scale)


def shown_value(group, d: Description, value: float) -> str:
    """A value of a parameter as text: a length at the unit's scale."""
    if d.unit != "mm":
        return f"{value:.6g}"
    return f"{value * true_scale(group.id_data.mu_unit, d):.6g} mm"


TRUE = "_true"
"""Suffix of the name of the field of `true_length`."""


def field(group, d: Description) -> str:
    """Name of the property that a panel shows of a parameter: itself, or its true length if different."""
    scaled = d.unit == "mm" and true_scale(group.id_data.mu_unit, d) != 1.0
    return d.name + TRUE if scaled else d.name


def draw_section(layout, props, section: type) -> None:
    """Draw the fields of a section of a unit's or gripper's parameters."""
    group = getattr(props, section.section)
    draw_settings(layout, [field_of(group, field(group, d), d) for d in describe(section)])


def tied_update(name: str, changed):
    """The update of a parameter, which also changes a parameter tied to it."""
    if len(tied({name: 0.0})) == 1:
        return changed

    def update(group, context):
        if not updates.are_paused():
            with updates.paused():
                for other, value in tied({name: exact(getattr(group, name))}).items():
                    if other != name:
                        setattr(group, other, value)
        changed(group, context)

    return update


def generated_fields(section: type, changed) -> dict[str, Any]:
    """Blender properties of every parameter of a section, and of every true length."""
    annotations = {}
    for d in describe(section):
        annotations[d.name] = blender_property(d, tied_update(d.name, changed))
        if d.unit == "mm" and not d.fixed:
            annotations |= true_length(d.name, label(d), tooltip(d), step_of(d.high))
    return annotations


def generated_group(section: type, changed, prefix: str = "MU_PG_") -> type:
    """A property group of a section's parameters."""
    members = {"__annotations__": generated_fields(section, changed), "__doc__": section.__doc__}
    return type(f"{prefix}{section.section}", (bpy.types.PropertyGroup,), members)


def set_sections(props, sections, core) -> None:
    """Set the groups of these sections to the values of the core's."""
    for section in sections:
        group, values = getattr(props, section.section), getattr(core, section.section)
        for d in describe(section):
            setattr(group, d.name, getattr(values, d.name))


def description(section: str, name: str) -> Description:
    """The core's description of a unit's parameter."""
    return next(d for core in SECTIONS if core.section == section for d in describe(core) if d.name == name)


@cache
def _path_items(count: int, named: str, free: str) -> list[tuple[str, str, str, int]]:
    """Items of `path_menu`; cached, since Blender does not keep these strings alive."""
    every = {"": free} if free else {}
    every |= {w.name: f"{path_symbol(w.name)}: {anchors_of(w)}" for w in windows(count)}
    # A path that a unit of fewer chambers does not have stays until another one is chosen.
    every.setdefault(named, path_symbol(named))
    return [(name or "free", text, "", number) for number, (name, text) in enumerate(every.items())]


def path_menu(count_of: Callable[[Any], int], free: str = "") -> Any:
    """A menu of sensor paths by symbol and anchors, kept in the property `path` beside it.

    count_of: the chambers of the unit of such a group; free: title of an entry for no path, "" for none.
    """

    def items(group: Any, context: Any) -> list[tuple[str, str, str, int]]:
        return _path_items(count_of(group), group.path, free)

    def names(group: Any) -> list[str]:
        return [name if name != "free" else "" for name, *_ in items(group, None)]

    return Choice(
        "Sensor Path",
        "Anchors along which the waveguide lies",
        items=items,
        get=lambda group: names(group).index(group.path),
        set=lambda group, number: setattr(group, "path", names(group)[number]),
        options={"SKIP_SAVE"},
    )
