"""Tables of tracked markers: in this program's layout, and as exported by other trackers.

A table has either a column of x and one of y for each marker, or a row for each marker and frame. The
markers are named by the titles (`NAME right_px`, `NAME x`, `NAME.x`), the row above them (DeepLabCut) or a
column.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..measured.table import Remarks
from ..measured.video import Tracks
from ..reading import require_rows, text_in
from ..table_cells.notation import is_like_number
from ..table_cells.own_tables import own_lines, own_rows, own_text
from .columns import column
from .units import unit_of

Line = tuple[int, str]
Cells = tuple[int, list[str]]

SUFFIXES = (".csv", ".tsv", ".txt")
PROJECTS = (".h5", ".hdf5", ".slp", ".xml", ".trk", ".kva", ".xlsx")
"""Files of trackers that are not text tables."""
SURE = 0.6
"""Likelihood below which DeepLabCut itself takes a marker as lost."""
_MOST_PLACES = 20_000_000
# Rows in which the heading is searched, and rows of titles and units below it.
_ABOVE, _BELOW = 6, 4
_OWN = {"right": 0, "down": 1}
_OWN_TITLE = re.compile(r"(?P<name>.+) (?P<axis>right|down)_px")
_TITLE = re.compile(
    r"(?:(?P<name>.+?)[\s_.:/-]+)?(?P<axis>[xyz])(?:[\s_]*(?:[(\[](?P<unit>[^)\]]*)[)\]]|(?P<plain>px|pixels?|mm)))?",
    re.IGNORECASE,
)
_NO_NAMES = ("position", "pos", "center", "centroid", "coord", "image")
_PIXELS = ("", "px", "pixel", "pixels")
_IDS = (
    "track id", "particle", "track", "track n°", "trajectory", "marker", "bodypart", "name", "label",
    "object", "id", "tid", "marker id",
)  # fmt: skip
_FRAMES = ("frame", "frame idx", "frame id", "frame number", "frame nr", "frames", "slice", "slice n°")
NO_MARKERS = "the file contains no tracked markers"
# What Kinovea's text of paths begins with.
_KINOVEA = "#Kinovea Trajectory"
_MOMENT = re.compile(r"(?:(\d+):(\d\d):)?(\d+(?:\.\d+)?)(?::(\d\d))?")
_LAYOUTS = (
    "name the columns `NAME right_px` and `NAME down_px`, a row a frame; or export, in pixels, NAME x and "
    "NAME y for each marker, frame, id, x and y in each row, or DeepLabCut's CSV"
)
_PLANE = (
    "write the two axes of the bending plane of each marker as `NAME right_px` (y) and `NAME down_px` (-z), "
    "in mm, with mm_per_pixel = 1 in the description"
)
# The markers of a picture extend over more pixels than this; in m they do not.
_LEAST_PX = 1.0


@attrs.frozen
class _Layout:
    """Position of everything in a table.

    heading: row of the titles; markers: columns of x and y by name, "" if the rows have names; depth: columns
    of z; likelihood: its column by name; own: True for this program's layout.
    """

    heading: int
    markers: Mapping[str, tuple[int, int]]
    depth: Sequence[int]
    likelihood: Mapping[str, int]
    titles: Sequence[str]
    frame: int | None
    id: int | None
    own: bool


def read_pixels(path: Path) -> Tracks:
    """Markers in a table of pixels; raises InputError with line and remedy.

    This program's layout has `NAME right_px` and `NAME down_px`, one row a frame, empty if a marker was lost;
    time_s, if present, is the time of each. Tables of other trackers need x to the right and y downward.
    """
    if path.suffix.lower() in PROJECTS:
        remedy = "export the tracked positions in pixels as CSV"
        raise InputError("the file is not a text table", str(path), remedy)
    text = text_in(path, "tracked markers", "check path and file", read=own_text)
    try:
        lines = _lines_of_kinovea(text, str(path)) if text.startswith(_KINOVEA) else own_lines(text)
        require_rows(len(lines) - 1, str(path))
        layout = _layout(lines, str(path))
        heading, *body = own_rows(lines[layout.heading :])
    except csv.Error as error:
        raise InputError(f"not CSV: {error}", str(path), "separate the columns by commas") from error
    units, body = _below(layout, body)
    layout = _in_pixels(layout, units, f"{path}, line {heading[0]}")
    if len(body) < 2:
        raise InputError(NO_MARKERS, str(path), _LAYOUTS)
    table = _Table(layout, units, body, str(path))
    return table.of_rows() if layout.id is not None else table.of_columns()


def _lines_of_kinovea(text: str, where: str) -> list[Line]:
    """Lines of a table with a row a moment, of Kinovea's text with lines `T X Y` below each other's paths."""
    paths: dict[str, dict[float, str]] = {}
    begun: dict[float, int] = {}
    name, apart = "", True
    for number, line in enumerate(text.split("\n"), 1):
        words = line.replace(",", ".").split()
        if line.startswith("#") or not words:
            name, apart = line.strip("# \t") if words else name, True
            continue
        moment = _MOMENT.fullmatch(words[0])
        if moment is None or len(words) != 3 or not all(map(is_like_number, words[1:])):
            raise InputError(
                "the line is not `T X Y`", f"{where}, line {number}", "export each path on its own"
            )
        if apart and (name in paths or name in ("", "T X Y")):
            name = f"path {len(paths) + 1}"
        apart = False
        # A clock is h:mm:ss:hh, with hundredths of a second.
        hours, minutes, seconds, hundredths = (float(part or 0) for part in moment.groups())
        time = 3600.0 * hours + 60.0 * minutes + seconds + 0.01 * hundredths
        paths.setdefault(name, {})[time] = ",".join(words[1:])
        begun.setdefault(time, number)
    times = sorted(begun)
    whole = ":" not in text and all(time == int(time) for time in times)
    title = "Time (s)" if not whole else "Time (ms)" if np.diff(times[:2]).min(initial=2) > 1 else "Frame"
    lines = [(1, ",".join([title, *(f"{name} X,{name} Y" for name in paths)]).replace('"', ""))]
    for time in times:
        cells = (places.get(time, ",") for places in paths.values())
        lines.append((begun[time], ",".join([f"{time:.10g}", *cells])))
    return lines


def _layout(lines: Sequence[Line], where: str) -> _Layout:
    """Layout of a table by the first row that names positions."""
    above: list[list[str]] = []
    for n, line in enumerate(lines[:_ABOVE]):
        titles = own_rows([line])[0][1]
        found = _markers(titles, above)
        if found:
            own = any(_OWN_TITLE.fullmatch(title) for title in titles)
            markers, likelihood = _paired(found, titles, f"{where}, line {line[0]}")
            plain = [re.sub(r"[\s_.]+", " ", title).strip().casefold() for title in titles]
            places = {title: k for k, title in reversed(list(enumerate(plain)))}
            frame = next((places[name] for name in _FRAMES if name in places), None)
            if plain[0] == "coords":
                frame = 0
            id_ = next((places[name] for name in _IDS if name in places), None)
            depth = [k for _, axis, k in found if axis == 2]
            return _Layout(n, markers, depth, likelihood, titles, frame, id_ if "" in markers else None, own)
        above.append(titles)
    raise InputError(NO_MARKERS, where, _LAYOUTS)


def _markers(titles: Sequence[str], above: Sequence[Sequence[str]]) -> list[tuple[str, int, int]]:
    """Name, axis (0, 1 or 2) and column of each position that these titles name."""
    found = []
    for k, title in enumerate(titles):
        if match := _OWN_TITLE.fullmatch(title):
            found.append((match["name"], _OWN[match["axis"]], k))
        elif match := _TITLE.fullmatch(title):
            name = match["name"] or ""
            name = "" if name.casefold() in _NO_NAMES else name
            found.append((name, "xyz".index(match["axis"].casefold()), k))
    if len({axis for _, axis, _ in found} - {2}) < 2 and not any(_OWN_TITLE.fullmatch(t) for t in titles):
        return []
    if above and not any(name for name, _, _ in found):
        # DeepLabCut names individuals, too, where there are several.
        kinds = [row[0].casefold() if row else "" for row in above]
        rows = [above[k] for k, kind in enumerate(kinds) if kind in ("individuals", "bodyparts")]
        rows = rows or ([above[-1]] if len(found) > 2 else [])
        found = [(" ".join(_above(row, k) for row in rows).strip(), axis, k) for _, axis, k in found]
    return found


def _above(row: Sequence[str], k: int) -> str:
    """Name in a row above column k, or to the left if that cell is empty."""
    return next((row[n] for n in range(min(k, len(row) - 1), 0, -1) if row[n]), "")


def _paired(
    found: Sequence[tuple[str, int, int]], titles: Sequence[str], where: str
) -> tuple[dict[str, tuple[int, int]], dict[str, int]]:
    """Columns of x and y by name, and of the likelihood; raises InputError for one without the other."""
    columns: dict[str, dict[int, int]] = {}
    spatial = any(axis == 2 for _, axis, _ in found)
    for name, axis, k in found:
        if axis == 2:
            continue
        if axis in columns.setdefault(name, {}):
            if spatial:
                raise InputError("the table has three axes, with several columns for one", where, _PLANE)
            raise InputError(
                f"two columns hold the {'xy'[axis]} of {name or 'a marker without a name'}",
                where,
                "give each marker a different name, in the titles or the row above",
            )
        columns[name][axis] = k
    for name, axes in columns.items():
        for axis in {0, 1} - axes.keys():
            one = titles[next(iter(axes.values()))]
            lacking = (
                f"{name} {'right' if axis == 0 else 'down'}_px" if "_px" in one else f"{name} {'xy'[axis]}"
            )
            raise InputError(f"column {lacking!r} is missing", where, _LAYOUTS)
    after = {name: axes[1] + 1 for name, axes in columns.items()}
    likelihood = {
        name: k
        for name, k in after.items()
        if k < len(titles) and titles[k].casefold().endswith("likelihood")
    }
    return {name: (axes[0], axes[1]) for name, axes in columns.items()}, likelihood


def _below(layout: _Layout, body: Sequence[Cells]) -> tuple[list[str], list[Cells]]:
    """Units in the rows of words below the heading, and the rows of positions."""
    units = [""] * len(layout.titles)
    places = [k for pair in layout.markers.values() for k in pair]
    count = 0
    while not layout.own and count < min(_BELOW, len(body)):
        cells = body[count][1]
        words = [cells[k] for k in places if k < len(cells) and cells[k]]
        if not words or any(map(is_like_number, words)) or any(w.casefold() == "nan" for w in words):
            break
        for k, cell in enumerate(cells[: len(units)]):
            bare = cell.strip("()[] ")
            known = bare.casefold() in (*_PIXELS, "frame", "frames") or unit_of(bare)
            units[k] = bare if bare and known else units[k]
        count += 1
    return units, list(body[count:])


def _in_pixels(layout: _Layout, units: Sequence[str], where: str) -> _Layout:
    """The layout less columns of other units, such as speeds; raises InputError where none are left."""
    kept, other = {}, ""
    for name, pair in layout.markers.items():
        found = [_unit(layout.titles[k], units[k]) for k in pair]
        if all(unit.casefold() in _PIXELS for unit in found):
            kept[name] = pair
        else:
            other = other or f"column {layout.titles[pair[0]]!r} is in {found[0]}, not in pixels"
    if not kept:
        raise InputError(other, where, f"export the positions in pixels, or {_PLANE}")
    return attrs.evolve(layout, markers=kept)


def _unit(title: str, unit: str) -> str:
    """Unit of a position by the row of units, or by its title."""
    match = _TITLE.fullmatch(title)
    return unit or ((match["unit"] or match["plain"] or "") if match else "")


class _Table:
    """Rows of a table, by their layout."""

    def __init__(self, layout: _Layout, units: Sequence[str], body: Sequence[Cells], where: str) -> None:
        self.layout, self.body, self.where = layout, body, where
        self.remarks = Remarks()
        self.time, self.per_s = self._time(units)

    def of_columns(self) -> Tracks:
        """Tracks of a table with columns for each marker."""
        layout = self.layout
        names = tuple(layout.markers)
        if names == ("",):
            raise InputError("the only marker of the file has no name", self.where, _LAYOUTS)
        pixels = np.stack([self._places(name) for name in names])
        if layout.frame is None or self.time is not None:
            return self._tracks(names, pixels, self._times())
        frames = self._frames()
        later = np.flatnonzero(np.diff(frames) <= 0)
        if len(later):
            raise self._wrong(
                int(later[0]) + 1,
                "its frame number does not increase",
                "export one row a frame, sorted: one animal or track",
            )
        place = self._place_of(frames, len(names))
        filled = np.full((len(names), int(place[-1]) + 1, 2), np.nan)
        filled[:, place] = pixels
        return self._tracks(names, filled, None)

    def of_rows(self) -> Tracks:
        """Tracks of a table with a row for each marker and frame."""
        layout = self.layout
        assert layout.id is not None
        if layout.frame is None and self.time is None:
            raise InputError("the table has no column of frames", self.where, _LAYOUTS)
        places = self._places("")
        when = self._frames() if layout.frame is not None else self._numbers(self.time or 0)
        names = [_name(self._cell(cells, layout.id)) for _, cells in self.body]
        kept = np.array([bool(name) for name in names])
        if not kept.all():
            self.remarks.add(
                f"{(~kept).sum()} rows without {layout.titles[layout.id]} were left out",
                self.where,
                "assign them to a track",
            )
        ids = {name: m for m, name in enumerate(dict.fromkeys(name for name in names if name))}
        if not ids:
            raise InputError("no row names its marker", self.where, _LAYOUTS)
        times = None
        if self.time is not None:
            moments, place = np.unique(when, return_inverse=True)
            first = np.array([int(np.argmax(when == moment)) for moment in moments])
            times = self._numbers(self.time)[first] * self.per_s
            self._require_later(times, first)
        else:
            place = self._place_of(when, len(ids))
        self._require_few(len(ids), int(place.max()) + 1)
        pixels = np.full((len(ids), int(place.max()) + 1, 2), np.nan)
        seen: set[tuple[int, int]] = set()
        for i in np.flatnonzero(kept):
            at = (ids[names[i]], int(place[i]))
            if at in seen:
                raise self._wrong(
                    int(i), f"marker {names[i]} has two rows for one frame", "keep the row that is right"
                )
            seen.add(at)
            pixels[at] = places[i]
        return self._tracks(tuple(ids), pixels, times)

    def _tracks(self, names: tuple[str, ...], pixels: Array, time_s: Array | None) -> Tracks:
        if not self.layout.own:
            self._require_plane()
            seen = pixels[np.isfinite(pixels).all(axis=2)]
            extent = np.ptp(seen, axis=0).max() if len(seen) else np.inf
            if extent < _LEAST_PX:
                raise InputError(
                    f"the positions of all markers lie within {extent:.3g}: they are not in pixels",
                    self.where,
                    f"export pixels, or {_PLANE}",
                )
            if np.nanmin(pixels, initial=0.0) < -1.0:
                raise InputError(
                    "positions are negative: its coordinates are not those of the picture",
                    self.where,
                    "export pixels from the upper left corner, x to the right and y downward",
                )
            self.remarks.add(
                "x is taken as pixels to the right and y as pixels downward from the upper left corner",
                self.where,
                "if y grows upward, export it inverted, or the angle has the wrong sign",
            )
        return Tracks(names, pixels, time_s=time_s, remarks=tuple(self.remarks))

    def _require_plane(self) -> None:
        """Raise InputError for markers that move along a third axis; a tracker of pictures writes 0."""
        for k in self.layout.depth:
            depth = self._numbers(k)
            if len(np.unique(depth[np.isfinite(depth)])) > 1:
                raise InputError(
                    f"column {self.layout.titles[k]!r} varies: the table has three axes, as motion capture",
                    self.where,
                    _PLANE,
                )

    def _time(self, units: Sequence[str]) -> tuple[int | None, float]:
        """Column of the time, and seconds of its unit; None without one."""
        for k, title in enumerate(self.layout.titles):
            known = column("time" if title.casefold() == "position_t" else title, units[k])
            frames = units[k].casefold().startswith("frame")
            if known.quantity != "time" or frames or k in (self.layout.frame, self.layout.id):
                continue
            if known.factor is None:
                self.remarks.add(
                    f"column {title!r} has no unit and is taken as seconds",
                    self.where,
                    "write the unit into its title, as in time_s or time_ms",
                )
            return k, known.factor or 1.0
        return None, 1.0

    def _times(self) -> Array | None:
        if self.time is None:
            return None
        times = self._numbers(self.time) * self.per_s
        self._require_later(times, np.arange(len(times)))
        return times

    def _require_later(self, times: Array, rows: Array) -> None:
        wrong = np.flatnonzero(~np.isfinite(times) | np.concatenate([[False], ~(np.diff(times) > 0)]))
        if len(wrong):
            assert self.time is not None
            raise self._wrong(
                int(rows[wrong[0]]),
                f"{self.layout.titles[self.time]} is missing, or does not increase",
                "correct it, or leave the column out and give fps",
            )

    def _places(self, name: str) -> Array:
        """Positions (n, 2) of a marker, nan where the tracker lost it."""
        x, y = self.layout.markers[name]
        found = np.stack([self._numbers(x), self._numbers(y)], axis=1)
        if name in self.layout.likelihood:
            lost = self._numbers(self.layout.likelihood[name]) < SURE
            if lost.any():
                self.remarks.add(
                    f"{lost.sum()} positions of {name} with a likelihood below {SURE:g} count as lost",
                    self.where,
                    "correct them in the tracker, or train it further",
                )
                found[lost] = np.nan
        return found

    def _frames(self) -> Array:
        assert self.layout.frame is not None
        frames = self._numbers(self.layout.frame)
        wrong = np.flatnonzero(~np.isfinite(frames) | (frames != np.round(frames)))
        if len(wrong):
            raise self._wrong(int(wrong[0]), "its frame is not a whole number", "correct that row")
        return frames

    def _place_of(self, frames: Array, markers: int) -> Array:
        """Position of each frame counted from the first one."""
        first = int(frames.min())
        if first not in (0, 1):
            self.remarks.add(
                f"the table begins at frame {first}; starts_s is the pressure's clock at that frame",
                self.where,
                "give starts_s of that frame",
            )
        self._require_few(markers, int(frames.max()) - first + 1)
        return np.asarray(frames - first, int)

    def _require_few(self, markers: int, frames: int) -> None:
        require_rows(frames, self.where)
        if markers * frames > _MOST_PLACES:
            raise InputError(
                f"the table holds {markers} markers in {frames} frames",
                self.where,
                "export only the markers of base, tip and ruler",
            )

    def _numbers(self, k: int) -> Array:
        """Numbers of a column, nan where a cell is empty."""
        found = np.empty(len(self.body))
        for i, (_, cells) in enumerate(self.body):
            try:
                found[i] = float(cells[k] or "nan")
            except (ValueError, IndexError) as error:
                raise self._wrong(
                    i, "a row holds something that is not a number", "correct that row"
                ) from error
        return np.where(np.isfinite(found), found, np.nan)

    def _cell(self, cells: Sequence[str], k: int) -> str:
        return cells[k] if k < len(cells) else ""

    def _wrong(self, i: int, what: str, remedy: str) -> InputError:
        return InputError(what, f"{self.where}, row {self.body[i][0]}", remedy)


def _name(cell: str) -> str:
    """Name of a marker in a row; whole numbers as such, "" for none."""
    if cell.casefold() in ("", "none", "nan"):
        return ""
    if is_like_number(cell):
        try:
            return str(int(float(cell))) if float(cell) == int(float(cell)) else cell
        except (ValueError, OverflowError):
            return cell
    return cell
