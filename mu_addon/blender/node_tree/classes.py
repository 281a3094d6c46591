"""Blender's tree and nodes, made from the core's definitions.

A node added to the core appears with its sockets, fields, bounds and tooltips without a line of code.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from functools import partial

import bpy
from bpy.props import PointerProperty, StringProperty

from ...design.parameters import SECTIONS
from ...graph.definition import Definition, Setting
from ...graph.evaluation import BLOCKED, CACHED, COMPUTED, FAILED, MADE, MUTED, WAITING
from ...nodes.definitions import definitions
from ...run.progress import spell
from ..shared.blender_property import Flag, blender_property, path_property
from ..shared.panels import Field, draw_settings, wrapped
from ..shared.updates import Signal
from ..shared.wording import label, sentence
from ..unit.fields import draw_section, tied_update
from . import sockets

TREE = "MuNodeTree"
GROUP = "MU_NT_group"
CHANGED = Signal()
"""Sent with a tree whose nodes, links or values have changed."""
MOST_SHOWN = 8
"""A node with more numbers hides their sockets at first: its fields are in the sidebar."""
_ICONS = {
    COMPUTED: "CHECKMARK",
    CACHED: "FILE_TICK",
    WAITING: "TIME",
    FAILED: "ERROR",
    BLOCKED: "CANCEL",
    MUTED: "HIDE_ON",
}
_STATES = {}
"""States of nodes for drawing: see `state_of`."""


_RUNNING = {}
"""The running node of each evaluated tree, with stage and fraction: see `set_running`."""


def set_running(tree, node="", stage="", fraction=None) -> None:
    """Draw a node as the running one; none with ""."""
    _RUNNING[tree.session_uid] = {"node": node, "stage": stage, "fraction": fraction}


def set_states(tree, found) -> None:
    """Draw nodes of a tree with these states, by name."""
    _STATES[tree.session_uid] = found


def state_of(node):
    """The state of a node as of the latest refresh, or None."""
    return _STATES.get(node.id_data.session_uid, {}).get(node.name)


def node_class(kind: str) -> str:
    """Blender's name of the class of a kind of node."""
    return f"MU_ND_{kind}"


def attribute(setting: Setting) -> str:
    """Name of a setting's property on its node: the setting's, unless Blender's nodes use that name."""
    return f"{setting.name}_" if setting.name in bpy.types.Node.bl_rna.properties else setting.name


class MuNodeTree(bpy.types.NodeTree):
    """Units, step by step, and the work on them: simulation, sensor, print, data and their comparison"""

    bl_idname = TREE
    bl_label = "Monolithic Unit"
    bl_icon = "OUTLINER_OB_LATTICE"

    mu_uuid: StringProperty(options={"HIDDEN"})
    mu_folder: path_property(
        "Folder",
        "Folder of this tree's runs. Empty: beside the .blend file, or the user's folder",
        folder=True,
    )
    mu_reports: Flag("Reports of All Runs", "Write the full report of every run within the tree, too")

    @classmethod
    def valid_socket_type(cls, socket_type):
        return isinstance(socket_type, str) and socket_type.startswith("MU_NS_")

    def update(self):
        CHANGED.send(self)


def _changed(node, context):
    CHANGED.send(node.id_data)


def _is_unit(node, obj):
    return bool(obj.mu_unit.uuid)


class _Node:
    """Base of all nodes."""

    @classmethod
    def poll(cls, tree):
        return tree.bl_idname == TREE

    def copy(self, node):
        CHANGED.send(self.id_data)

    def free(self):
        CHANGED.send(self.id_data)


class _CoreNode(_Node):
    """A node of the core: `definition`."""

    definition: Definition

    def init(self, context):
        self.width = 220.0
        numbers = [s for s in self.definition.settings if s.is_number]
        for taken in self.definition.inputs:
            kind = sockets.identifier(sockets.type_of(taken.types))
            socket = self.inputs.new(
                type=kind,
                name=sentence(taken.name.replace("_", " ")),
                identifier=taken.name,
                use_multi_input=taken.many,
            )
            socket.description = taken.text
        for s in numbers:
            socket = self.inputs.new(
                type=sockets.identifier("number"),
                name=self.bl_rna.properties[attribute(s)].name,
                identifier=s.name,
            )
            socket.hide = len(numbers) > MOST_SHOWN
        for output in self.definition.outputs:
            self.outputs.new(
                type=sockets.identifier(output.type),
                name=sentence(output.name.replace("_", " ")),
                identifier=output.name,
            )

    def field_of(self, name):
        """Name of the property that a socket of that identifier shows."""
        s = self.definition.setting(name)
        return attribute(s) if s is not None else ""

    def draw_buttons(self, context, layout):
        if hasattr(self, "source"):
            layout.prop(self, "source", text="", placeholder="Unit in the Scene")
        if not getattr(self, "source", None):
            for s in self.definition.settings:
                if s.shown and not s.is_number:
                    self._draw_setting(layout, s)
        if hasattr(self, "follower") and not getattr(self, "source", None):
            layout.prop(self, "follower", text="", placeholder="Show On")
        draw_state(self, layout)

    def _draw_setting(self, layout, s):
        name = attribute(s)
        if s.description.type is str and not s.description.choices:
            layout.prop(self, name, text="", placeholder=self.bl_rna.properties[name].name)
        else:
            layout.prop(self, name)

    def _draw_field(self, layout, s):
        # A number's label stands within its field, where "Base Cap (mm)" is not cut.
        column = layout.column()
        column.use_property_split = not s.is_number
        column.prop(self, attribute(s))

    def draw_buttons_ext(self, context, layout):
        wrapped(layout, sentence(self.definition.text))
        shown = [s for s in self.definition.settings if s.shown]
        draw_settings(layout, [Field(s.description, partial(self._draw_field, s=s)) for s in shown])
        if getattr(self, "source", None):
            draw_source(self, layout)


def draw_source(node, layout) -> None:
    """Draw the parameters of the scene's unit that a node shows: the same fields as the unit's sidebar."""
    props = node.source.mu_unit
    layout.prop(props, "title")
    layout.prop(props, "scale")
    for section in SECTIONS:
        layout.label(text=section.section.capitalize())
        draw_section(layout, props, section)


def draw_state(node, layout) -> None:
    """Draw state, time and remark of a node, and its error in red."""
    found = state_of(node)
    if found is None:
        return
    text = found.state
    now = _RUNNING.get(node.id_data.session_uid, {})
    if found.state == WAITING and now.get("node") == node.name:
        layout.progress(factor=now.get("fraction") or 0.0, text=now.get("stage", ""))
        return
    if found.state in MADE and found.cost_s >= 1e-4:
        taken = spell(found.cost_s) if found.cost_s >= 0.1 else f"{1e3 * found.cost_s:.1f} ms"
        text += f" in {taken}" if found.state == COMPUTED else f", took {taken}"
    if found.state in (BLOCKED, WAITING) and found.because and found.because != node.name:
        text += f": {found.because}"
    layout.label(text=text, icon=_ICONS[found.state])
    if found.remark:
        layout.label(text=found.remark, icon="BLANK1")
    if found.error is not None and found.because not in ("", node.name):
        layout.label(text=f"see {found.because}", icon="BLANK1")
    elif found.error is not None:
        box = layout.box()
        box.alert = True
        width = max(16, int(node.width / 7.4))
        wrapped(box, found.error.what, "ERROR", width)
        if found.error.remedy:
            wrapped(box, found.error.remedy, "NONE", width)


def _property(s: Setting):
    """Blender property of a setting; the parameters of a unit are coupled as in its sidebar."""
    d, update = s.description, tied_update(s.name, _changed)
    if s.path:
        return blender_property(d, update, path=s.path)
    if d.type is not float:
        items = [(name, name.replace("_", " "), sentence(d.text)) for name in d.choices or ()]
        return blender_property(d, update, set() if s.shown else {"HIDDEN"}, items=items)
    # Lengths stay in millimetres, whatever unit a scene has: the tree belongs to no scene.
    unit = f" ({d.unit})" if d.unit and f"({d.unit})" not in label(d) else ""
    precision = 3 if d.high < 1000 else 2
    return blender_property(d, update, name=label(d) + unit, subtype="NONE", precision=precision)


def _annotations(definition: Definition) -> dict:
    found = {attribute(s): _property(s) for s in definition.settings}
    if any(not s.shown for s in definition.settings):
        text = "Take this unit, as its sidebar has it, in place of preset and file"
        found["source"] = _unit_of_scene("Unit in the Scene", text)
    if any(o.type == "unit" for o in definition.outputs):
        text = "Unit in the scene that takes on every change of this node's unit"
        found["follower"] = _unit_of_scene("Show On", text)
    return found


def _unit_of_scene(name: str, text: str):
    return PointerProperty(name=name, description=text, type=bpy.types.Object, poll=_is_unit, update=_changed)


def _class(definition: Definition) -> type:
    name = node_class(definition.kind)
    members = {
        "__doc__": sentence(definition.text),
        "__annotations__": _annotations(definition),
        "bl_idname": name,
        "bl_label": definition.label,
        "definition": definition,
    }
    return type(name, (_CoreNode, bpy.types.Node), members)


class MU_NT_group(_Node, bpy.types.NodeCustomGroup):
    """A group of nodes, used like one"""

    bl_idname = GROUP
    bl_label = "Group"

    def init(self, context):
        self.width = 180.0

    def draw_label(self):
        return self.node_tree.name if self.node_tree else "Group"

    def draw_buttons(self, context, layout):
        row = layout.row(align=True)
        row.prop(self, "node_tree", text="")
        if self.node_tree:
            row.operator("mu.node_group_edit", text="", icon="NODETREE").node = self.name
        draw_state(self, layout)


CLASSES = (*map(_class, definitions().values()),)
