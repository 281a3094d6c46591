"""Differences between the Blenders that the extension runs in, 4.5 to 5.2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np

PACKAGE = __package__.removesuffix(".blender.shared")
"""Name of the whole extension: `bl_ext.<repository>.mu_addon` when installed, `mu_addon` from source."""

INSTALLED = PACKAGE.startswith("bl_ext.")


def user_folder(*parts: str) -> Path:
    """The user's folder for this extension, created if missing; an upgrade keeps it.

    Run from source there is no extension, and the folder lies in the user's Blender configuration.
    """
    if INSTALLED:
        folder = Path(bpy.utils.extension_path_user(PACKAGE, create=True))
    else:
        folder = Path(bpy.utils.user_resource("CONFIG")) / "mu_addon"
    folder = folder.joinpath(*parts)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def set_modifier_input(modifier: Any, name: str, value: Any) -> None:
    """Set the input called `name` of a Geometry Nodes modifier; KeyError where its group has none."""
    if _plain(modifier_input(modifier, name)) == value:
        return
    identifier = _identifier(modifier, name)
    if hasattr(modifier, "properties"):  # 5.2
        getattr(modifier.properties.inputs, identifier).value = value
    else:
        modifier[identifier] = value
    modifier.id_data.update_tag()


def modifier_input(modifier: Any, name: str) -> Any:
    """Value of the input called `name` of a Geometry Nodes modifier; KeyError where its group has none."""
    identifier = _identifier(modifier, name)
    if hasattr(modifier, "properties"):
        return getattr(modifier.properties.inputs, identifier).value
    return modifier.get(identifier)


def _plain(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def link_radius(tree: Any, curve_to_mesh: Any, curve: Any, radius: Any) -> None:
    """Sweep `curve` with a profile of radius 1 scaled by `radius`: a socket from 5.0, before the curve's."""
    scale = curve_to_mesh.inputs.get("Scale")
    if scale is not None:
        tree.links.new(radius, scale)
        tree.links.new(curve, curve_to_mesh.inputs["Curve"])
        return
    node = tree.nodes.new("GeometryNodeSetCurveRadius")
    tree.links.new(curve, node.inputs["Curve"])
    tree.links.new(radius, node.inputs["Radius"])
    tree.links.new(node.outputs["Curve"], curve_to_mesh.inputs["Curve"])


def modifier_inputs(modifier: Any) -> dict[str, Any]:
    """Values of all inputs of a Geometry Nodes modifier but its geometry, by name."""
    names = [socket.name for socket in _sockets(modifier.node_group) if hasattr(socket, "default_value")]
    return {name: _plain(modifier_input(modifier, name)) for name in names}


def input_defaults(tree: Any) -> dict[str, Any]:
    """Default values of all inputs of a node group but its geometry, by name."""
    sockets = (socket for socket in _sockets(tree) if hasattr(socket, "default_value"))
    return {socket.name: _plain(socket.default_value) for socket in sockets}


def _sockets(tree: Any) -> list[Any]:
    items = tree.interface.items_tree
    return [item for item in items if item.item_type == "SOCKET" and item.in_out == "INPUT"]


def _identifier(modifier: Any, name: str) -> str:
    for socket in _sockets(modifier.node_group):
        if socket.name == name:
            return str(socket.identifier)
    raise KeyError(name)


def set_curve(obj: Any, path: str, index: int, frames: Any, values: Any, constant: bool = False) -> None:
    """Animate one channel of an object's property (index -1: the only one) by values (n,) at frames (n,).

    Linear between them, or stepwise with `constant`. Through the slot of a layered action, which every
    version here has; actions lost their own curves with 5.0.
    """
    obj.keyframe_insert(path, index=index, frame=float(frames[0]))
    action, slot = obj.animation_data.action, obj.animation_data.action_slot
    curves = action.layers[0].strips[0].channelbag(slot).fcurves
    points = curves.find(path, index=max(index, 0)).keyframe_points
    points.add(len(frames) - len(points))
    points.foreach_set("co", np.stack([frames, values], axis=1).astype(np.float32).ravel())
    kinds = type(points[0]).bl_rna.properties["interpolation"].enum_items
    kind = kinds["CONSTANT" if constant else "LINEAR"].value
    points.foreach_set("interpolation", np.full(len(frames), kind, np.int32))
    curves.find(path, index=max(index, 0)).update()
