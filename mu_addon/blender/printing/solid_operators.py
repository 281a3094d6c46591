"""Build the printable solid and write it as STL, both by the core."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from ...design.settings import FINE, QUALITY
from ...design.solid import QUALITY as FACETS
from ...design.stl_and_nodes import write_nodes, write_stl
from ..shared.blender_property import Flag, blender_property
from ..shared.operators import operator
from ..unit import object as unit_object
from ..unit.base_classes import ValidUnitOperator
from ..unit.properties import to_unit
from . import layer
from . import state as printing
from .state import solid_of

_ITEMS = [
    (name, name.capitalize(), f"{f.around_axis} facets around the axis, {f.around_strut} around a strut")
    for name, f in FACETS.items()
]


@operator(ValidUnitOperator, "Build Solid", quality=blender_property(QUALITY, items=_ITEMS))
def solid(operator, root, quality):
    """Build the printable solid, with the waveguide of the chosen path, and check it; takes seconds"""
    core = to_unit(root.mu_unit)
    solid = solid_of(root, core, quality)
    unit_object.put_solid(root, solid, core)
    layer.follow(root)
    gates = solid.gates
    operator.report({"INFO"}, f"Watertight, {gates.triangles} triangles, {gates.volume_mm3 / 1000:.2f} cm3")


class MU_OT_export_stl(ValidUnitOperator, bpy.types.Operator, ExportHelper):
    """Build the solid in the quality to print, check it and write it as binary STL in mm"""

    bl_label = "Export STL"
    bl_options = {"REGISTER"}

    filename_ext = ".stl"
    filter_glob: StringProperty(default="*.stl", options={"HIDDEN"})
    quality: blender_property(FINE, items=_ITEMS)
    nodes: Flag(
        "Lattice Nodes as Text", "Also write the nodes' coordinates into the same folder", default=False
    )

    def invoke(self, context, event):
        root = unit_object.active_root(context)
        path = root.mu_unit.path
        self.filepath = f"{root.mu_unit.title}{'-' + path if path else ''}.stl"
        if wrong := printing.errors(root):
            self.report({"WARNING"}, f"The check found: {wrong}. Do not print this")
        return ExportHelper.invoke(self, context, event)

    def act(self, context, root):
        core = to_unit(root.mu_unit)
        target = Path(bpy.path.abspath(self.filepath))
        if self.nodes:
            write_nodes(core, target.with_suffix(".txt"))
        write_stl(solid_of(root, core, self.quality, str(target)), target)
        self.report({"INFO"}, f"Written: {target}")
