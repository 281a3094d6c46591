"""Measured data from a tracked video: pressure, angle, positions.

Tracks come from Blender's tracker, or from any other as a CSV file of pixels.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..reading import text_in
from ..table_cells.own_tables import own_text
from ..toml_reader import TomlTable, read_toml
from ..toml_writer import toml_text
from .kinds import COMMON, KINDS
from .pose import AT_REST, SAMPLES
from .table import Remark, Remarks, read_table
from .video import Motion, Pair, Tracks, View, motion, resting
from .writing import Entry, csv_text, file_stem

KIND = "unit_pressure"
OF_EXPERIMENT = tuple(k for k in COMMON + KINDS[KIND].may_have_keys if k not in ("kind", "file"))
MARKER_KINDS = ("crosses", "dots")
"""Kinds of markers: `crosses` show their rotation, `dots` do not."""


@attrs.frozen
class MarkerSettings:
    """Settings of the markers for a tracker.

    pixels: position of each by name in the first frame, right and down from the upper left corner; marks:
    one of `MARKER_KINDS`; pattern_px: side of the compared square; search_px: side of the searched square.
    """

    pixels: Mapping[str, tuple[float, float]]
    marks: str = "crosses"
    pattern_px: float = 25.0
    search_px: float = 81.0

    def __attrs_post_init__(self) -> None:
        if self.marks not in MARKER_KINDS:
            what = f"marks = {self.marks!r} is not known"
            raise InputError(what, "marks", f"say {' or '.join(MARKER_KINDS)}")
        if not 5 <= self.pattern_px < self.search_px <= 2000:
            raise InputError(
                f"pattern_px = {self.pattern_px:g} and search_px = {self.search_px:g} do not fit",
                "pattern_px",
                "a pattern of 5 pixels or more, and a larger square to search",
            )


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


@attrs.frozen(eq=False)
class Filmed:
    """An experiment made from a video: rows within the pressure's record, and remarks on it."""

    tracks: Tracks
    time_s: Array
    pressure_kPa: Array
    motion: Motion
    remarks: tuple[Remark, ...]


@attrs.frozen
class _Marker:
    """A table [[marker]]: its name, its pixel in the first frame, y and z in the unit's frame."""

    name: str
    pixel: tuple[float, float] | None = None
    place_mm: tuple[float, float] | None = None


_GIVEN = {
    View: ("places_mm",),
    MarkerSettings: ("pixels",),
    Bench: ("view", "markers", "experiment"),
}
"""Fields that other tables of the file give."""
_KEYS = [f.alias for kind, given in _GIVEN.items() for f in attrs.fields(kind) if f.alias not in given]


def read_bench(path: Path) -> Bench:
    """Read a TOML file that describes a video; raises InputError with line and remedy."""
    table = read_toml(path, "description of the video", "check path and file")
    table.only((*_KEYS, "marker", "experiment"))
    markers: dict[str, _Marker] = {}
    for given in table.tables("marker"):
        one = given.made(_Marker)
        if one.name in markers:
            what = f"two markers are named {one.name!r}"
            raise InputError(what, given.at("name"), "give each [[marker]] a different name")
        markers[one.name] = one
    if not markers:
        raise InputError("no marker is defined", str(path), "define each marker under [[marker]]")
    base = table.take("base", Pair)
    places = [markers[name].place_mm if name in markers else None for name in base]
    for name, place in zip(base, places, strict=True):
        if place is None:
            remedy = "give its y and z in the unit's frame, in mm"
            raise InputError(f"marker {name!r} of the base has no place_mm", table.at("base"), remedy)
    for key in ("ruler_mm", "mm_per_pixel", "fps", "starts_s"):
        table.number(key, default=None)
    view = _part(table, View, base=base, places_mm=tuple(places))
    pixels = {name: one.pixel for name, one in markers.items() if one.pixel is not None}
    own = table.inner("experiment").only(OF_EXPERIMENT).values
    return _part(table, Bench, view=view, markers=_part(table, MarkerSettings, pixels=pixels), experiment=own)


def _part(table: TomlTable, kind: type[Any], **given: Any) -> Any:
    """An instance of a class, with the keys of the table that are its fields."""
    names = [f.alias for f in attrs.fields(kind) if f.alias not in given]
    values = {key: value for key, value in table.values.items() if key in names}
    return attrs.evolve(table, values=values).made(kind, **given)


def read_pressure(path: Path) -> tuple[Array, Array]:
    """Time in s and pressure in kPa, (k,) each, of a recording or a protocol; raises InputError."""
    text = text_in(path, "pressure", "give a CSV file of time_s,pressure_kPa", read=own_text)
    table = read_table(text, KINDS["pressure_hold"], Path(path))
    return table.columns["time_s"], table.columns["pressure_kPa"]


def filmed(tracks: Tracks, bench: Bench, pressure: tuple[Array, Array], where: str = "") -> Filmed:
    """An experiment from followed markers and the pressure (time in s, kPa) of the same time.

    Frames outside the pressure's record are left out. Raises InputError for a clip without a clock or outside
    the record's time, and a view that does not fit.
    """
    remarks = Remarks(tracks.remarks)
    fps = bench.fps if bench.fps is not None else tracks.fps
    wrong = not (math.isfinite(fps) and fps > 0)
    if wrong and (bench.fps is not None or tracks.time_s is None):
        raise InputError("the clip has no frame rate", where, "give fps, or a column time_s")
    if tracks.time_s is not None:
        time = bench.starts_s + tracks.time_s
        if bench.fps is not None:
            remarks.add(
                f"the markers' own time_s is used; fps = {bench.fps:g} is not used",
                where,
                "leave fps out, or remove the column time_s where it is wrong",
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
        remarks.add(
            f"{(~inside).sum()} of {len(inside)} frames are outside the pressure record and were left out",
            where,
            "start the pressure record before the clip and end it after",
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
        remarks.add(
            f"no frame shows the unit at rest; angles are relative to {p[first]:.4g} kPa at "
            f"{time[first]:.4g} s",
            where,
            "begin the clip at zero pressure; `diagnose` fits the zero of the angle in any case",
        )
    found = motion(kept, bench.view, rest, time, where)
    return Filmed(kept, time, p, found, (*remarks, *found.remarks))


def entry_of(found: Filmed, bench: Bench, name: str) -> Entry:
    """The experiment, with its name, as it is put into a folder of measured data."""
    file = f"{file_stem(name)}.csv"
    keys = {"name": name, "kind": KIND, "file": file, "role": "fit"} | dict(bench.experiment) | {"name": name}
    return Entry(name, "[[experiment]]\n" + toml_text(keys), file, _table(found, bench))


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


def pixels_text(found: Filmed, starts_s: float) -> str:
    """Positions in the picture as CSV, a row for each frame with the clip's time, for `read_pixels`."""
    columns: dict[str, Array] = {"time_s": found.time_s - starts_s}
    for name, at in zip(found.tracks.names, found.tracks.pixels, strict=True):
        columns |= {f"{name} right_px": at[:, 0], f"{name} down_px": at[:, 1]}
    return _csv(columns)
