"""The 3D views of every window, and having them drawn again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy


def areas() -> Iterator[Any]:
    """The areas of every window that show a 3D view."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield area


def redraw() -> None:
    """Have every 3D view and its panels drawn again."""
    for area in areas():
        area.tag_redraw()


def redraw_views(panels: bool) -> None:
    """Have every 3D view drawn again without its tool bars, with its sidebar only if `panels`."""
    for area in areas():
        for region in area.regions:
            if region.type == "WINDOW" or (panels and region.type == "UI"):
                region.tag_redraw()


def redraw_headers() -> None:
    """Have the header of every 3D view drawn again."""
    for area in areas():
        for region in area.regions:
            if region.type == "HEADER":
                region.tag_redraw()
