"""Measured data from a tracked video: pressure, angle, positions.

Tracks come from Blender's tracker, or from any other as a CSV file of pixels.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.toml_text import line_of, parse, place
from ...errors import InputError
from ...files import write_text
from ...measured.kinds import COMMON, KINDS
from ...measured.pose import AT_REST, SAMPLES
from ...measured.table import Remark, read_table
from ...measured.video import Motion, Pair, Tracks, View, motion, resting
from ...measured.writing import add_experiment, csv_text, file_stem, tried
from ...reading import is_finite, read_text, unreadable
from ...run.context import RunContext
from ...table_cells.own_tables import own_text
from ...toml_writer import toml_text
from .tracked_table import PROJECTS, SUFFIXES, read_pixels

Array = np.ndarray[Any, Any]

KIND = "unit_pressure"
HEAD = (
    "camera",
    "base",
    "tip",
    "ruler",
    "ruler_mm",
    "mm_per_pixel",
    "follow_base",
    "fps",
    "starts_s",
    "marks",
    "pattern_px",
    "search_px",
    "marker",
)
OF_MARKER = ("name", "pixel", "place_mm")
OF_EXPERIMENT = tuple(k for k in COMMON + KINDS[KIND].may_have_keys if k not in ("kind", "file"))
MARKER_KINDS = ("crosses", "dots")
"""Kinds of markers: `crosses` show their rotation, `dots` do not."""


@attrs.frozen
class MarkerSettings:
    """Settings of the markers for a tracker.

    pixels: position of each by name in the first frame, right and down from the upper left corner; kind: one
    of `MARKER_KINDS`; pattern_px: side of the compared square; search_px: side of the searched square.
    """

    pixels: Mapping[str, tuple[float, float]]
    kind: str = "crosses"
    pattern_px: float = 25.0
    search_px: float = 81.0


@attrs.frozen
class Bench:
    """Setup of a video: the view, the markers, the clock, and keys of the experiment.

    fps: frames a second, None for the clip's; starts_s: the pressure's clock at the first frame.
    """

    view: View
    markers: MarkerSettings
    fps: float | None = None
    starts_s: float = 0.0
    experiment: Mapping[str, Any] = attrs.field(factory=dict)


Tracker = Callable[[Path, MarkerSettings], Tracks]


@attrs.frozen(eq=False)
class Filmed:
    """An experiment made from a video: rows within the pressure's record, and remarks on it."""

    tracks: Tracks
    time_s: Array
    pressure_kPa: Array
    motion: Motion
    remarks: tuple[Remark, ...]


def read_bench(path: Path) -> Bench:
    """Read a TOML file that describes a video; raises InputError with line and remedy."""
    text = read_text(path, "description of the video", "check path and file")
    document = parse(text, {"": HEAD, "experiment": OF_EXPERIMENT}, str(path))

    def at(key: str) -> str:
        return place(str(path), line_of(text, key))

    pixels, places = _markers(document.get("marker"), str(path))
    base = _pair(document, "base", at)
    if base is None:
        raise InputError("the base is not named", str(path), 'name its two markers, base = ["low", "high"]')
    missing = [name for name in base if name not in places]
    if missing:
        raise InputError(
            f"marker {missing[0]!r} of the base has no place_mm",
            str(path),
            "give its y and z in the unit's frame, in mm",
        )
    markers = MarkerSettings(
        pixels, **_given(document, at, kind="marks", pattern_px="pattern_px", search_px="search_px")
    )
    if markers.kind not in MARKER_KINDS:
        raise InputError(
            f"marks = {markers.kind!r} is not known", at("marks"), f"say {' or '.join(MARKER_KINDS)}"
        )
    if not 5 <= markers.pattern_px < markers.search_px <= 2000:
        raise InputError(
            f"pattern_px = {markers.pattern_px:g} and search_px = {markers.search_px:g} do not fit",
            at("pattern_px"),
            "a pattern of 5 pixels or more, and a larger square to search",
        )
    view = View(
        base,
        (places[base[0]], places[base[1]]),
        _pair(document, "tip", at),
        ruler=_pair(document, "ruler", at),
        **_given(
            document,
            at,
            camera="camera",
            ruler_mm="ruler_mm",
            mm_per_pixel="mm_per_pixel",
            follow_base="follow_base",
        ),
    )
    return Bench(
        view,
        markers,
        experiment=document.get("experiment", {}),
        **_given(document, at, fps="fps", starts_s="starts_s"),
    )


_TYPES = {"camera": str, "marks": str, "follow_base": bool}


def _given(document: Mapping[str, Any], at: Callable[[str], str], **keys: str) -> dict[str, Any]:
    """Values of the keys that are present, of their type, by the names they are wanted under."""
    found = {}
    for name, key in keys.items():
        if key not in document:
            continue
        value, wanted = document[key], _TYPES.get(key, float)
        if wanted is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, wanted) or (isinstance(value, float) and not math.isfinite(value)):
            kinds = {str: "a text", bool: "true or false", float: "a number"}
            raise InputError(f"{key} = {value!r} is not {kinds[wanted]}", at(key), "correct that line")
        found[name] = value
    return found


def _pair(document: Mapping[str, Any], key: str, at: Callable[[str], str]) -> Pair | None:
    value = document.get(key)
    if value is None:
        return None
    if not (isinstance(value, list) and len(value) == 2 and all(isinstance(v, str) for v in value)):
        raise InputError(f"{key} = {value!r} is not a pair of names", at(key), 'write it as ["one", "other"]')
    return value[0], value[1]


def _markers(
    tables: Any, origin: str
) -> tuple[dict[str, tuple[float, float]], dict[str, tuple[float, float]]]:
    """Pixels and positions of the markers by name."""
    pixels: dict[str, tuple[float, float]] = {}
    places: dict[str, tuple[float, float]] = {}
    names: list[str] = []
    for table in tables if isinstance(tables, list) else []:
        name = table.get("name") if isinstance(table, dict) else None
        if not isinstance(name, str) or not name or name in names:
            raise InputError(f"a marker is named {name!r}", origin, "give each [[marker]] a different name")
        names.append(name)
        for key, value in table.items():
            if key not in OF_MARKER:
                raise InputError(
                    f"marker {name!r} has an unknown key {key!r}", origin, f"known: {', '.join(OF_MARKER)}"
                )
            if key == "name":
                continue
            if not (isinstance(value, list) and len(value) == 2 and all(is_finite(v) for v in value)):
                raise InputError(
                    f"{key} = {value!r} of marker {name!r} is not a pair of numbers",
                    origin,
                    "write it as [1.0, 2.0]",
                )
            (pixels if key == "pixel" else places)[name] = float(value[0]), float(value[1])
    if not names:
        raise InputError("no marker is defined", origin, "define each marker under [[marker]]")
    return pixels, places


def read_pressure(path: Path) -> tuple[Array, Array]:
    """Time in s and pressure in kPa, (k,) each, of a recording or a protocol; raises InputError."""
    try:
        text = own_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot read the pressure: {unreadable(error)}",
            str(path),
            "give a CSV file of time_s,pressure_kPa",
        ) from error
    table = read_table(text, KINDS["pressure_hold"], Path(path))
    return table.columns["time_s"], table.columns["pressure_kPa"]


def filmed(tracks: Tracks, bench: Bench, pressure: tuple[Array, Array], where: str = "") -> Filmed:
    """An experiment from followed markers and the pressure (time in s, kPa) of the same time.

    Frames outside the pressure's record are left out. Raises InputError for a clip without a clock or outside
    the record's time, and a view that does not fit.
    """
    remarks = list(tracks.remarks)
    fps = bench.fps if bench.fps is not None else tracks.fps
    wrong = not (math.isfinite(fps) and fps > 0)
    if wrong and (bench.fps is not None or tracks.time_s is None):
        raise InputError("the clip has no frame rate", where, "give fps, or a column time_s")
    if tracks.time_s is not None:
        time = bench.starts_s + tracks.time_s
        if bench.fps is not None:
            remarks.append(
                Remark(
                    f"the markers' own time_s is used; fps = {bench.fps:g} is not used",
                    where,
                    "leave fps out, or remove the column time_s where it is wrong",
                )
            )
    else:
        time = bench.starts_s + np.arange(len(tracks)) / fps
    clock, kPa = pressure
    slack = 0.5 * float(np.median(np.diff(time)))
    inside = (time >= clock[0] - slack) & (time <= clock[-1] + slack)
    if inside.sum() < 2:
        raise InputError(
            f"the clip lasts from {time[0]:.4g} to {time[-1]:.4g} s, the pressure record from "
            f"{clock[0]:.4g} to {clock[-1]:.4g} s",
            where,
            "give starts_s, the pressure's clock at the first frame",
        )
    if not inside.all():
        remarks.append(
            Remark(
                f"{(~inside).sum()} of {len(inside)} frames are outside the pressure record and were left "
                "out",
                where,
                "start the pressure record before the clip and end it after",
            )
        )
    kept = attrs.evolve(tracks, pixels=tracks.pixels[:, inside], time_s=time[inside] - bench.starts_s)
    time = time[inside]
    p = np.interp(time, clock, kPa)
    needed = [*bench.view.base, *(bench.view.tip or ())]
    seen = np.array([np.isfinite(kept.of(name)).all(axis=1) for name in needed])
    rest = resting(p, seen, AT_REST, SAMPLES)
    if not rest.any() and seen.all(axis=0).any():
        first = int(np.argmax(seen.all(axis=0)))
        rest[first] = True
        remarks.append(
            Remark(
                f"no frame shows the unit at rest; angles are relative to {p[first]:.4g} kPa at "
                f"{time[first]:.4g} s",
                where,
                "begin the clip at zero pressure; `diagnose` fits the zero of the angle in any case",
            )
        )
    found = motion(kept, bench.view, rest, time, where)
    return Filmed(kept, time, p, found, (*remarks, *found.remarks))


def write_experiment(found: Filmed, bench: Bench, name: str, folder: Path) -> tuple[Path, tuple[Remark, ...]]:
    """Put an experiment into a folder of measured data; return its CSV file and the reader's remarks.

    An experiment of that name made from a video before is replaced. Raises InputError where another holds the
    name, or the data could not be read again; OutputError.
    """
    table = f"{file_stem(name)}.csv"
    block = _block(name, table, bench)
    remarks = add_experiment(folder, name, block, table, _table(found, bench))
    write_text(folder / f"{file_stem(name)}.pixels.csv", _pixels(found, bench.starts_s))
    return folder / table, remarks


def _block(name: str, file: str, bench: Bench) -> str:
    keys = {"name": name, "kind": KIND, "file": file, "role": "fit"} | dict(bench.experiment) | {"name": name}
    return "[[experiment]]\n" + toml_text(keys)


def _table(found: Filmed, bench: Bench) -> str:
    """CSV file of an experiment: a comment on its origin, then a row for each frame."""
    m, view = found.motion, bench.view
    stream = io.StringIO()
    stream.write(f"# from a video; {m.mm_per_pixel:.6g} mm a pixel, noise {m.noise_px:.2g} pixels\n")
    # Clamp and ruler are not of the unit.
    numbered = [name for name in m.names if name not in (*view.base, *(view.ruler or ()))]
    for number, name in enumerate(numbered, 1):
        stream.write(f"# marker{number} is {name!r}\n")
    if view.tip:
        against = "tracked in each frame" if view.follow_base else "assumed fixed"
        stream.write(f"# angle of {view.tip[0]!r}, {view.tip[1]!r} against the base, {against}\n")
    columns = {"time_s": found.time_s, "pressure_kPa": found.pressure_kPa}
    if m.angle_deg is not None:
        columns["angle_deg"] = m.angle_deg
    for number, name in enumerate(numbered, 1):
        at = m.places_mm[m.names.index(name)]
        columns |= {f"marker{number}_{a}_mm": at[:, k] for k, a in enumerate("yz")}
    return stream.getvalue() + _csv(columns)


def _csv(columns: Mapping[str, Array]) -> str:
    """CSV text of columns (n,), rounded to a micrometre."""
    return csv_text(columns, lambda v: f"{v:.10g}" if v == int(v) else f"{v:.6f}")


def _pixels(found: Filmed, starts_s: float) -> str:
    """Positions in the picture, a row for each frame with the clip's time, in the format of `read_pixels`."""
    columns: dict[str, Array] = {"time_s": found.time_s - starts_s}
    for name, at in zip(found.tracks.names, found.tracks.pixels, strict=True):
        columns |= {f"{name} right_px": at[:, 0], f"{name} down_px": at[:, 1]}
    return _csv(columns)


def followed(clip: Path, bench: Bench, pressure: Path, follow: Tracker) -> Filmed:
    """Experiment in a clip; writes nothing. Raises InputError.

    follow: tracks the markers, see `Tracker`; not used if the clip is a table of pixels.
    """
    if not Path(clip).exists():
        raise InputError(
            "the clip does not exist", str(clip), "give a movie, or the first picture of a sequence"
        )
    recorded = read_pressure(pressure)
    if Path(clip).suffix.lower() in SUFFIXES:
        tracks = read_pixels(clip)
    elif Path(clip).suffix.lower() in PROJECTS:
        raise InputError(
            "the file is not a text table", str(clip), "export the tracked positions in pixels as CSV"
        )
    else:
        unplaced = {*bench.view.base, *(bench.view.tip or ()), *(bench.view.ruler or ())} - {
            *bench.markers.pixels
        }
        if unplaced:
            raise InputError(
                f"marker {min(unplaced)!r} has no pixel",
                str(clip),
                "give its pixel position in the first frame",
            )
        tracks = follow(Path(clip), bench.markers)
    return filmed(tracks, bench, recorded, str(clip))


def track_into(
    folder: Path, clip: Path, bench: Bench, pressure: Path, follow: Tracker, context: RunContext
) -> None:
    """Put a clip's experiment into a folder of measured data, as a run whose remarks are warnings.

    A clip that cannot be used leaves no folder.
    """
    name = str(bench.experiment.get("name", Path(clip).stem))
    with context.progress.stage("track"):
        found = followed(clip, bench, pressure, follow)
        file = f"{file_stem(name)}.csv"
        # Data that `diagnose` could not read must be found before the folder is there.
        tried(_block(name, file, bench), file, _table(found, bench))
    context.open_folder(folder)
    context.console_summary = console_summary
    table, remarks = write_experiment(found, bench, name, folder)
    remarks = (*found.remarks, *remarks)
    for remark in remarks:
        context.progress.warning(remark.what, remark.where, remark.remedy)
    context.summary |= figures(found, name, table) | {"remarks": [remark.what for remark in remarks]}


def figures(found: Filmed, name: str, table: Path) -> dict[str, Any]:
    """Figures of an experiment from a video, in plain data."""
    m = found.motion
    lost = {n: int(np.isnan(p[:, 0]).sum()) for n, p in zip(m.names, m.places_mm, strict=True)}
    return {
        "experiment": name,
        "file": str(table),
        "frames": len(found.tracks),
        "duration_s": float(found.time_s[-1] - found.time_s[0]),
        "pressure_kPa": [float(found.pressure_kPa.min()), float(found.pressure_kPa.max())],
        "angle_deg": None
        if m.angle_deg is None
        else [float(np.nanmin(m.angle_deg)), float(np.nanmax(m.angle_deg))],
        "mm_per_pixel": m.mm_per_pixel,
        "noise_px": m.noise_px,
        "frames_lost": lost,
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a video's `summary`."""
    low, high = summary["pressure_kPa"]
    lines = [
        f"{summary['experiment']}: {summary['frames']} frames, {summary['duration_s']:.4g} s, "
        f"{low:g} to {high:g} kPa; {summary['mm_per_pixel']:.4g} mm a pixel"
    ]
    if summary["angle_deg"]:
        least, most = summary["angle_deg"]
        lines.append(f"angle: {least:+.2f} to {most:+.2f} deg")
    lost = {name: count for name, count in summary["frames_lost"].items() if count}
    if lost:
        lines.append("lost: " + ", ".join(f"{name} in {count} frames" for name, count in lost.items()))
    return lines
