"""Setup of a clip, kept on the clip itself, and the core's description from it."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from typing import Any

import bpy

from ...design.settings import ORIENTATION
from ...errors import InputError
from ...graph.definition import FILE
from ...measured.bench import Bench, MarkerSettings
from ...measured.kinds import BETWEEN, ROLES
from ...measured.video import View
from ..shared.blender_property import (
    Choice,
    Flag,
    FloatVector,
    Number,
    Text,
    blender_property,
    exact,
    input_of,
    path_property,
)
from ..shared.registration import property_of

SCALES = BETWEEN["scale"]


def _track(name: str, description: str):
    return Text(name, description)


def _place(name: str):
    return FloatVector(
        name,
        "Its y (toward more lattice) and z (along the axis) in the unit's frame, mm",
        size=2,
        precision=2,
    )


@property_of(bpy.types.MovieClip, "mu_bench")
class MU_PG_bench(bpy.types.PropertyGroup):
    """Setup of a video: the object, the view, and the markers."""

    camera: Choice(
        "Camera at",
        "Side of the unit that the camera looks from, along x",
        items=[
            ("+x", "+x", "With the axis upward, the side with more lattice (+y) is on the right"),
            ("-x", "-x", "With the axis upward, the side with more lattice (+y) is on the left"),
        ],
    )
    marks: Choice(
        "Markers are",
        "Kind of markers",
        items=[
            ("crosses", "Crosses", "Checks or crosses, which show their rotation: the tracker follows it"),
            (
                "dots",
                "Dots",
                "Round dots look the same when they turn: the tracker follows their position only",
            ),
        ],
    )
    base_1: _track("Base", "A marker fixed to the unit's base or its clamp")
    base_2: _track("Base, Other", "Another marker on the base; the farther apart, the better")
    base_1_mm: _place("Place of Base")
    base_2_mm: _place("Place of Base, Other")
    tip_1: _track("Tip", "A marker on the tip's end; without a tip, only places are written")
    tip_2: _track("Tip, Other", "Another marker on the tip's end; the farther apart, the better")
    scale_by: Choice(
        "Scale by",
        "How the scale, millimetres per pixel, is known",
        items=[
            ("base", "Base", "The places of the two markers on the base"),
            ("ruler", "Ruler", "Two marks of a known distance, as far from the camera as the markers"),
            ("number", "Number", "Millimetres a pixel, known otherwise"),
        ],
    )
    ruler_1: _track("Ruler", "A mark on a ruler")
    ruler_2: _track("Ruler, Other", "Another mark on the ruler")
    ruler_mm: Number("Distance (mm)", "Distance of the ruler's two marks", min=0.0, default=50.0)
    mm_per_pixel: Number("mm a Pixel", "Size of a pixel in the plane of the markers", min=0.0, precision=5)
    follow_base: Flag(
        "Base Moves",
        "Measure relative to the base in each frame, for a camera or clamp that moves; otherwise "
        "relative to its mean position, which gives less noise",
    )
    fps: blender_property(input_of("track", "frame_rate"), precision=2)
    starts_s: Number("Starts at (s)", "Time of the pressure's record at the clip's first frame", precision=3)
    pressure: blender_property(input_of("track", "pressure"), path=FILE)
    folder: path_property(
        "Measured Data", "Folder that gets the experiment; other clips may be in it already", folder=True
    )
    title: Text("Experiment", "Name of the experiment. Empty: the clip's")
    role: Choice(
        "Role",
        "Use of the experiment",
        items=[
            (ROLES[0], "Fit", "The model may be fitted to it"),
            (
                ROLES[1],
                "Held Out",
                "Not used before the verdict: it shows how much the verdict improves the model",
            ),
        ],
    )
    unit_scale: Number(
        "Scale", "Scale of the unit that was filmed", default=1.0, min=SCALES[0], max=SCALES[1]
    )
    orientation_deg: blender_property(ORIENTATION, name="Gravity about x (deg)")
    specimen: Text("Specimen", "Name of the print, such as A; may be empty")


def missing(clip: Any) -> str:
    """Missing settings of a clip before it can be measured, as text; "" if it is complete."""
    bench, names = clip.mu_bench, {track.name for track in clip.tracking.tracks}
    if len(names) < 2:
        return "Place markers first: Ctrl-click them in the clip, two on the base and two on the tip"
    wanted = {"Base": (bench.base_1, bench.base_2)}
    if bench.tip_1 or bench.tip_2:
        wanted["Tip"] = (bench.tip_1, bench.tip_2)
    if bench.scale_by == "ruler":
        wanted["Ruler"] = (bench.ruler_1, bench.ruler_2)
    for role, pair in wanted.items():
        if not set(pair) <= names or pair[0] == pair[1]:
            return f"{role}: choose two of the clip's markers"
    if tuple(bench.base_1_mm) == tuple(bench.base_2_mm):
        return "Give the places of the base's two markers in the unit's frame"
    if bench.scale_by == "number" and bench.mm_per_pixel == 0.0:
        return "Give the millimetres a pixel"
    if bench.fps == 0.0 and clip.fps == 0.0:
        return "Give the frames per second: a sequence of pictures has none"
    for name in ("pressure", "folder"):
        if not getattr(bench, name):
            return (
                f"Choose the {'CSV file of the pressure' if name == 'pressure' else 'folder to write into'}"
            )
    return ""


def bench_of(clip: Any) -> Bench:
    """The core's description of a clip; raises InputError for missing settings."""
    lacks = missing(clip)
    if lacks:
        raise InputError(lacks, clip.name, "sidebar of the clip editor, tab MU")
    b = clip.mu_bench
    view = View(
        (b.base_1, b.base_2),
        (_pair(b.base_1_mm), _pair(b.base_2_mm)),
        (b.tip_1, b.tip_2) if b.tip_1 else None,
        camera=b.camera,
        ruler=(b.ruler_1, b.ruler_2) if b.scale_by == "ruler" else None,
        ruler_mm=exact(b.ruler_mm) if b.scale_by == "ruler" else None,
        mm_per_pixel=exact(b.mm_per_pixel) if b.scale_by == "number" else None,
        follow_base=b.follow_base,
    )
    experiment = {"role": b.role, "scale": exact(b.unit_scale), "orientation_deg": exact(b.orientation_deg)}
    named = {"name": b.title, "specimen": b.specimen}
    experiment |= {key: value for key, value in named.items() if value}
    return Bench(view, MarkerSettings({}, b.marks), exact(b.fps) or None, exact(b.starts_s), experiment)


def _pair(values: Any) -> tuple[float, float]:
    return exact(values[0]), exact(values[1])
