"""A unit that follows a node of a tree: one set of values, whether the tree or the sidebar is edited.

What the sidebar changes is written into the fields of the tree's nodes. A value that comes by a link or a
driver is the tree's: it comes back, and the sidebar says where from.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ...design.parameters import SECTIONS
from ...design.steps import STEPS
from ...graph.definition import Setting
from ..shared import updates
from ..unit import object as unit_object
from ..unit.broken import description
from ..unit.fields import exact, label
from ..unit.properties import from_unit, section_of
from .classes import TREE, attribute, node_class

_agreed: dict[str, dict[str, Any]] = {}
"""By UUID of a unit: the values, by `section.name`, that it and its tree had in common last."""
_kept: dict[str, list[str]] = {}
"""By UUID: labels of the fields that were set in the sidebar last and are not the sidebar's to set."""


def followed(root: Any) -> Any | None:
    """The node that a unit in the scene follows, or None."""
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
    """Keep what a unit and its tree have in common now."""
    _agreed[root.mu_unit.uuid] = _values(root.mu_unit)


def give_back(root: Any) -> bool:
    """Write what the sidebar changed into the nodes that a unit follows; returns whether anything was."""
    node, before = followed(root), _agreed.get(root.mu_unit.uuid)
    if node is None or before is None:
        return False
    changed = {path: value for path, value in _values(root.mu_unit).items() if value != before[path]}
    if not changed:
        return False
    # A pair that a rule ties comes as one: the second is then the node's already.
    with updates.paused():
        refused = [path for path, value in changed.items() if not _write(node, path, value)]
    before |= {path: value for path, value in changed.items() if path not in refused}
    _kept[root.mu_unit.uuid] = [_label(path) for path in refused]
    return len(refused) < len(changed)


def kept_by_tree(root: Any) -> list[str]:
    """Labels of the fields that were set in the sidebar last, and that only the tree can set."""
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
    """Set a parameter in the node that gives it; returns whether there is one whose own field it is."""
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
    """Link the wells to the unit or take their link away, as the tree of a unit's steps has them.

    Returns whether the unit is made of steps, so that this is its path or its having none.
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
    """A node and those that it is made from, the nearest first; groups are not looked into."""
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
    """The setting of a node that is the parameter of that path; None where it has none."""
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
    """Whether a setting is the node's own field: neither a link nor a driver gives it."""
    socket = next((s for s in node.inputs if s.identifier == setting.name), None)
    data = node.id_data.animation_data
    field = node.path_from_id(attribute(setting))
    driven = data is not None and any(curve.data_path == field for curve in data.drivers)
    return not driven and not (socket is not None and socket.is_linked)


def forget() -> None:
    """Forget what units and trees had in common: other values are there, by undo or another file."""
    _agreed.clear()
    _kept.clear()
