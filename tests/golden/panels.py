"""Runs in Blender: every text that the panels and menus draw, by state of the unit."""

import inspect
import shutil
import types
from pathlib import Path

import bpy

from mu_addon.blender.evidence import state as evidence
from mu_addon.blender.node_tree.classes import TREE
from mu_addon.blender.printing import state as printing

from ..blender.inside.acting import add


class Layout:
    """Takes every call of a layout and keeps what a user reads; labels in a row are one text."""

    def __init__(self):
        self.__dict__["texts"] = []

    def __setattr__(self, name, value):
        """Icons, alerts and scales are no text."""

    def __getattr__(self, name):
        return lambda *_, **__: self

    def panel(self, *_, **__):
        return self, self

    def panel_prop(self, *_, **__):
        return self, self

    def say(self, what, text):
        last = self.texts[-1] if self.texts else ("", "")
        if what == last[0] == "label":
            self.texts[-1] = what, f"{last[1]} {text}"
        elif text:
            self.texts.append((what, text))
        return types.SimpleNamespace()

    def label(self, text="", **_):
        self.say("label", text)

    def progress(self, factor=0.0, text="", **_):
        self.say("progress", text)

    def prop(self, data, name, text=None, **_):
        value = getattr(data, name)
        if isinstance(value, float):
            value = f"{value:.6g}"
        elif not isinstance(value, str | int | bool):
            several = sorted(value) if isinstance(value, set) else value
            value = [f"{v:.6g}" if isinstance(v, float) else v for v in several]
        self.say("field", f"{data.bl_rna.properties[name].name if text is None else text}: {value}")

    def prop_search(self, data, name, *_, **more):
        self.prop(data, name, more.get("text"))

    def operator(self, name, text=None, **_):
        module, _, function = name.partition(".")
        kind = getattr(getattr(bpy.ops, module), function).get_rna_type()
        return self.say("button", f"{kind.name if text is None else text} ({name})")

    def operator_menu_enum(self, name, *_, text=None, **__):
        return self.operator(name, text)

    def menu(self, name, text=None, **_):
        self.say("menu", f"{getattr(bpy.types, name).bl_label if text is None else text} ({name})")

    def template_list(self, kind, _, data, name, *__, **___):
        shown = getattr(bpy.types, kind)
        for item in getattr(data, name):
            shown.draw_item(Seat(shown, self), bpy.context, self, data, item, 0, data, "", 0)


class Seat:
    """A panel as its `draw` sees it, without a window."""

    def __init__(self, panel, layout):
        self.panel, self.layout = panel, layout

    def __getattr__(self, name):
        found = getattr(self.panel, name)
        fixed = isinstance(inspect.getattr_static(self.panel, name), staticmethod)
        return types.MethodType(found, self) if inspect.isfunction(found) and not fixed else found


def shown_classes():
    """Panels of the extension, then its menus."""
    found = [*bpy.types.Panel.__subclasses__(), *bpy.types.Menu.__subclasses__()]
    return sorted((c for c in found if c.__name__.startswith("MU_")), key=lambda c: c.__name__)


def drawn(context=None):
    """{panel: texts} of all that is shown now."""
    found, wanted = {}, context or bpy.context
    for panel in shown_classes():
        editor = getattr(panel, "bl_space_type", "VIEW_3D")
        if editor == ("NODE_EDITOR" if context else "VIEW_3D") and getattr(panel, "poll", bool)(wanted):
            layout = Layout()
            panel.draw(Seat(panel, layout), wanted)
            found[panel.__name__] = [f"{what} {text}" for what, text in layout.texts]
    return found


def put(folder, into):
    """A finished run where a unit's own would be."""
    shutil.copytree(folder, into, dirs_exist_ok=True)


def texts(out, data, protocol):
    """Of no unit, a new one, one that breaks a rule, one with a ranking, diagnosis and print check."""
    out, states = Path(out), {"1 no unit": drawn()}
    root = add(preset="mu-0.75x")
    root.mu_unit.chambers.count = 3
    states["2 new"] = drawn()
    root.mu_unit.chambers.wall_mm = 3.0
    states["3 broken rule"] = drawn()
    root.mu_unit.chambers.wall_mm = 0.9
    study = root.mu_unit.study
    study.refine, study.protocol, study.folder = 0.35, str(protocol), str(out / "place")
    states["4 ranked"] = drawn()
    assert bpy.ops.mu.motion() == {"FINISHED"}
    states["5 played"] = drawn()
    study.folder = ""
    root.mu_evidence.folder = str(data)
    put(out / "diagnose-blocks", evidence.folder_of(root))
    put(out / "check", printing.CHECK.folder_of(root))
    states["6 diagnosed and checked"] = drawn()
    assert bpy.ops.mu.tree_new(template="three-walls") == {"FINISHED"}
    (tree,) = (tree for tree in bpy.data.node_groups if tree.bl_idname == TREE)
    tree.nodes.active = tree.nodes["Compare"]
    path = [types.SimpleNamespace(node_tree=tree)]
    space = types.SimpleNamespace(tree_type=TREE, edit_tree=tree, node_tree=tree, path=path)
    states["7 tree"] = drawn(types.SimpleNamespace(space_data=space))
    found, before = {}, {}
    for state, panels in states.items():
        for panel, said in panels.items():
            # A panel that says what it said in the state before is not told again.
            same = before.get(panel) == said
            found |= {
                f"{state}: {panel} {k:02d}": text for k, text in enumerate(["as before"] if same else said)
            }
        before = panels
    return found
