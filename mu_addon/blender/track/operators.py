"""Convert a clip of the Movie Clip Editor to an experiment in a folder of measured data."""

from pathlib import Path

import bpy

from ...errors import InputError
from ...studies.track import Track
from ..jobs.here import run_here
from ..shared.blender_property import Text
from ..shared.operators import FreeOperator, RootOperator, operator, unless
from ..unit import object as unit_object
from . import properties as bench
from . import state as tracking

NO_CLIP = "Open a clip of the bench in the Movie Clip Editor"


def clip_of(context):
    """The clip that the Movie Clip Editor shows, or None."""
    return getattr(context.space_data, "clip", None)


class _OnClip(RootOperator):
    find_root = staticmethod(clip_of)
    no_root, root_name, linked_too = NO_CLIP, "clip", True
    trouble = unless(lambda clip: clip.tracking.tracks, "Place markers first: Ctrl-click them in the clip")


@operator(_OnClip, "Track Markers")
def track(operator, context, clip):
    """Track the selected markers, or all, from this frame to the end of the clip"""
    scene, every = context.scene, list(clip.tracking.tracks)
    chosen = [track for track in every if track.select] or every
    tracking.prepare(chosen, clip.mu_bench.marks)
    for track in chosen:
        track.select = True
    # Blender's tracker stops at the scene's end, and loses its markers beyond the clip's.
    end = clip.frame_start + clip.frame_duration - 1
    if scene.frame_end > end:
        operator.report({"INFO"}, f"The scene ended at frame {scene.frame_end}, and ends with the clip now")
    scene.frame_end = end
    how = "EXEC_DEFAULT" if bpy.app.background else "INVOKE_DEFAULT"
    bpy.ops.clip.track_markers(how, backwards=False, sequence=True)


class _OfCompleteClip(FreeOperator):
    @classmethod
    def poll(cls, context):
        clip = clip_of(context)
        lacks = "" if clip is None else bench.missing(clip)
        if lacks:
            cls.poll_message_set(lacks)
        return not lacks


@operator(
    _OfCompleteClip,
    "Write Measured Data",
    clip=Text("Clip", "Name of a clip of this file. Empty: the one in the editor", options={"SKIP_SAVE"}),
)
def track_write(operator, context, clip):
    """Write angle, positions and pressure over time into a folder of measured data"""
    found = bpy.data.movieclips.get(clip) if clip else clip_of(context)
    if found is None:
        raise InputError(f"There is no clip {clip!r}" if clip else NO_CLIP)
    settings = found.mu_bench
    study = Track(
        clip=Path(found.name),
        bench=bench.bench_of(found),
        pressure=Path(bpy.path.abspath(settings.pressure)),
        followed=tracking.tracks_of(found),
    )
    work, warnings = run_here(study, Path(bpy.path.abspath(settings.folder)))
    for warning in warnings:
        operator.report({"WARNING"}, warning["what"])
    operator.report({"INFO"}, ". ".join(work.lines))
    root = unit_object.active_root(context)
    if root is not None and not root.mu_evidence.folder:
        root.mu_evidence.folder = settings.folder
