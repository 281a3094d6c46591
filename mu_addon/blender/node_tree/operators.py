"""Operators of node trees: evaluate, stop, open results, templates, files, units of the scene."""

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ...errors import InputError
from ...files import write_text
from ...graph.tree import with_absolute_paths
from ...graph.tree_file import read_tree, tree_text
from ...nodes import templates
from ...nodes.definitions import definitions
from ..jobs import start_child
from ..jobs.operators import job_operators
from ..shared.blender_property import Choice, Flag, Text, listed
from ..shared.operators import FreeOperator, choose_file, open_file, operator
from ..shared.registration import timer
from ..shared.wording import sentence
from ..unit.base_classes import UnitOperator
from . import conversion, following, state
from .classes import TREE
from .groups import TreeOperator, active_tree

# Purpose of each template; others are shown by their names.
_TEXTS = {
    "unit": "A unit by the steps of its design, with a waveguide",
    "three-walls": "Three walls of one unit, simulated and compared",
    "best-wall": "Three walls as a parameter study, and whether the one that bends most can be printed",
    "gripper": "Two units on a plate, and their grasp of a cube",
    "data-to-cause": "Measured data, the effects they name, and what these change",
    "bench": "A sensor recorded and calibrated, here a simulated one",
}


def root_tree(context):
    """Tree to evaluate: the outermost one open in the editor."""
    path = getattr(context.space_data, "path", None)
    if path and path[0].node_tree is not None and path[0].node_tree.bl_idname == TREE:
        return path[0].node_tree
    return active_tree(context)


def show(context, tree) -> None:
    """Show a tree in the node editor, where the operator is called from one."""
    space = context.space_data
    if getattr(space, "type", "") == "NODE_EDITOR":
        space.tree_type = TREE
        space.node_tree = tree
        _frame.soon(0.2)


@timer()
def _frame() -> None:
    """Frame the trees in node editors, once nodes were drawn and so have a size."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.ui_type == TREE:
                region = next(region for region in area.regions if region.type == "WINDOW")
                with bpy.context.temp_override(window=window, area=area, region=region):
                    bpy.ops.node.view_all()


def _open(context, tree) -> None:
    """Show a new tree in the node editor, and its units in the scene."""
    state.refresh(tree)
    state.show_units(context, tree)
    show(context, tree)


class _TreeOperator(TreeOperator):
    find_root = staticmethod(root_tree)


def _tree_evaluate_trouble(tree):
    return "This tree is being evaluated" if state.RUN.is_running(tree) else start_child.lacking()


@operator(
    _TreeOperator,
    "Evaluate",
    undo=False,
    trouble=_tree_evaluate_trouble,
    node=Text("Node", "Evaluate this node and its sources; empty: all"),
)
def tree_evaluate(context, tree, node):
    """Evaluate the tree in a separate process; finished nodes are not repeated, and Blender stays usable"""
    state.refresh(tree)
    if state.show_units(context, tree):
        bpy.ops.ed.undo_push(message="Units of the Tree")
    state.start(tree, (node,) if node else ())


def _templates() -> list[tuple[str, str, str]]:
    names = sorted(templates.template_names(), key=lambda name: [*_TEXTS, name].index(name))
    return [(n, sentence(n.replace("-", " ")), _TEXTS.get(n, n)) for n in names]


@operator(
    FreeOperator,
    "New from Template",
    template=Choice("Template", "Initial nodes of the tree", items=listed(_templates)),
)
def tree_new(context, template):
    """Add a node tree made from a template"""
    _open(context, conversion.from_tree(templates.template(template)))


_FILTER = StringProperty(default="*.toml", options={"HIDDEN"})


@operator(
    FreeOperator,
    "Open Tree File",
    invoke=choose_file,
    filepath=Text("File", "TOML file of a node tree", subtype="FILE_PATH"),
    filter_glob=_FILTER,
)
def tree_load(context, filepath):
    """Open a node tree's file, as `headless/run.py graph` reads it"""
    path = Path(bpy.path.abspath(filepath))
    _open(context, conversion.from_tree(with_absolute_paths(read_tree(path), definitions(), path.parent)))


def _choose_target(operator, context, event):
    operator.filepath = operator.filepath or f"{root_tree(context).name}.toml"
    return choose_file(operator, context, event)


@operator(
    _TreeOperator,
    "Save Tree File",
    undo=False,
    invoke=_choose_target,
    filepath=Text("File", "TOML file to write", subtype="FILE_PATH"),
    filter_glob=_FILTER,
)
def tree_save(operator, tree, filepath):
    """Write the tree to a file for `headless/run.py graph`; groups are written as their nodes"""
    core = conversion.to_tree(tree)
    if not core.nodes:
        raise InputError("the tree has no nodes", core.name, "add some, or start from a template")
    path = Path(bpy.path.abspath(filepath)).with_suffix(".toml")
    write_text(path, tree_text(core))
    operator.report({"INFO"}, f"Wrote {path}")


@operator(
    UnitOperator,
    "Tree of the Active Unit",
    linked_too=True,
    steps=Flag("Steps", "Lay out the steps of its design, and have the unit follow them"),
)
def tree_of_unit(context, root, steps):
    """Add a tree with the active unit: its sidebar and the tree's node show the same fields"""
    tree = state.tree_of_unit(root, steps)
    state.refresh(tree)
    show(context, tree)


@operator(UnitOperator, "Show the Tree", undo=False)
def tree_show(context, root):
    """Show the tree that the unit follows in a node editor; fields of the sidebar are fields of its nodes"""
    node = following.followed(root)
    if node is None:
        raise InputError(
            "the unit follows no tree", root.name, "use Tree of the Active Unit in a node editor, with Steps"
        )
    tree = node.id_data
    tree.nodes.active = node
    if not bpy.app.background:
        space = _node_editor(context)
        space.tree_type, space.node_tree = TREE, tree


def _node_editor(context):
    """A node editor that is open, else one in a new window."""
    windows = context.window_manager.windows
    areas = [area for window in windows for area in window.screen.areas if area.type == "NODE_EDITOR"]
    if not areas:
        bpy.ops.wm.window_new()
        areas = [windows[-1].screen.areas[0]]
        areas[0].ui_type = TREE
    return areas[0].spaces.active


@operator(
    _TreeOperator,
    "Open",
    undo=False,
    what=Choice(
        "What",
        "What to open",
        items=[
            ("folder", "Folder", "Folder of the node's run"),
            ("report", "Report", "Report of the node's run, where it was written"),
            ("table", "Table", "Table of a comparison, as a text in Blender"),
        ],
    ),
)
def node_open(context, tree, what):
    """Open the results of the active node's run: its report, its folder or its table"""
    node = active_tree(context).nodes.active
    path = state.place_of(tree, node, what) if node is not None else None
    if path is None or not path.exists():
        raise InputError(
            "there is nothing to open yet", str(path or ""), "evaluate the tree; reports are an option"
        )
    open_file(context, path)


job_operators(state.RUN, "evaluate the tree first", base=_TreeOperator)
