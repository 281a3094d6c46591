"""Drawing over every 3D viewport, in pixels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy


class Overlay:
    """A function that draws over every 3D viewport while it is registered; not in background."""

    def __init__(self, draw: Callable[[], None]) -> None:
        self._draw = draw
        self._handle: Any = None

    def register(self) -> None:
        """Start drawing."""
        if not bpy.app.background:
            self._handle = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")

    def unregister(self) -> None:
        """Stop drawing."""
        if self._handle is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")
            self._handle = None
