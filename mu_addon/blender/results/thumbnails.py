"""Pictures of a study as previews that a panel can draw, loaded when they change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy.utils.previews

_previews: Any = None
_times: dict[str, float] = {}


def icon_of(path: Path) -> int | None:
    """Number of a picture's preview, to be drawn by `template_icon`; None where there is no such file."""
    try:
        time = path.stat().st_mtime
    except OSError:
        return None
    name = str(path)
    if _times.get(name) != time:
        _previews.pop(name, None)
        _previews.load(name, name, "IMAGE", force_reload=True)
        _times[name] = time
    return int(_previews[name].icon_id)


def register() -> None:
    """Room for the previews."""
    global _previews
    _previews = bpy.utils.previews.new()


def unregister() -> None:
    """Give it back."""
    global _previews
    bpy.utils.previews.remove(_previews)
    _previews = None
    _times.clear()
