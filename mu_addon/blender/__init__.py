"""The Blender extension; the only package that imports bpy, and no module of the core imports it.

Every module of a room is registered, see `shared.registration`: a new file needs no entry anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules

from .shared import registration

ROOMS = (
    # Panels appear in the sidebar in this order, that of the work.
    *("shared", "unit", "sidebar", "steps", "path", "simulate", "obstacles", "results", "optimize"),
    *("evidence", "printing", "sensor", "gripper", "track", "node_tree"),
)  # fmt: skip
"""Rooms that come first, in order; the others follow."""
OTHER_PROCESS = "child_main"
"""The module that is the entry point of another process."""


def register() -> None:
    """Register classes, menus and handlers with Blender; on failure nothing is left behind."""
    registration.register(_modules())


def unregister() -> None:
    """Unregister everything, and end the jobs that need Blender."""
    registration.unregister()


def _modules() -> Iterator[object]:
    rooms = [room.name for room in iter_modules(__path__)]
    for room in (*ROOMS, *(room for room in rooms if room not in ROOMS)):
        for module in iter_modules(import_module(f".{room}", __name__).__path__):
            if module.name != OTHER_PROCESS:
                yield import_module(f".{room}.{module.name}", __name__)
