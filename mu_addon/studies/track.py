"""`track`: from a video of the bench to an experiment in a folder of measured data."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import attrs

from .. import lab_files, measured
from ..design.quantity import described
from ..errors import InputError
from ..run.parts import File, Part, Sentence, Warn, recorded
from ..run.study import Input, Study, derived, given, section, setting, stage
from .inputs import PlaceInput, asked


@attrs.frozen(eq=False)
class Experiment:
    """An experiment made from a video, as it is put into a folder, and all remarks on it."""

    found: measured.Filmed
    entry: measured.Entry
    remarks: tuple[measured.Remark, ...]


@attrs.frozen(kw_only=True, eq=False)
class Track(Study):
    """Track markers in a video of the bench with Blender's tracker and write measured data in mm and
    degrees.
    """

    name = "track"
    example = "track bench.mp4 --markers bench.toml --pressure ladder.csv --out measured"
    files = {"experiments.toml": "the experiments, as `diagnose` reads them", "*.csv": "their data"}
    joins = True
    page = ""

    clip: Path = asked(
        PlaceInput,
        "clip",
        "movie, first image of a sequence, or a table of tracked pixels (CSV), also by DeepLabCut, TrackMate "
        "or Kinovea",
        empty=attrs.NOTHING,
        argument="CLIP",
    )
    bench: measured.Bench = asked(
        Input,
        "markers",
        "description of the video, a TOML file: camera, base, tip, scale and markers",
        empty=attrs.NOTHING,
        kind="bench",
        value=lambda file: measured.read_bench(Path(file)),
        metavar="FILE",
        required=True,
    )
    pressure: Path = asked(
        PlaceInput,
        "pressure",
        "pressure, CSV with the columns time_s,pressure_kPa: a recording or the protocol",
        empty=attrs.NOTHING,
        metavar="CSV",
        required=True,
    )
    frame_rate: float = setting(
        described(
            "frame_rate",
            0.0,
            "frames per second; 0: that of the description or the clip, which is wrong in slow motion",
            low=0.0,
            high=1e6,
        ),
        metavar="F",
        option="fps",
    )
    followed: measured.Tracks | None = given(Input("followed"), default=None)
    """Markers that were followed already, in an open editor."""

    @derived
    def setup(self, bench: measured.Bench, frame_rate: float) -> measured.Bench:
        """The description with the frame rate that was asked for."""
        return attrs.evolve(bench, fps=frame_rate) if frame_rate else bench

    @stage("track", 10.0, kept=False)
    def experiment(
        self, clip: Path, setup: measured.Bench, pressure: Path, followed: measured.Tracks | None
    ) -> Experiment:
        """The experiment in the clip, which `diagnose` can read; raises InputError."""
        record = measured.read_pressure(pressure)
        tracks = tracks_in(clip, setup) if followed is None else followed
        found = measured.filmed(tracks, setup, record, str(clip))
        name = str(setup.experiment.get("name", clip.stem))
        entry = measured.entry_of(found, setup, name)
        return Experiment(found, entry, (*found.remarks, *entry.tried()))

    @section()
    def answer(self, experiment: Experiment, setup: measured.Bench) -> Iterator[Part]:
        """The experiment's files, its figures, and remarks."""
        import numpy as np

        found, entry = experiment.found, experiment.entry
        for remark in experiment.remarks:
            yield Warn(remark.what, remark.where, remark.remedy, repeated=False)
        yield from measured.added([entry])
        pixels = f"{Path(entry.file).stem}.pixels.csv"
        yield File(pixels, lambda path: measured.pixels_text(found, setup.starts_s))
        m, kPa = found.motion, found.pressure_kPa
        lost = {n: int(np.isnan(p[:, 0]).sum()) for n, p in zip(m.names, m.places_mm, strict=True)}
        span_s = float(found.time_s[-1] - found.time_s[0])
        angle = m.angle_deg
        facts = {
            "experiment": entry.name,
            "file": entry.file,
            "frames": len(found.tracks),
            "duration_s": span_s,
            "pressure_kPa": [float(kPa.min()), float(kPa.max())],
            "angle_deg": None if angle is None else [float(np.nanmin(angle)), float(np.nanmax(angle))],
            "mm_per_pixel": m.mm_per_pixel,
            "noise_px": m.noise_px,
            "frames_lost": lost,
            "remarks": [remark.what for remark in experiment.remarks],
        }
        for key, value in facts.items():
            yield recorded(key, value)
        words = (
            f"{entry.name}: {len(found.tracks)} frames, {span_s:.4g} s, {kPa.min():g} to {kPa.max():g} kPa"
        )
        yield Sentence(f"{words}; {m.mm_per_pixel:.4g} mm a pixel", terminal=True)
        if angle is not None:
            words = f"angle: {np.nanmin(angle):+.2f} to {np.nanmax(angle):+.2f} deg"
            yield Sentence(words, terminal=True)
        gone = [f"{name} in {count} frames" for name, count in lost.items() if count]
        if gone:
            yield Sentence(f"lost: {', '.join(gone)}", terminal=True)


def tracks_in(clip: Path, bench: measured.Bench) -> measured.Tracks:
    """Markers in a clip, followed by Blender, or in a table of pixels; raises InputError."""
    if not clip.exists():
        remedy = "give a movie, or the first picture of a sequence"
        raise InputError("the clip does not exist", str(clip), remedy)
    if clip.suffix.lower() in (*lab_files.SUFFIXES, *lab_files.PROJECTS):
        return lab_files.read_pixels(clip)
    view = bench.view
    unplaced = {*view.base, *(view.tip or ()), *(view.ruler or ())} - {*bench.markers.pixels}
    if unplaced:
        remedy = "give its pixel position in the first frame"
        raise InputError(f"marker {min(unplaced)!r} has no pixel", str(clip), remedy)
    if find_spec("bpy") is None:
        raise InputError(
            "tracking markers needs Blender",
            str(clip),
            "run it in Blender, blender -b -P headless/run.py -- track ..., or with the bpy wheel; or "
            "give a CSV of pixel positions from another tracker",
        )
    # By name: the core imports Blender's side on request alone.
    tracker: Any = import_module("..blender.track.state", __package__)
    found: measured.Tracks = tracker.track_markers(clip, bench.markers)
    return found
