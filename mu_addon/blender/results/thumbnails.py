"""Pictures of a study as previews for panels, loaded again when they change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy.utils.previews

from ..shared.file_cache import FileCache

_previews: Any = None
_icons: FileCache[int] = FileCache()


def icon_of(path: Path) -> int | None:
    """Number of a picture's preview for `template_icon`; None where there is no such file."""
    return _icons.read([path], lambda: _load(str(path)))


def _load(name: str) -> int:
    _previews.pop(name, None)
    return int(_previews.load(name, name, "IMAGE", force_reload=True).icon_id)


def register() -> None:
    """Create the collection of previews."""
    global _previews
    _previews = bpy.utils.previews.new()


def unregister() -> None:
    """Remove it."""
    global _previews
    bpy.utils.previews.remove(_previews)
    _previews = None
    _icons.clear()
