"""Registration: property groups, application handlers, and connections to signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import bpy
from bpy.props import PointerProperty

from .updates import Signal

Functions = tuple[Callable[[], None], Callable[[], None]]
Handlers = Mapping[str, Callable[..., Any]]
"""Application handlers, by the names of Blender's lists in `bpy.app.handlers`."""
Connections = Sequence[tuple[Signal, Callable[[Any], Any]]]


def add_handlers(handlers: Handlers, connections: Connections = ()) -> None:
    """Append each handler to its list in Blender, and connect each function to its signal."""
    for name, handler in handlers.items():
        getattr(bpy.app.handlers, name).append(handler)
    for signal, function in connections:
        signal.connect(function)


def remove_handlers(handlers: Handlers, connections: Connections = ()) -> None:
    """Undo `add_handlers`; loading a file drops handlers that are not persistent."""
    for signal, function in connections:
        signal.disconnect(function)
    for name, handler in handlers.items():
        listed = getattr(bpy.app.handlers, name)
        if handler in listed:
            listed.remove(handler)


def property_group_factory(
    owner: Any, name: str, classes: Sequence[type], calls: Handlers | None = None
) -> Functions:
    """Functions `register` and `unregister` of a property group, the last of `classes`.

    It becomes the property `name` of `owner`, such as bpy.types.Object; values stay in the file when the
    extension is removed and are found when it is installed again. calls: application handlers.
    """
    add_classes, remove_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        add_classes()
        setattr(owner, name, PointerProperty(type=classes[-1]))
        add_handlers(calls or {})

    def unregister() -> None:
        remove_handlers(calls or {})
        delattr(owner, name)
        remove_classes()

    return register, unregister
