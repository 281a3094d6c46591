"""The node editor's menu Add, header and sidebar."""

from __future__ import annotations

import bpy

from ...graph.evaluation import MADE
from ...nodes.definitions import definitions
from ..jobs.panel import draw_job, open_buttons, whole
from ..shared.panels import wrapped
from ..shared.registration import menu
from . import classes, state
from .classes import GROUP, TREE
from .operators import root_tree


def _shows_tree(context) -> bool:
    space = context.space_data
    return getattr(space, "tree_type", "") == TREE


class _Panel:
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "MU"

    @classmethod
    def poll(cls, context):
        return _shows_tree(context)


class MU_PT_tree(_Panel, bpy.types.Panel):
    """Evaluation of the tree, its folder and its file"""

    bl_label = "Node Tree"

    def draw(self, context):
        layout = self.layout
        tree = root_tree(context)
        if tree is None:
            layout.operator_menu_enum("mu.tree_new", "template", icon="NODETREE")
            layout.operator("mu.tree_load", icon="FILE_FOLDER")
            _of_unit(layout)
            return
        where = "see the nodes, and the scene for their units"
        draw_job(layout, tree, state.RUN, "mu.tree_evaluate", "PLAY", "Evaluate", where=where)
        open_buttons(layout, state.RUN)
        column = layout.column()
        column.use_property_split = True
        column.prop(tree, "mu_folder")
        # The name needs the whole width.
        layout.prop(tree, "mu_reports")
        row = layout.row(align=True)
        row.operator("mu.tree_save", text="Save", icon="EXPORT")
        row.operator("mu.tree_load", text="Open", icon="IMPORT")
        layout.operator_menu_enum("mu.tree_new", "template", icon="NODETREE")
        _of_unit(layout)


def _of_unit(layout) -> None:
    """Draw the ways from the active unit to a tree: a node with its fields, or the steps that it follows."""
    row = layout.row(align=True)
    row.operator("mu.tree_of_unit", text="Active Unit", icon="OUTLINER_OB_LATTICE").steps = False
    row.operator("mu.tree_of_unit", text="Its Steps", icon="NODETREE").steps = True


class MU_PT_node(_Panel, bpy.types.Panel):
    """The active node: its kind, its state, its results"""

    bl_label = "Active Node"

    @classmethod
    def poll(cls, context):
        tree = getattr(context.space_data, "edit_tree", None)
        return _shows_tree(context) and tree is not None and hasattr(tree.nodes.active, "definition")

    def draw(self, context):
        layout = self.layout
        node = context.space_data.edit_tree.nodes.active
        layout.label(text=node.definition.label)
        found = classes.state_of(node)
        if node.mute and node.definition.muting:
            wrapped(layout, f"Muted: {node.definition.muting}", "HIDE_ON")
        classes.draw_state(node, layout)
        row = layout.row(align=True)
        row.operator("mu.tree_evaluate", text="Evaluate to Here").node = node.name
        if found is not None and found.state in MADE:
            row = layout.row(align=True)
            for what in state.places(node):
                row.operator("mu.node_open", text=what.capitalize()).what = what
        node.draw_buttons_ext(context, layout)


def _entry(layout, text: str, kind: str) -> None:
    """Draw an entry of the Add menu: a node of that kind, which then follows the mouse."""
    add = layout.operator("node.add_node", text=text)
    add.type, add.use_transform = kind, True


def _menu(category: str) -> type:
    kinds = [d for d in definitions().values() if d.category == category]

    def draw(self, context):
        for d in kinds:
            _entry(self.layout, d.label, classes.node_class(d.kind))

    name = f"MU_MT_nodes_{category.lower().replace(' ', '_')}"
    members = {"__doc__": category, "bl_idname": name, "bl_label": category, "draw": draw}
    return type(name, (bpy.types.Menu,), members)


CATEGORIES = tuple(dict.fromkeys(d.category for d in definitions().values()))
MENUS = tuple(map(_menu, CATEGORIES))


class MU_MT_nodes_group(bpy.types.Menu):
    """Groups of nodes"""

    bl_label = "Group"

    def draw(self, context):
        layout = self.layout
        layout.operator("mu.node_group_make")
        layout.operator("mu.node_group_ungroup")
        layout.operator("mu.node_group_edit")
        layout.separator()
        _entry(layout, "Group", GROUP)
        _entry(layout, "Group Input", "NodeGroupInput")
        _entry(layout, "Group Output", "NodeGroupOutput")


class MU_MT_nodes_layout(bpy.types.Menu):
    """Frames and reroutes"""

    bl_label = "Layout"

    def draw(self, context):
        _entry(self.layout, "Frame", "NodeFrame")
        _entry(self.layout, "Reroute", "NodeReroute")


@menu("NODE_MT_add")
def _add(self, context):
    if _shows_tree(context):
        for listed in (*MENUS, MU_MT_nodes_group, MU_MT_nodes_layout):
            self.layout.menu(listed.bl_idname)
        self.layout.separator()
        self.layout.operator_menu_enum("mu.tree_new", "template", text="Template")


@menu("NODE_HT_header")
def _header(self, context):
    if not _shows_tree(context):
        return
    tree = root_tree(context)
    row = self.layout.row(align=True)
    if tree is None:
        row.operator_menu_enum("mu.tree_new", "template", text="Template", icon="NODETREE")
        return
    child = state.RUN.child(tree)
    if child is not None and state.RUN.is_running(tree):
        row.label(text=whole(child)[1])
        row.operator("mu.tree_cancel", text="", icon="X")
    else:
        row.operator("mu.tree_evaluate", icon="PLAY")


CLASSES = (*MENUS,)
