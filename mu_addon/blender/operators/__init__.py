"""What a designer does: one module a subject, one undo step an action, scriptable as `bpy.ops.mu.*`."""

from __future__ import annotations

import bpy

from . import (
    body,
    evidence,
    grip,
    library,
    motion,
    obstacle,
    path,
    preset,
    printing,
    sensor,
    simulate,
    solid,
    step,
    track,
    unit,
)

MODULES = (
    unit,
    preset,
    path,
    simulate,
    motion,
    solid,
    printing,
    step,
    body,
    obstacle,
    grip,
    library,
    evidence,
    track,
    sensor,
)
CLASSES = tuple(cls for module in MODULES for cls in module.CLASSES)


def register() -> None:
    """All operators."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """All operators."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
