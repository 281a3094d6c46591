"""Sockets: one class for each type of the core, each with its colour; a number's shows the node's field."""

from __future__ import annotations

import colorsys
import zlib
from collections.abc import Iterator
from typing import Any

import bpy

from ...graph.definition import NUMBER
from ...nodes.definitions import definitions

# A type that is not listed gets a colour by its name.
_COLOURS = {
    "number": (0.63, 0.63, 0.63),
    "profile": (0.85, 0.75, 0.35),
    "surface": (0.35, 0.70, 0.55),
    "lattice": (0.30, 0.55, 0.90),
    "points": (0.80, 0.80, 0.95),
    "path": (0.90, 0.55, 0.25),
    "solid": (0.25, 0.80, 0.80),
    "unit": (0.00, 0.84, 0.64),
    "study": (0.93, 0.62, 0.84),
    "field": (0.90, 0.35, 0.35),
    "model": (0.75, 0.25, 0.45),
    "data": (0.65, 0.85, 0.25),
    "table": (0.45, 0.62, 1.00),
    "study table": (0.25, 0.40, 0.85),
    "range": (0.70, 0.70, 0.45),
    "recording": (0.95, 0.80, 0.60),
    "calibration": (0.60, 0.45, 0.30),
}
ANY = "any"
"""Sockets of inputs that take several types."""


def colour(type_: str) -> tuple[float, float, float, float]:
    """RGBA of a type's sockets."""
    known = _COLOURS.get(type_) or colorsys.hsv_to_rgb(zlib.crc32(type_.encode()) % 360 / 360.0, 0.55, 0.85)
    return (*known, 1.0)


def identifier(type_: str) -> str:
    """Blender's name of the socket class of a type: "print check" has MU_NS_print_check."""
    return f"MU_NS_{type_.replace(' ', '_')}"


def type_of(types: tuple[str, ...]) -> str:
    """Type of an input's socket."""
    return types[0] if len(types) == 1 else ANY


class _Socket:
    """Base of all sockets of node trees."""

    mu_type = ""

    @classmethod
    def draw_color_simple(cls):
        return colour(cls.mu_type)

    def draw_color(self, context, node):
        return colour(self.mu_type)

    def draw(self, context, layout, node, text):
        field = node.field_of(self.identifier) if self.mu_type == NUMBER and hasattr(node, "field_of") else ""
        if field and not self.is_output and not self.is_linked:
            layout.prop(node, field, text=text)
        else:
            layout.label(text=text)


class _InterfaceSocket:
    """A socket of a group's interface."""

    def draw(self, context, layout):
        pass


def _types() -> tuple[str, ...]:
    found = [o.type for d in definitions().values() for o in d.outputs]
    return tuple(dict.fromkeys([NUMBER, *found, ANY]))


def _classes(type_: str) -> Iterator[Any]:
    """The sockets of a type: of a node, and of a group's interface."""
    own, title = identifier(type_), type_.capitalize()
    for name, of, bases in (
        (own, "a node tree", (_Socket, bpy.types.NodeSocket)),
        (f"{own}_interface", "a group", (_InterfaceSocket, bpy.types.NodeTreeInterfaceSocket)),
    ):
        members = {"__doc__": f"Socket of {of}: {type_}", "bl_idname": name, "bl_label": title}
        yield type(name, bases, members | {"bl_socket_idname": own, "mu_type": type_})


CLASSES = tuple(made for type_ in _types() for made in _classes(type_))
