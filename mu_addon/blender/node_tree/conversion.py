"""Conversion between Blender's node tree and the core's: groups and reroutes become plain links, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import bpy

from ...design.parameters import to_toml
from ...errors import InputError
from ...graph.definition import Setting
from ...graph.tree import Node, NodeTree, Source
from ...nodes.definitions import definitions
from ..shared import updates
from ..shared.blender_property import exact
from ..unit.properties import to_unit
from .classes import GROUP, TREE, attribute, node_class

DEEPEST = 16
"""Deepest nesting of groups."""


@attrs.define
class _Flat:
    """A tree of Blender's, or one use of a group: prefix of its nodes' names, sources of its inputs."""

    tree: Any
    prefix: str = ""
    given: Mapping[str, tuple[Source, ...]] = attrs.field(factory=dict)
    depth: int = 0
    _links: dict[tuple[str, str], list[Any]] = attrs.field(factory=dict)

    def __attrs_post_init__(self) -> None:
        if self.depth > DEEPEST:
            raise InputError(
                f"groups are nested more than {DEEPEST} deep", self.tree.name, "ungroup one of them"
            )
        for link in self.tree.links:
            if not link.is_muted:
                key = (link.to_node.name, link.to_socket.identifier)
                self._links.setdefault(key, []).append(link)

    def sources(self, node: Any, identifier: str) -> tuple[Source, ...]:
        """Sources of a socket's links, through reroutes and groups, in the order they are drawn in."""
        found: list[Source] = []
        for link in self._links.get((node.name, identifier), ()):
            found += self._through(link.from_node, link.from_socket)
        return tuple(dict.fromkeys(found))

    def _through(self, node: Any, socket: Any) -> tuple[Source, ...]:
        if node.bl_idname == "NodeReroute":
            return self.sources(node, node.inputs[0].identifier)
        if node.bl_idname == "NodeGroupInput":
            return self.given.get(socket.identifier, ())
        if node.bl_idname == GROUP:
            inner = self.inside(node)
            if inner is None or node.mute:
                return ()
            ends = [n for n in inner.tree.nodes if n.bl_idname == "NodeGroupOutput"]
            # Blender marks the active one only in trees of its own kinds.
            ends.sort(key=lambda n: not n.is_active_output)
            return inner.sources(ends[0], socket.identifier) if ends else ()
        return (Source(self.prefix + node.name, socket.identifier),)

    def inside(self, node: Any) -> _Flat | None:
        """Use of a group by a node; None if it has no tree."""
        if node.node_tree is None:
            return None
        given = {s.identifier: self.sources(node, s.identifier) for s in node.inputs}
        return _Flat(node.node_tree, f"{self.prefix}{node.name}/", given, self.depth + 1)

    def collect(self, found: dict[str, Node]) -> None:
        """Add every node of the core, those in groups as "Group/Node"."""
        for node in self.tree.nodes:
            if node.bl_idname == GROUP:
                inner = self.inside(node)
                if inner is not None and not node.mute:
                    inner.collect(found)
            elif hasattr(node, "definition"):
                found[self.prefix + node.name] = self._node(node)

    def _node(self, node: Any) -> Node:
        links = {}
        for socket in node.inputs:
            sources = self.sources(node, socket.identifier)
            if sources:
                links[socket.identifier] = sources
        frame = node.parent.label or node.parent.name if node.parent is not None else ""
        return Node(node.definition.kind, _settings(node), links, node.mute, _absolute(node), frame)

    def refuse(self, refused: Mapping[tuple[str, str], frozenset[Source]]) -> None:
        """Mark links as valid or not; refused: sources of links with a fault, by node and input."""
        for link in self.tree.links:
            if hasattr(link.to_node, "definition"):
                key = (self.prefix + link.to_node.name, link.to_socket.identifier)
                sources = self._through(link.from_node, link.from_socket)
                valid = not refused.get(key, frozenset()).intersection(sources)
                if link.is_valid != valid:
                    link.is_valid = valid
        for node in self.tree.nodes:
            inner = self.inside(node) if node.bl_idname == GROUP else None
            if inner is not None:
                inner.refuse(refused)


def _absolute(node: Any) -> tuple[float, float]:
    """Position of a node in its tree, whatever frame it is in, as whole numbers."""
    x = y = 0.0
    while node is not None:
        x, y, node = x + node.location.x, y + node.location.y, node.parent
    return float(round(x)), float(round(y))


def _settings(node: Any) -> dict[str, Any]:
    """Settings of a node that differ from their defaults."""
    source = getattr(node, "source", None)
    if source is not None and source.mu_unit.uuid:
        # The same fields as in the unit's sidebar: they are one.
        unit = to_unit(source.mu_unit)
        return {"parameters": to_toml(unit, comments=False)} | (
            {"path": source.mu_unit.path} if source.mu_unit.path else {}
        )
    found = {}
    for s in node.definition.settings:
        value = _value(s, getattr(node, attribute(s)))
        if value != s.description.default:
            found[s.name] = value
    return found


def _value(s: Setting, value: Any) -> Any:
    if s.path and value:
        return bpy.path.abspath(value)
    return exact(value) if s.description.type is float else value


def to_tree(tree: Any) -> NodeTree:
    """The core's tree from one of Blender's; raises InputError for endless groups or a broken unit."""
    found: dict[str, Node] = {}
    _Flat(tree).collect(found)
    return NodeTree(tree.name, found)


def mark_links(tree: Any, refused: Mapping[tuple[str, str], frozenset[Source]]) -> None:
    """Draw links with a fault in red, also within groups; see `_Flat.refuse`."""
    _Flat(tree).refuse(refused)


def sync_groups(tree: Any) -> None:
    """Give every group node the sockets of its group's interface."""
    for node in tree.nodes:
        if node.bl_idname == GROUP:
            items = [] if node.node_tree is None else node.node_tree.interface.items_tree
            wanted = [item for item in items if item.item_type == "SOCKET"]
            _sync(node.inputs, [i for i in wanted if i.in_out == "INPUT"])
            _sync(node.outputs, [i for i in wanted if i.in_out == "OUTPUT"])


def _sync(own: Any, wanted: list[Any]) -> None:
    kinds = {item.identifier: item.bl_socket_idname for item in wanted}
    for socket in list(own):
        if kinds.get(socket.identifier) != socket.bl_idname:
            own.remove(socket)
    known = {socket.identifier: socket for socket in own}
    for item in wanted:
        if item.identifier not in known:
            own.new(type=item.bl_socket_idname, name=item.name, identifier=item.identifier)
        elif known[item.identifier].name != item.name:
            known[item.identifier].name = item.name


def from_tree(core: NodeTree, tree: Any | None = None) -> Any:
    """A tree of Blender's, a new one unless given an empty one, with the core's nodes. Raises InputError."""
    for name, node in core.nodes.items():
        if node.kind not in definitions():
            raise InputError(
                f"there is no kind of node {node.kind!r}", f"node {name!r}", "use the version that wrote it"
            )
    tree = tree or bpy.data.node_groups.new(core.name, TREE)
    made, frames = {}, {}
    for name, node in core.nodes.items():
        made[name] = new = tree.nodes.new(node_class(node.kind))
        new.name, new.location, new.mute, new.select = name, node.at, node.muted, False
        if name != new.name or name != new.bl_label:
            new.label = name
        _set(new, node)
        if node.frame:
            if node.frame not in frames:
                frames[node.frame] = tree.nodes.new("NodeFrame")
                frames[node.frame].label, frames[node.frame].select = node.frame, False
            new.parent = frames[node.frame]
    for name, node in core.nodes.items():
        for key, sources in node.links.items():
            for source in sources:
                if source.node in made:
                    _link(tree, made[source.node], source.output, made[name], key)
    return tree


def _link(tree: Any, before: Any, output: str, after: Any, key: str) -> None:
    out = next((s for s in before.outputs if s.identifier == output), None)
    into = next((s for s in after.inputs if s.identifier == key), None)
    if out is not None and into is not None:
        into.hide = False
        tree.links.new(out, into)


def _set(new: Any, node: Node) -> None:
    """Set a node's fields; a value of another type or choice is refused as by the core."""
    # Unchanged: a tied parameter may differ in a file, which is then reported.
    with updates.paused():
        for s in new.definition.settings:
            if s.name in node.settings:
                setattr(new, attribute(s), s.checked(node.settings[s.name]))
