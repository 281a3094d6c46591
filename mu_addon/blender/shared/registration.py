"""Registration of property groups: their classes, and the property of Blender's type that holds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import bpy
from bpy.props import PointerProperty

from . import handlers

Functions = tuple[Callable[[], None], Callable[[], None]]


def property_group_factory(
    owner: Any, name: str, classes: Sequence[type], calls: Mapping[str, Callable[..., Any]] | None = None
) -> Functions:
    """Functions `register` and `unregister` of a property group, the last of `classes`.

    It becomes the property `name` of `owner`, such as bpy.types.Object; values stay in the file when the
    extension is removed and are found when it is installed again. calls: application handlers, see
    `handlers.add`.
    """
    add_classes, remove_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        add_classes()
        setattr(owner, name, PointerProperty(type=classes[-1]))
        handlers.add(calls or {})

    def unregister() -> None:
        handlers.remove(calls or {})
        delattr(owner, name)
        remove_classes()

    return register, unregister
