"""Print settings of a unit, kept on its root object with its parameters."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import IntProperty

from ...design.assets import asset_names
from ...design.settings import FINE, PRINTER, UP
from ...graph.definition import FILE
from ..shared.blender_property import Choice, Flag, Number, blender_property, input_of, path_property
from ..shared.registration import property_of
from . import layer, marks

OWN_PRINTER = "own"
FORMATS = (
    ("stl", "STL", "The printable solid, mm"),
    ("3mf", "3MF", "The printable solid with its unit of length"),
    ("3mf-beams", "Beams", "3MF with the struts as beams, nominal size: not every slicer supports them"),
    ("step", "STEP", "Cavity, membrane, envelope and waveguide for CAD, nominal size"),
    ("txt", "TXT", "Nodes of the lattice and the anchors"),
)
"""Formats of an export: the core's name, the name here, and their content."""


@property_of(bpy.types.Object, "mu_print")
class MU_PG_printing(bpy.types.PropertyGroup):
    """Print settings of a unit, and the files to write."""

    printer: blender_property(
        PRINTER,
        items=[
            *(
                (name, name.replace("-", " ").title(), "Included in the extension")
                for name in asset_names("printers")
            ),
            (
                OWN_PRINTER,
                "Own File",
                "A TOML file of your own; start from printer.toml in the check's folder",
            ),
        ],
    )
    printer_file: path_property("Limits", "TOML file of a printer and its resin")
    limits_file: blender_property(input_of("check", "limits"), name="Measured", path=FILE)
    up: blender_property(
        input_of("check", "direction"),
        lambda settings, context: layer.follow(settings.id_data),
        name="Up",
        size=3,
        precision=3,
        subtype="XYZ",
        default=UP,
    )
    formats: Choice(
        "Files",
        "Formats of an export; each file is read back and compared",
        items=[(*item, 1 << number) for number, item in enumerate(FORMATS)],
        options={"ENUM_FLAG"},
        default={"stl", "3mf"},
    )
    quality: blender_property(
        FINE,
        name="Facets",
        items=[
            ("export", "Fine", "The quality to print"),
            ("interactive", "Coarse", "Quicker, smaller files"),
        ],
    )
    compensate: Choice(
        "Compensate",
        "Subtract the print offset from the nominal geometry",
        items=[
            ("none", "Nothing", "Nominal geometry"),
            ("unit", "Print Offsets", "The offsets of this unit, see Print Offsets"),
            ("gauge", "Gauge", "Measured with calipers on the printed gauge of the specimens"),
        ],
    )
    gauge: path_property("Sheet", "gauge.csv of the specimens with the sizes that were measured")
    vents: Flag(
        "Vents",
        "Vent the cups that trap resin if the unit is built along Up: STL and 3MF get a hole "
        "through the wall for each cup of the print check; plug-1.stl .. close the holes",
    )
    stl_file: blender_property(input_of("check", "stl"), name="File", path=FILE)
    repair: blender_property(input_of("check", "repair"))
    against_unit: Flag(
        "Compare", "Compare the file with this unit's nominal geometry: size, inlet, volume and tunnels"
    )
    marker: Number(
        "Marks (mm)",
        "Radius in mm of the balls at the places that were found",
        default=0.8,
        min=0.05,
        max=10.0,
        update=lambda settings, context: marks.resize(settings.id_data),
    )
    layer: Number(
        "Height",
        "Layer that is shown, as a share of the height, from the platform",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=lambda settings, context: layer.follow(settings.id_data),
    )
    # The finding in view, and its location in view; -1: none.
    finding: IntProperty(default=-1, options={"HIDDEN"})
    place: IntProperty(options={"HIDDEN"})
