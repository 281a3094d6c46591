"""The tab MU in the sidebar of the Movie Clip Editor: from a video of the bench to measured data."""

from __future__ import annotations

import bpy

from ..shared.panels import fold, large_button, wrapped
from . import properties as bench
from .operators import NO_CLIP, clip_of


class MU_PT_track(bpy.types.Panel):
    """From a video of the bench to an experiment for the Evidence panel"""

    bl_label = "Monolithic Unit on the Bench"
    bl_space_type = "CLIP_EDITOR"
    bl_region_type = "UI"
    bl_category = "MU"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        clip = clip_of(context)
        if clip is None:
            wrapped(layout, NO_CLIP, "INFO")
            return
        settings = clip.mu_bench
        _markers(layout, clip, settings)
        _scale(layout, clip, settings)
        _time(layout, clip, settings)
        body = fold(layout, "MU_experiment", "Experiment")
        if body:
            for name in ("title", "role", "unit_scale", "orientation_deg", "specimen"):
                body.prop(settings, name)
        layout.prop(settings, "folder")
        lacks = bench.missing(clip)
        if lacks:
            wrapped(layout, lacks, "INFO")
        large_button(layout, "mu.track_write", "EXPORT")


def _markers(layout, clip, settings):
    layout.prop(settings, "camera")
    layout.prop(settings, "marks")
    large_button(layout, "mu.track", "TRACKING_FORWARDS")
    column = layout.column(align=True)
    for name in ("base_1", "base_2"):
        column.prop_search(settings, name, clip.tracking, "tracks", icon="TRACKER")
        column.prop(settings, f"{name}_mm", text="y, z (mm)")
    column = layout.column(align=True)
    for name in ("tip_1", "tip_2"):
        column.prop_search(settings, name, clip.tracking, "tracks", icon="TRACKER")


def _scale(layout, clip, settings):
    layout.prop(settings, "scale_by")
    if settings.scale_by == "ruler":
        column = layout.column(align=True)
        for name in ("ruler_1", "ruler_2"):
            column.prop_search(settings, name, clip.tracking, "tracks", icon="TRACKER")
        column.prop(settings, "ruler_mm")
    elif settings.scale_by == "number":
        layout.prop(settings, "mm_per_pixel")
    layout.prop(settings, "follow_base")


def _time(layout, clip, settings):
    layout.prop(settings, "pressure")
    column = layout.column(align=True)
    column.prop(settings, "fps")
    if settings.fps == 0.0 and clip.fps > 0.0:
        column.label(text=f"{clip.fps:g} in the clip", icon="INFO")
    column.prop(settings, "starts_s")
