"""The scene's timeline in seconds since its first frame."""

from __future__ import annotations

from typing import Any


def _rate(scene: Any) -> float:
    return float(scene.render.fps / scene.render.fps_base)


def step_s(scene: Any) -> float:
    """Seconds from one frame to the next."""
    return 1.0 / _rate(scene)


def frames_at(scene: Any, seconds: Any) -> Any:
    """Frames, a number or (n,), at times in s."""
    return scene.frame_start + seconds * _rate(scene)


def seconds_at(scene: Any, frames: Any = None) -> Any:
    """Times in s of frames, a number or (n,); of the present one without."""
    now = scene.frame_current_final if frames is None else frames
    return (now - scene.frame_start) / _rate(scene)
