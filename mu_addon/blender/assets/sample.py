"""Sample scenes: an overview of the extension, and one for each task, made by the user's operators."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
from mathutils import Vector

from ...design.assets import asset_root
from ..gripper import object as gripper_object
from ..obstacles import state as obstacles
from ..preview import nodes
from ..shared import scene_units, viewports
from ..shared.compat import set_modifier_input
from ..unit import object as unit_object

APART_MM = 130.0


def build(context: Any, name: str = "overview") -> None:
    """Build the sample scene of that name, in view."""
    made = SCENES[name][1](context)
    context.view_layer.update()
    viewports.frame(made)


def _overview(context: Any) -> list[Any]:
    """Add three units, whole, cut open with paths, and in a body, and a curve."""
    cursor = context.scene.cursor.location.copy()
    roots = []
    try:
        for number in range(3):
            context.scene.cursor.location = cursor + _beside(context, number)
            bpy.ops.mu.add(preset="mu-1.0x", frame=False)
            roots.append(unit_object.active_root(context))
    finally:
        context.scene.cursor.location = cursor
    whole, opened, bodied = roots
    whole.name, opened.name, bodied.name = "Whole", "Cut Open", "In a Body of Its Own"

    context.view_layer.objects.active = opened
    opened.mu_unit.cut = True
    opened.mu_unit.candidates = True
    bpy.ops.mu.path(name="alpha4")

    body = _barrel(context, bodied)
    viewports.select(context, [body], bodied)
    context.view_layer.update()
    bpy.ops.mu.body()
    # Beside the units, which are placed beside objects at the cursor.
    curve = _curve(context, whole.location + _beside(context, 3))
    context.view_layer.objects.active = whole
    return [*roots, curve]


def _unit(context: Any, preset: str = "mu-0.75x") -> Any:
    bpy.ops.mu.add(preset=preset, frame=False)
    return unit_object.active_root(context)


def _paths(context: Any) -> list[Any]:
    """A unit cut open with its candidate paths, ready for *Place the Sensor*."""
    root = _unit(context)
    root.mu_unit.cut = root.mu_unit.candidates = True
    root.mu_unit.study.command = "place"
    return [root]


def _obstacle(context: Any) -> list[Any]:
    """A unit next to a box that it bends against, ready for *Motion Only*."""
    root = _unit(context)
    root.mu_unit.study.command = "simulate"
    bpy.ops.mu.obstacle_box(size=(20.0, 12.0, 12.0), gap=0.6)
    context.view_layer.objects.active = root
    return [root, *obstacles.of_unit(root)]


def _gripper(context: Any) -> list[Any]:
    """A gripper over a cube, ready for *Grasp*."""
    bpy.ops.mu.gripper_add()
    root = gripper_object.active(context)
    root.mu_gripper.detail = "quick"
    return [root, *root.children]


def _measured(context: Any) -> list[Any]:
    """A unit with the paper's compression tests as measured data, ready for *Diagnose*."""
    root = _unit(context, "mu-1.0x")
    root.mu_evidence.folder = str(asset_root() / "examples" / "paper-moduli")
    return [root]


def _tree(context: Any) -> list[Any]:
    """A unit that follows the tree of its steps in the node editor."""
    root = _unit(context, "mu-1.0x")
    root.mu_unit.cut = True
    bpy.ops.mu.path(name="alpha4")
    bpy.ops.mu.tree_of_unit(steps=True)
    bpy.ops.mu.tree_show()
    return [root]


SCENES: dict[str, tuple[str, Callable[[Any], list[Any]]]] = {
    "overview": ("Units whole, cut open with paths, and in a user-defined body", _overview),
    "paths": ("A unit with its candidate paths, ready for Place the Sensor", _paths),
    "obstacle": ("A unit next to a box that it bends against, ready for Motion Only", _obstacle),
    "gripper": ("A gripper over a cube, ready for Grasp", _gripper),
    "measured": ("A unit with measured data, ready for Diagnose", _measured),
    "tree": ("A unit that follows the node tree of its steps", _tree),
}
"""Sample scenes by name: their description, and the function that makes one, which returns what is framed."""


def _beside(context: Any, number: int) -> Any:
    return Vector((0.0, APART_MM * number * scene_units.mm(context.scene), 0.0))


def _barrel(context: Any, root: Any) -> Any:
    """A barrel, wider at its middle, around a unit's chambers and anchors."""
    around, rings = 48, 9
    vertices, faces = [], []
    for ring in range(rings):
        share = ring / (rings - 1)
        z, width = -2.0 + 79.0 * share, 20.0 + 5.0 * math.sin(math.pi * share)
        for k in range(around):
            angle = 2.0 * math.pi * k / around
            vertices.append((width * math.cos(angle), 7.0 + 1.35 * width * math.sin(angle), z))
    for ring in range(rings - 1):
        for k in range(around):
            a, b = ring * around + k, ring * around + (k + 1) % around
            faces.append((a, b, b + around, a + around))
    faces.append(tuple(reversed(range(around))))
    faces.append(tuple(range((rings - 1) * around, rings * around)))
    mesh = bpy.data.meshes.new("Barrel")
    mesh.from_pydata(vertices, [], faces)
    obj = bpy.data.objects.new("Barrel", mesh)
    obj.location, obj.scale = root.location, root.scale
    context.collection.objects.link(obj)
    return obj


def _curve(context: Any, at: Any) -> Any:
    """A user's curve, with a waveguide and its wells along it."""
    curve = bpy.data.curves.new("Own Curve", "CURVE")
    curve.dimensions = "3D"
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(2)
    for point, place in zip(
        spline.bezier_points, ((0.0, 0.0, 5.0), (0.0, 14.0, 38.0), (0.0, 0.0, 70.0)), strict=True
    ):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    obj = bpy.data.objects.new("Waveguide on a Curve", curve)
    obj.location, obj.scale = at, (scene_units.mm(context.scene),) * 3
    context.collection.objects.link(obj)
    modifier = nodes.skin(obj, "MU Waveguide")
    for name, value in {"Section": 3.0, "Pitch": 6.0, "Well Width": 2.0, "Well Depth": 1.2}.items():
        set_modifier_input(modifier, name, value)
    return obj
