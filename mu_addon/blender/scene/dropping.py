"""Files dropped into a view: a unit or a node tree as TOML, a closed surface as envelope or obstacle.

If Blender's importers also accept a file, Blender asks for one.
"""

from pathlib import Path

import bpy

from ...design.body import read_body
from ...design.parameters import read_unit
from ...errors import InputError
from ...reading import parse_toml, text_in
from ..preview import skeletons
from ..shared import landing, viewports
from ..shared.blender_property import FloatVector, Text
from ..shared.operators import FreeOperator, operator
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator

SURFACES = ".stl;.obj;.ply"
# Far longer than any file of a unit or a tree.
_LONGEST = 10_000_000


_FILE = Text("File", "The file that was dropped", subtype="FILE_PATH", options={"SKIP_SAVE"})


def _path(filepath: str) -> Path:
    """The dropped file; raises InputError where none is named."""
    if not filepath:
        raise InputError("no file is named", "filepath", "drop one into the view")
    return Path(bpy.path.abspath(filepath))


def _at_the_mouse(operator, context, event):
    # At the depth of the 3D cursor.
    region, space = context.region, getattr(context, "region_data", None)
    if space is not None and region is not None:
        from bpy_extras.view3d_utils import region_2d_to_location_3d

        mouse = event.mouse_region_x, event.mouse_region_y
        operator.place = region_2d_to_location_3d(region, space, mouse, context.scene.cursor.location)
    return operator.execute(context)


@operator(
    FreeOperator,
    "Unit or Node Tree",
    invoke=_at_the_mouse,
    filepath=_FILE,
    place=FloatVector("Place", "Where it was dropped", options={"HIDDEN", "SKIP_SAVE"}),
)
def drop_toml(operator, context, filepath, place):
    """Add the unit that a TOML file describes where it is dropped, or open the node tree that it holds"""
    path = _path(filepath)
    document = parse_toml(text_in(path, "file", "drop a TOML file", _LONGEST), str(path))
    if "nodes" in document:
        bpy.ops.mu.tree_load(filepath=str(path))
        return
    root = unit_object.create(context, read_unit(path))
    if operator.properties.is_property_set("place"):
        root.location = place
    landing.land(context, root)
    viewports.redraw()


def _use_surface(operator, context, root, filepath, use):
    """Put a closed surface, in mm in the active unit's frame, into the scene and then use it."""
    path = _path(filepath)
    body = read_body(path)
    mesh = bpy.data.meshes.new(path.stem)
    skeletons.write(mesh, skeletons.Skeleton(body.vertices, faces=(body.triangles,), smooth=False))
    obj = bpy.data.objects.new(path.stem, mesh)
    context.collection.objects.link(obj)
    obj.matrix_world = root.matrix_world
    context.view_layer.update()
    viewports.select(context, [obj, root], root)
    try:
        return use()
    except RuntimeError as error:
        # The surface stays in the scene, selected, to be repaired.
        operator.report({"ERROR"}, str(error).removeprefix("Error: ").strip())
        return {"FINISHED"}


@operator(UnitOperator, "Envelope of the Unit", filepath=_FILE)
def drop_envelope(operator, context, root, filepath):
    """Add a closed surface from a file, in mm in the unit's frame, and have the lattice fill it"""
    return _use_surface(operator, context, root, filepath, bpy.ops.mu.body)


@operator(UnitOperator, "Obstacle of the Unit", filepath=_FILE)
def drop_obstacle(operator, context, root, filepath):
    """Add a closed surface from a file, in mm in the unit's frame, as an obstacle of the unit"""
    return _use_surface(operator, context, root, filepath, bpy.ops.mu.obstacle)


class MU_FH_toml(bpy.types.FileHandler):
    """Units and node trees"""

    bl_label = "Monolithic Unit or Node Tree"
    bl_import_operator = "mu.drop_toml"
    bl_file_extensions = ".toml"

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type in ("VIEW_3D", "NODE_EDITOR")


class _SurfaceHandler:
    bl_file_extensions = SURFACES

    @classmethod
    def poll_drop(cls, context):
        in_view = context.area is not None and context.area.type == "VIEW_3D"
        return in_view and unit_object.active_root(context) is not None


class MU_FH_envelope(_SurfaceHandler, bpy.types.FileHandler):
    """Envelopes"""

    bl_label = "Envelope of the Unit"
    bl_import_operator = "mu.drop_envelope"


class MU_FH_obstacle(_SurfaceHandler, bpy.types.FileHandler):
    """Obstacles"""

    bl_label = "Obstacle of the Unit"
    bl_import_operator = "mu.drop_obstacle"
