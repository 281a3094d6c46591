"""Previews of node groups for the asset browser: their result on a small curve, mesh or point cloud."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ...arrays import Array
from ..preview import materials, nodes
from ..results import field_colours
from ..shared.compat import set_modifier_input
from .surface_picture import surface_pixels


def group_pixels(name: str, size: int) -> Array:
    """Pixels (size, size, 4) of a group's result, from 0 to 1, rows from the bottom up."""
    mesh, inputs = _SAMPLES[name]()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    try:
        modifier = nodes.skin(obj, name)
        for socket, value in inputs.items():
            set_modifier_input(modifier, socket, value)
        bpy.context.view_layer.update()
        evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return _pixels(evaluated.to_mesh(), size)
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.meshes.remove(mesh)


def _pixels(mesh: Any, size: int) -> Array:
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    mesh.calc_loop_triangles()
    corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    triangles = corners.reshape(-1, 3)
    slots = np.empty(len(triangles), np.int32)
    mesh.loop_triangles.foreach_get("material_index", slots)
    plain = materials.COLOURS["MU Candidate"]
    own = [m.diffuse_color[:] if m else plain for m in mesh.materials] or [plain]
    colours = np.array(own)[np.minimum(slots, len(own) - 1), :3]
    share = mesh.attributes.get("mu_colour")
    if share is not None:
        values = np.empty(len(mesh.vertices), np.float32)
        share.data.foreach_get("value", values)
        means = values[triangles].mean(axis=1)
        colours = np.array([field_colours.of_map(float(value))[:3] for value in means])
    return surface_pixels(points.reshape(-1, 3), triangles, colours, size)


def _line(points: Array) -> Any:
    mesh = bpy.data.meshes.new("sample")
    mesh.from_pydata(points.tolist(), [(k, k + 1) for k in range(len(points) - 1)], [])
    return mesh


def _wave(turns: float = 1.0) -> Array:
    along = np.linspace(0.0, 1.0, 25)
    return np.stack([0.0 * along, 6.0 * np.sin(2.0 * np.pi * turns * along), 24.0 * along], axis=1)


def _with_radius(mesh: Any, radius: Array) -> Any:
    mesh.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radius.astype(np.float32))
    return mesh


def _tubes() -> tuple[Any, dict[str, Any]]:
    points = _wave()
    return _with_radius(_line(points), np.linspace(1.0, 3.0, len(points))), {
        "Material": materials.material("MU Lattice")
    }


def _balls() -> tuple[Any, dict[str, Any]]:
    points = _wave()[::6]
    mesh = bpy.data.meshes.new("sample")
    mesh.from_pydata(points.tolist(), [], [])
    radius = np.linspace(1.5, 3.5, len(points))
    return _with_radius(mesh, radius), {"Material": materials.material("MU Waveguide")}


def _labelled() -> tuple[Any, dict[str, Any]]:
    inputs = {"Label": "α4", "At": (0.0, -2.0, -11.0), "Size": 10.0}
    points = _wave(0.5)
    mesh = _with_radius(_line(points), np.full(len(points), 1.5))
    return mesh, {**inputs, "Material": materials.material("MU Candidate")}


def _waveguide() -> tuple[Any, dict[str, Any]]:
    inputs = {"Section": 4.0, "Pitch": 5.0, "Well Width": 2.2, "Well Depth": 2.0, "Cut": False}
    named = {"Material": "MU Waveguide", "Wells": "MU Wells"}
    return _line(_wave(0.5)), {**inputs, **{socket: materials.material(m) for socket, m in named.items()}}


def _field() -> tuple[Any, dict[str, Any]]:
    y, z = np.meshgrid(np.linspace(-10.0, 10.0, 21), np.linspace(-10.0, 10.0, 21))
    height = 4.0 * np.exp(-(y**2 + z**2) / 40.0)
    points = np.stack([height, y, z], axis=-1).reshape(-1, 3)
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    mesh = bpy.data.meshes.new("sample")
    mesh.from_pydata(
        points.tolist(), [], np.stack([corner, corner + 1, corner + 22, corner + 21], axis=1).tolist()
    )
    values = height.ravel().astype(np.float32)
    mesh.attributes.new("value", "FLOAT", "POINT").data.foreach_set("value", values)
    return mesh, {"Attribute": "value", "Low": 0.0, "High": 4.0}


_SAMPLES: dict[str, Callable[[], tuple[Any, dict[str, Any]]]] = {
    nodes.TUBES.name: _tubes,
    nodes.BALLS.name: _balls,
    nodes.LABELLED.name: _labelled,
    nodes.waveguide.NAME: _waveguide,
    nodes.COLOUR_FIELD.name: _field,
}
"""By a group's name: a new mesh for its preview, and its inputs."""
