"""Settings of live bending, kept on a unit's root object."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ..shared.blender_property import Choice, Flag, Number
from ..shared.registration import property_of
from ..shared.updates import Signal

SWITCHED, PRESSED, COLOURED = Signal(), Signal(), Signal()
"""Sent with a root whose live bending was switched, with one bent by another pressure, and with one whose
colours were chosen."""
PLAIN = "plain"


@property_of(bpy.types.Object, "mu_live")
class MU_PG_live(bpy.types.PropertyGroup):
    """Bending of a unit while it is designed."""

    on: Flag(
        "Bend Live",
        "Bend the unit while it is designed: a coarse solution of the printed body after every "
        "change, then finer ones. Without self-contact, and not while a simulation runs",
        update=lambda live, context: SWITCHED.send(live.id_data),
    )
    pressure_kPa: Number(
        "Pressure (kPa)",
        "Pressure at which the unit is shown bent; suction is simulated only",
        default=40.0,
        min=0.0,
        soft_max=40.0,
        max=200.0,
        step=100,
        precision=1,
        update=lambda live, context: PRESSED.send(live.id_data),
    )
    colour: Choice(
        "Colours",
        "Quantity shown by the colours of the bent unit",
        items=[
            (PLAIN, "Plain", "The colours of the parts"),
            ("largest_stretch", "Stretch", "Largest principal stretch"),
            ("von_mises_kPa", "Stress", "Von Mises stress, of Cauchy's stress"),
        ],
        update=lambda live, context: COLOURED.send(live.id_data),
    )
