"""A unit that follows a node of a tree: one set of values, edited in the tree or the sidebar.

Changes in the sidebar are written into the fields of the tree's nodes; a node *Unit* then takes the scene's
unit in place of its preset. A value set by a link or a driver is restored after a change in the sidebar,
which shows its source.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ...design.parameters import SECTIONS
from ...design.steps import STEPS
from ...graph.definition import Setting
from ..shared import updates
from ..shared.blender_property import exact
from ..shared.registration import connected
from ..shared.wording import label
from ..unit import object as unit_object
from ..unit.fields import description
from ..unit.properties import from_unit, section_of
from .classes import TREE, attribute, node_class

_agreed: dict[str, dict[str, Any]] = {}
"""By UUID of a unit: its latest values in common with its tree, by `section.name`."""
_kept: dict[str, list[str]] = {}
"""By UUID: labels of the fields last edited in the sidebar that only the tree can set."""


def followed(root: Any) -> Any | None:
    """Node that a unit in the scene follows, or None."""
    for tree in bpy.data.node_groups:
        if tree.bl_idname == TREE and tree.library is None:
            for node in tree.nodes:
                if getattr(node, "follower", None) == root:
                    return node
    return None


def take(root: Any, design: Any) -> None:
    """Give a unit the design of the node that it follows."""
    with updates.paused():
        from_unit(root.mu_unit, design.unit)
        root.mu_unit.path = design.path
    agree(root)
    unit_object.rebuild(root)


def agree(root: Any) -> None:
    """Store the present values as those in common of a unit and its tree."""
    _agreed[root.mu_unit.uuid] = _values(root.mu_unit)


@connected(unit_object.REBUILT)
def give_back(root: Any) -> bool:
    """Write changes of the sidebar into the nodes that a unit follows; return True if there were any."""
    node, before = followed(root), _agreed.get(root.mu_unit.uuid)
    if node is None or before is None:
        return False
    changed = {path: value for path, value in _values(root.mu_unit).items() if value != before[path]}
    if not changed:
        return False
    if hasattr(node, "source"):
        # A preset or a file is not changed: from now on the node's unit is that of the scene.
        node.source, node.follower = root, None
        return True
    # Tied parameters change together: the second is then already set.
    with updates.paused():
        refused = [path for path, value in changed.items() if not _write(node, path, value)]
    before |= {path: value for path, value in changed.items() if path not in refused}
    _kept[root.mu_unit.uuid] = [_label(path) for path in refused]
    return len(refused) < len(changed)


def kept_by_tree(root: Any) -> list[str]:
    """Labels of the fields last edited in the sidebar that only the tree can set."""
    return _kept.get(root.mu_unit.uuid, [])


def _label(path: str) -> str:
    section, _, name = path.rpartition(".")
    return label(description(section, name)) if section else path.capitalize()


def _values(props: Any) -> dict[str, Any]:
    """Every parameter of a unit in the scene by `section.name`, with its scale and its path."""
    found = {
        f"{s.section}.{name}": value for s in SECTIONS for name, value in section_of(props, s.section).items()
    }
    return {**found, "scale": exact(props.scale), "path": props.path}


def _write(node: Any, path: str, value: Any) -> bool:
    """Set a parameter in the node that has its field; return True if there is one."""
    if path == "path" and _lay_waveguide(node, bool(value)) and not value:
        return True
    for source in _upstream(node):
        setting = _setting(source, path)
        if setting is not None:
            free = _is_free(source, setting)
            if free and getattr(source, attribute(setting)) != value:
                setattr(source, attribute(setting), value)
            return free
    return False


def _lay_waveguide(node: Any, there: bool) -> bool:
    """Link the wells to the unit or unlink them, as in the tree of a unit's steps.

    Return True if the unit is made of steps, so that its path is set this way.
    """
    tree, found = node.id_data, False
    wells = next((n for n in tree.nodes if n.bl_idname == node_class("wells")), None)
    for source in list(_upstream(node)):
        socket = next((s for s in source.inputs if s.identifier == "wells"), None)
        if socket is None or source.bl_idname != node_class("assemble"):
            continue
        found = True
        if there and wells is not None and not socket.is_linked:
            tree.links.new(next(s for s in wells.outputs if s.identifier == "wells"), socket)
        elif not there:
            for link in list(socket.links):
                tree.links.remove(link)
    return found


def _upstream(node: Any) -> Iterator[Any]:
    """A node and its upstream nodes, the nearest first, without those in groups."""
    waiting, seen = [node], {node.name}
    while waiting:
        node = waiting.pop(0)
        if hasattr(node, "definition"):
            yield node
        for socket in node.inputs:
            for link in socket.links:
                if link.from_node.name not in seen:
                    seen.add(link.from_node.name)
                    waiting.append(link.from_node)


def _setting(node: Any, path: str) -> Setting | None:
    """Setting of a node for the parameter of that path; None without one."""
    definition = node.definition
    if definition.kind == "set_parameter":
        ours = node.parameter == path and not node.mute
        return definition.setting("value") if ours else None
    step = STEPS.get(definition.kind)
    if step is None:
        return definition.setting(path.replace(".", "_"))
    section, _, name = path.rpartition(".")
    return definition.setting(name) if not section or path in step.own else None


def _is_free(node: Any, setting: Setting) -> bool:
    """Return True if a setting is set in the node's field, not by a link or a driver."""
    socket = next((s for s in node.inputs if s.identifier == setting.name), None)
    data = node.id_data.animation_data
    field = node.path_from_id(attribute(setting))
    driven = data is not None and any(curve.data_path == field for curve in data.drivers)
    return not driven and not (socket is not None and socket.is_linked)


def forget() -> None:
    """Drop the values in common of units and trees, which undo or another file has changed."""
    _agreed.clear()
    _kept.clear()
