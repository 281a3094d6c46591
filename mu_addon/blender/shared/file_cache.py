"""Results of reading files, cached until one of them changes: panels ask many times a second.

Pictures among them are previews for panels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

import bpy.utils.previews

from ...errors import MuError
from .registration import at_end, at_start

T = TypeVar("T")
UNREADABLE = (OSError, ValueError, KeyError, TypeError, MuError)
"""Errors that reading an incomplete file, or one of another kind, may raise."""


class FileCache(Generic[T]):
    """Results of reading files, by the first of these files; each is read again when a file changes."""

    def __init__(self) -> None:
        self._kept: dict[Path, tuple[tuple[Any, ...], T | None]] = {}

    def read(self, files: Sequence[Path], read: Callable[[], T]) -> T | None:
        """Return `read()`, from memory while no file has changed its time or size.

        None where the first file is not there, or where `read` raises one of `UNREADABLE`.
        """
        state = tuple(_state(path) for path in files)
        if state[0] is None:
            return None
        kept = self._kept.get(files[0])
        if kept is None or kept[0] != state:
            try:
                kept = state, read()
            except UNREADABLE:
                kept = state, None
            self._kept[files[0]] = kept
        return kept[1]

    def clear(self) -> None:
        """Empty the cache."""
        self._kept.clear()


def _state(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size


_previews: Any = None
_icons: FileCache[int] = FileCache()


def icon_of(path: Path) -> int | None:
    """Number of a picture's preview for `template_icon`; None where there is no such file."""
    return _icons.read([path], lambda: _load(str(path)))


def _load(name: str) -> int:
    _previews.pop(name, None)
    return int(_previews.load(name, name, "IMAGE", force_reload=True).icon_id)


@at_start
def _open() -> None:
    """Create the collection of previews."""
    global _previews
    _previews = bpy.utils.previews.new()


@at_end
def _close() -> None:
    global _previews
    bpy.utils.previews.remove(_previews)
    _previews = None
    _icons.clear()
