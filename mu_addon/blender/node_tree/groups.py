"""Groups: several nodes as one, edited in a separate tree, used in any number of places."""

import bpy

from ...errors import InputError
from ..shared.blender_property import Text
from ..shared.operators import operator
from ..shared.registration import at_end, at_start
from ..unit.base_classes import UnitOperator
from . import conversion
from .classes import GROUP, TREE, attribute


def active_tree(context):
    """Our node tree in the editor, or None."""
    space = context.space_data
    tree = getattr(space, "edit_tree", None)
    return tree if tree is not None and tree.bl_idname == TREE else None


class TreeOperator(UnitOperator):
    """An operator on the tree that a node editor shows."""

    find_root = staticmethod(active_tree)
    no_root = "Open a node tree of the kind Monolithic Unit in a node editor"
    root_name = "tree"
    linked_too = True


def make_group(tree, nodes):
    """Put nodes of a tree into a new group; return its node. Raises InputError."""
    nodes = [node for node in nodes if node.bl_idname != "NodeFrame"]
    if not nodes:
        raise InputError("no node is selected", tree.name, "select the nodes of the group")
    inside = {node.name for node in nodes}
    group = bpy.data.node_groups.new("Group", TREE)
    copies = {node.name: _copied(node, group) for node in nodes}
    middle = sum(n.location.x for n in nodes) / len(nodes), sum(n.location.y for n in nodes) / len(nodes)
    ins, outs = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    ins.location = min(n.location.x for n in nodes) - 250.0, middle[1]
    outs.location = max(n.location.x for n in nodes) + 300.0, middle[1]
    ends = [_ends(link) for link in tree.links]
    items = {}
    for link, (before, after) in zip(tree.links, ends, strict=True):
        enters = after[0] in inside
        # Links from one socket become one socket of the group, however many nodes use it.
        if (before[0] in inside) != enters and before not in items:
            like = link.to_socket if enters else link.from_socket
            items[before] = _item(group, like, link.from_socket, "INPUT" if enters else "OUTPUT")
    node = tree.nodes.new(GROUP)
    node.node_tree, node.location = group, middle
    conversion.sync_groups(tree)
    for before, after in ends:
        first, second = copies.get(before[0]), copies.get(after[0])
        outer_first, outer_second = tree.nodes[before[0]], tree.nodes[after[0]]
        if first and second:
            _connect(first, before[1], second, after[1])
        elif second:
            _connect(ins, items[before], second, after[1])
            _connect(outer_first, before[1], node, items[before])
        elif first:
            _connect(first, before[1], outs, items[before])
            _connect(node, items[before], outer_second, after[1])
    for name in inside:
        tree.nodes.remove(tree.nodes[name])
    return node


def take_apart(tree, node):
    """Replace a group's node by the nodes of the group. Raises InputError."""
    if node.node_tree is None:
        raise InputError("the group is empty", node.name, "choose its tree first")
    group = node.node_tree
    own = [n for n in group.nodes if n.bl_idname not in ("NodeGroupInput", "NodeGroupOutput", "NodeFrame")]
    copies = {n.name: _copied(n, tree) for n in own}
    entering: dict[str, list] = {}
    leaving: dict[str, list] = {}
    for before, after in map(_ends, tree.links):
        if after[0] == node.name:
            entering.setdefault(after[1], []).append(before)
        if before[0] == node.name:
            leaving.setdefault(before[1], []).append(after)
    links = []
    for (first, output), (second, taken) in map(_ends, group.links):
        befores = [(copies[first].name, output)] if first in copies else entering.get(output, [])
        afters = [(copies[second].name, taken)] if second in copies else leaving.get(taken, [])
        links += [(*before, *after) for before in befores for after in afters]
    tree.nodes.remove(node)
    for first, output, second, taken in links:
        _connect(tree.nodes[first], output, tree.nodes[second], taken)
    return list(copies.values())


def _ends(link):
    """Name of the node and identifier of the socket that a link comes from, and those that it goes to."""
    return (
        (link.from_node.name, link.from_socket.identifier),
        (link.to_node.name, link.to_socket.identifier),
    )


def _connect(before, output, after, taken):
    """Link two nodes of a tree by the identifiers of their sockets."""
    out = next(s for s in before.outputs if s.identifier == output)
    before.id_data.links.new(out, next(s for s in after.inputs if s.identifier == taken))


def _copied(node, tree):
    """A copy of a node in another tree, with its fields."""
    new = tree.nodes.new(node.bl_idname)
    new.name, new.label, new.location, new.width = node.name, node.label, node.location, node.width
    new.mute = node.mute
    for s in getattr(node, "definition", None).settings if hasattr(node, "definition") else ():
        setattr(new, attribute(s), getattr(node, attribute(s)))
    for field in ("source", "follower", "node_tree"):
        if hasattr(node, field):
            setattr(new, field, getattr(node, field))
    if node.bl_idname == GROUP:
        conversion.sync_groups(tree)
    return new


def _item(group, like, named, in_out):
    """Identifier of a new socket of a group's interface, of the type of a node's socket."""
    kind = like.bl_idname if like.bl_idname.startswith("MU_NS_") else named.bl_idname
    return group.interface.new_socket(name=like.name, in_out=in_out, socket_type=kind).identifier


@operator(TreeOperator, "Make Group")
def node_group_make(tree):
    """Make a group of the selected nodes"""
    make_group(tree, [node for node in tree.nodes if node.select])


@operator(TreeOperator, "Ungroup")
def node_group_ungroup(tree):
    """Put the nodes of the selected groups back into the tree"""
    for node in [n for n in tree.nodes if n.select and n.bl_idname == GROUP]:
        take_apart(tree, node)


@operator(
    TreeOperator,
    "Edit Group",
    undo=False,
    node=Text("Node", "Name of the group's node; empty: the active one"),
)
def node_group_edit(context, tree, node):
    """Open a group to edit it, or go back to the tree that it is used in"""
    path = context.space_data.path
    node = tree.nodes.get(node) if node else tree.nodes.active
    if node is not None and node.bl_idname == GROUP and node.node_tree is not None:
        path.append(node.node_tree, node=node)
    elif len(path) > 1:
        path.pop()


_KEYS = (
    ("mu.node_group_make", "G", {"ctrl": True}),
    ("mu.node_group_ungroup", "G", {"ctrl": True, "alt": True}),
    ("mu.node_group_edit", "TAB", {}),
)
"""Keys of Blender's own groups, whose operators do not accept trees of other kinds."""
_keymaps: list = []


@at_start
def _add_keys() -> None:
    """Register the keys in node editors; in background there are none."""
    config = bpy.context.window_manager.keyconfigs.addon if bpy.context.window_manager else None
    if config is not None:
        keymap = config.keymaps.new(name="Node Editor", space_type="NODE_EDITOR")
        _keymaps.extend(
            (keymap, keymap.keymap_items.new(name, key, "PRESS", **held)) for name, key, held in _KEYS
        )


@at_end
def _remove_keys() -> None:
    for keymap, item in _keymaps:
        keymap.keymap_items.remove(item)
    _keymaps.clear()
