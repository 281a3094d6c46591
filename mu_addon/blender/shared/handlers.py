"""Blender's application handlers, by the names of its lists in `bpy.app.handlers`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import bpy


def add(handlers: Mapping[str, Callable[..., Any]]) -> None:
    """Append each handler to its list in Blender."""
    for name, handler in handlers.items():
        getattr(bpy.app.handlers, name).append(handler)


def remove(handlers: Mapping[str, Callable[..., Any]]) -> None:
    """Remove them, if still present: loading a file drops those that are not persistent."""
    for name, handler in handlers.items():
        listed = getattr(bpy.app.handlers, name)
        if handler in listed:
            listed.remove(handler)
