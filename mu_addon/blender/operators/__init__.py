"""What a designer does: one module a subject, one undo step an action, scriptable as `bpy.ops.mu.*`."""

from __future__ import annotations

import bpy

from . import path, preset, simulate, solid, unit

CLASSES = (*unit.CLASSES, *preset.CLASSES, *path.CLASSES, *simulate.CLASSES, *solid.CLASSES)


def register() -> None:
    """All operators."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """All operators."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
