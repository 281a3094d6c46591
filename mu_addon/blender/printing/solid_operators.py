"""Build the printable solid and write it as STL, both by the core."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ...design.settings import FINE, QUALITY
from ...design.solid import QUALITY as FACETS
from ...design.stl_and_nodes import write_nodes, write_stl
from ..shared.blender_property import blender_property
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


class MU_OT_solid(ValidUnitOperator, bpy.types.Operator):
    """Build the printable solid, with the waveguide of the chosen path, and check it; takes seconds"""

    bl_idname = "mu.solid"
    bl_label = "Build Solid"
    bl_options = {"REGISTER", "UNDO"}

    quality: blender_property(QUALITY, items=_ITEMS)

    def act(self, context, root):
        core = to_unit(root.mu_unit)
        solid = solid_of(root, core, self.quality)
        unit_object.put_solid(root, solid, core)
        layer.follow(root)
        gates = solid.gates
        self.report({"INFO"}, f"Watertight, {gates.triangles} triangles, {gates.volume_mm3 / 1000:.2f} cm3")


class MU_OT_export_stl(ValidUnitOperator, bpy.types.Operator, ExportHelper):
    """Build the solid in the quality to print, check it and write it as binary STL in mm"""

    bl_idname = "mu.export_stl"
    bl_label = "Export STL"
    bl_options = {"REGISTER"}

    filename_ext = ".stl"
    filter_glob: StringProperty(default="*.stl", options={"HIDDEN"})
    quality: blender_property(FINE, items=_ITEMS)
    nodes: BoolProperty(
        name="Lattice Nodes as Text",
        description="Also write the nodes' coordinates into the same folder",
        default=False,
    )

    def invoke(self, context, event):
        root = unit_object.active_root(context)
        path = root.mu_unit.path
        self.filepath = f"{root.mu_unit.title}{'-' + path if path else ''}.stl"
        found = printing.checked(root)
        if found is not None and not found.stale and found.errors:
            self.report({"WARNING"}, f"The check found: {found.errors[0]['check']}. Do not print this")
        return ExportHelper.invoke(self, context, event)

    def act(self, context, root):
        core = to_unit(root.mu_unit)
        target = Path(bpy.path.abspath(self.filepath))
        if self.nodes:
            write_nodes(core, target.with_suffix(".txt"))
        write_stl(solid_of(root, core, self.quality, str(target)), target)
        self.report({"INFO"}, f"Written: {target}")


CLASSES = (MU_OT_solid, MU_OT_export_stl)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
