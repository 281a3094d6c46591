"""Display of a unit's motion, kept on its root object with its parameters."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ...errors import MuError
from ..shared import updates, viewports
from ..shared.blender_property import Choice, Flag, Number, Text
from ..shared.registration import property_of
from ..unit import object as unit_object
from . import field_colours
from . import motion as motion_parts


def _again(settings, context):
    """Recolour after a change of the field or its range."""
    if not updates.are_paused():
        motion_parts.refresh(settings.id_data)
        viewports.redraw()


def _range(settings, context):
    if not updates.are_paused():
        motion_parts.colour(settings.id_data)
        viewports.redraw()


def _surface(settings, context):
    try:
        motion_parts.rebuild(settings.id_data)
    except MuError as error:
        # A property cannot refuse a value: the panel reports it instead.
        settings.trouble = error.what
    else:
        settings.trouble = ""


def _on_unit(settings, context):
    if updates.are_paused():
        # Hidden now, the candidates' tubes would stay.
        return
    if settings.on_unit:
        # They would lie beside it as soon as it bends.
        unit_object.hide_candidates(settings.id_data)
    motion_parts.arrange(settings.id_data)


@property_of(bpy.types.Object, "mu_motion")
class MU_PG_motion(bpy.types.PropertyGroup):
    """Display of the motion in a unit's study."""

    field: Choice(
        "Field",
        "Physical quantity shown by the colours",
        items=[
            (f.name, f"{f.label} ({f.unit})" if f.unit else f.label, f.text) for f in field_colours.FIELDS
        ],
        update=_again,
    )
    low: Number("From", "Value of the first colour, in the field's unit", precision=4, update=_range)
    high: Number(
        "To", "Value of the last colour, in the field's unit", default=1.0, precision=4, update=_range
    )
    lock: Flag("Lock Range", "Keep the range when field, motion or study change, to compare", update=_again)
    symmetric: Flag("Symmetric", "Range from -x to x, so that 0 is the middle colour", update=_again)
    legend: Flag("Legend", "Draw colours, values and unit in the viewport", default=True)
    cut: Flag(
        "Cut Open",
        "Show only the half behind the bending plane, to see chambers and walls; if the "
        "analysis mesh is a half",
        default=True,
        update=_surface,
    )
    on_unit: Flag(
        "On the Unit",
        "Show the first motion in place of the design instead of next to it",
        default=True,
        update=_on_unit,
    )
    marker: Flag(
        "Largest Value",
        "Mark in the viewport where the field is largest at this frame",
        default=True,
        update=lambda settings, context: viewports.redraw(),
    )
    apart: Number(
        "Apart",
        "Distance between neighbours, in widths of the unit; 0 puts all in one place",
        default=1.5,
        min=0.0,
        max=10.0,
        update=lambda settings, context: motion_parts.arrange(settings.id_data),
    )
    live: Flag(
        "Follow the Timeline",
        "Write the fields at every frame; without it only shapes move, which is faster",
        default=True,
        update=_again,
    )
    trouble: Text("Trouble", "Why the motion could not be updated", options={"HIDDEN"})
