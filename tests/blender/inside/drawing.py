"""What panels say: they draw into something that takes every call and keeps the words."""

import inspect
from unittest.mock import MagicMock

import bpy

from mu_addon.blender.shared import registration


def panels_of(*modules):
    """Panels and menus of modules, in order."""
    shown = bpy.types.Panel, bpy.types.Menu
    return [cls for one in modules for cls in registration.classes_of(one) if issubclass(cls, shown)]


def drawn(panels):
    """All words that these panels, or those of a module, show now."""
    return " ".join(lines(panels))


def lines(panels):
    """The same one by one: labels, bars, buttons and names."""
    texts, layout = [], MagicMock()
    layout.panel.return_value = (layout, layout)
    for name in ("row", "column", "box", "split", "grid_flow"):
        getattr(layout, name).return_value = layout
    layout.label.side_effect = lambda text="", **_: texts.append(text)
    layout.progress.side_effect = lambda factor, text: texts.append(f"{factor:.2f} {text}")
    layout.operator.side_effect = lambda name, text="", **_: texts.append(text or name) or MagicMock()
    layout.prop.side_effect = lambda data, name, **_: name == "name" and texts.append(data.name)
    layout.template_icon.side_effect = lambda icon, scale: texts.append("a picture")
    draw(panels_of(panels) if inspect.ismodule(panels) else panels, layout)
    return texts


def draw(panels, layout):
    """Draw those of these panels that show now."""
    for panel in panels:
        if getattr(panel, "poll", lambda _: True)(bpy.context):
            seat = MagicMock(layout=layout, find_root=getattr(panel, "find_root", None))
            seat.show = lambda *words, panel=panel, seat=seat: panel.show(seat, *words)
            panel.draw(seat, bpy.context)


class Folds:
    """A layout of open folds that keeps each field drawn: its owner, its name, the fold's title.

    wide: it is as wide as its panel, without which Blender draws no fold.
    """

    def __init__(self, found, title="", wide=True):
        self.found, self.title, self.wide = found, title, wide

    def __getattr__(self, name):
        return lambda *_, **__: MagicMock()

    def row(self, *_, **__):
        return Folds(self.found, self.title, wide=False)

    column = box = split = grid_flow = row

    def panel(self, name, default_closed):
        assert self.wide, name
        head, body = MagicMock(), Folds(self.found)
        head.label.side_effect = lambda text, icon="": setattr(body, "title", text)
        return head, body

    def prop(self, owner, name, **_):
        self.found.append((owner, name, self.title))
