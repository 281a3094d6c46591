"""Markers tracked by Blender's movie clip tracker, in an open editor or without a window."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...errors import InputError
from ...measured.bench import MarkerSettings
from ...measured.video import Tracks

# Crosses show their rotation; a dot does not, and a tracker that fits its rotation drifts off.
MODELS = {"crosses": "LocRot", "dots": "Loc"}
CORRELATION = 0.75


def track_markers(path: Path, markers: MarkerSettings) -> Tracks:
    """Track markers through a clip from their positions in its first frame; raises InputError.

    The clip is removed from Blender's data afterwards.
    """
    try:
        clip = bpy.data.movieclips.load(str(Path(path).resolve()))
    except RuntimeError as error:
        raise InputError(
            "Blender cannot read this clip", str(path), "give a movie, or a picture of a sequence"
        ) from error
    try:
        size, frames = tuple(clip.size), clip.frame_duration
        if 0 in size or frames < 2:
            raise InputError(
                f"Blender finds {frames} frames of {size[0]} x {size[1]} pixels in this clip",
                str(path),
                "give a movie, or the first picture of a sequence that is numbered without gaps",
            )
        for name, at in markers.pixels.items():
            _place(clip, name, at, markers, str(path))
        with _editor(clip) as scene:
            scene.frame_end = max(scene.frame_end, frames)
            scene.frame_set(1)
            bpy.ops.clip.track_markers(backwards=False, sequence=True)
        return tracks_of(clip)
    finally:
        bpy.data.movieclips.remove(clip)


def tracks_of(clip: Any) -> Tracks:
    """Every marker of a clip through all of its frames; lost where it is missing or disabled."""
    tracks, frames = clip.tracking.tracks, clip.frame_duration
    width, height = clip.size
    pixels = np.full((len(tracks), frames, 2), np.nan)
    for row, track in zip(pixels, tracks, strict=True):
        for marker in track.markers:
            # The tracker leaves a disabled marker behind the last frame.
            if not marker.mute and 1 <= marker.frame <= frames:
                row[marker.frame - 1] = marker.co[0] * width, (1.0 - marker.co[1]) * height
    return Tracks(tuple(track.name for track in tracks), pixels, float(clip.fps))


def prepare(tracks: Iterable[Any], kind: str) -> None:
    """Set up tracks for markers of a kind: compared with the first frame, so that they do not drift."""
    for track in tracks:
        track.motion_model = MODELS[kind]
        track.pattern_match = "KEYFRAME"
        track.correlation_min = CORRELATION
        track.use_normalization = track.use_brute = True


def _place(clip: Any, name: str, at: tuple[float, float], markers: MarkerSettings, where: str) -> None:
    width, height = clip.size
    if not (0 <= at[0] <= width and 0 <= at[1] <= height):
        raise InputError(
            f"marker {name!r} at {at[0]:g}, {at[1]:g} is outside the picture of {width} x {height} pixels",
            where,
            "count pixels right and down from its upper left corner",
        )
    track = clip.tracking.tracks.new(name=name, frame=1)
    marker = track.markers[0]
    marker.co = at[0] / width, 1.0 - at[1] / height
    x, y = markers.pattern_px / 2 / width, markers.pattern_px / 2 / height
    marker.pattern_corners = ((-x, -y), (x, -y), (x, y), (-x, y))
    x, y = markers.search_px / 2 / width, markers.search_px / 2 / height
    marker.search_min, marker.search_max = (-x, -y), (x, y)
    track.select = True
    prepare([track], markers.marks)


@contextmanager
def _editor(clip: Any) -> Iterator[Any]:
    """Context with a clip editor that shows the clip, for operators; yields the scene, restores everything.

    Even without a window on the screen Blender has the window of its start-up file.
    """
    window = next(iter(bpy.context.window_manager.windows), None)
    if window is None:
        raise InputError(
            "this Blender has no window, not even a hidden one", "", "start it with its usual start-up file"
        )
    area, scene = window.screen.areas[0], window.scene
    kind, frame, end = area.ui_type, scene.frame_current, scene.frame_end
    area.ui_type = "CLIP_EDITOR"
    try:
        area.spaces.active.clip = clip
        region = next(region for region in area.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region):
            yield scene
    finally:
        area.ui_type = kind
        scene.frame_end = end
        scene.frame_set(frame)
