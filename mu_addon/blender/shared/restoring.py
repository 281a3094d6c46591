"""Whether undo or redo restores a state now: what becomes active or appears then was chosen before."""

from __future__ import annotations

from typing import Any

from .registration import RESTORED, handler

_now = False


def now() -> bool:
    """Return True during undo or redo."""
    return _now


@handler("undo_pre", "redo_pre")
def _begin(*_: Any) -> None:
    global _now
    _now = True


@handler(*RESTORED)
def _end(*_: Any) -> None:
    global _now
    _now = False
