"""`track`: from a video of the bench to an experiment in a folder of measured data."""

from __future__ import annotations

import argparse
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..usecases.track_video.run import Tracker
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `track`."""
    command = commands.add_parser(
        "track",
        help="Track markers in a video of the bench with Blender's tracker and write measured data in mm "
        "and degrees.",
        epilog="example: run.py track bench.mp4 --markers bench.toml --pressure ladder.csv --out measured",
    )
    command.add_argument(
        "clip",
        metavar="CLIP",
        help="Movie, first image of a sequence, or a table of tracked pixels (CSV), also by DeepLabCut, "
        "TrackMate or Kinovea.",
    )
    command.add_argument(
        "--markers",
        required=True,
        metavar="FILE",
        help="Description of the video, a TOML file: camera, base, tip, scale and markers.",
    )
    command.add_argument(
        "--pressure",
        required=True,
        metavar="CSV",
        help="Pressure, CSV with the columns time_s,pressure_kPa: a recording or the protocol.",
    )
    command.add_argument(
        "--fps",
        type=float,
        metavar="F",
        help="Frame rate in frames per second (default: as given in FILE or in the clip).",
    )
    add_results(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Track the markers and put the experiment into the folder."""
    import attrs

    from ..usecases.track_video.run import read_bench, track_into

    require_out(options)
    bench = read_bench(Path(options.markers))
    if options.fps is not None:
        bench = attrs.evolve(bench, fps=options.fps)
    track_into(Path(options.out), Path(options.clip), bench, Path(options.pressure), _tracker(), context)


def _tracker() -> Tracker:
    """Blender's tracker, if there is a Blender."""

    def follow(clip: Path, markers: Any) -> Any:
        from ..errors import InputError

        if find_spec("bpy") is None:
            raise InputError(
                "tracking markers needs Blender",
                str(clip),
                "run it in Blender, blender -b -P headless/run.py -- track ..., or with the bpy wheel; or "
                "give a CSV of pixel positions from another tracker",
            )
        # By name: the command line knows only the core, and imports Blender's side on request.
        return import_module("..blender.track.state", __package__).track_markers(clip, markers)

    return follow
