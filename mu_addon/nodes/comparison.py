"""Differences between units, studies, grasps or diagnoses: a table, and charts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.parameters import stated
from ..design.settings import USUAL_RESIN
from ..errors import InputError
from ..graph.evaluation import Finished
from ..materials.library import load_material
from ..reading import is_number
from ..report.html_parts import number
from ..report.plots import BY_LENGTH, BY_START, QUIET, canvas
from ..run.parts import Beside, Chart, Part, Table, Warn, csv, echo
from ..run.study import Study, section
from ..run.summary import SUMMARY, read_summary
from ..studies.parameter_study.results import angles_of, figures
from ..studies.starting import kind_of
from ..studies.unit_ranking import UnitStudy
from .parts import Design

Row = dict[str, Any]
MOST = 30
"""Characters of a value in the terminal; compare.csv has it whole."""


@attrs.frozen(eq=False)
class Comparison:
    """Named things side by side; the others are compared with the first.

    inputs, results: rows by name of a quantity, a value for each; angles: (pressure in kPa, angle in deg) of
    each study, ascending; unfinished: names of runs that are not complete, with their status.
    """

    names: tuple[str, ...]
    inputs: Mapping[str, tuple[Any, ...]]
    results: Mapping[str, tuple[Any, ...]]
    angles: tuple[tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]], ...] = ()
    unfinished: tuple[tuple[str, str], ...] = ()

    def remark(self) -> str:
        """Number of studies, and their largest angles minus the first's, as text."""
        angles = self.results.get("angle_highest_deg", ())
        more = [
            f"{difference(angles[0], a):+.1f}" for a in angles[1:] if is_number(a) and is_number(angles[0])
        ]
        return f"{len(self.names)} side by side" + (f", {', '.join(more)} deg" if more else "")

    def rows(self) -> list[tuple[str, tuple[Any, ...]]]:
        """Inputs that are not all equal, then all results."""
        differing = [(k, v) for k, v in self.inputs.items() if any(x != v[0] for x in v)]
        return [*differing, *self.results.items()]

    def titles(self, minus: str) -> list[str]:
        """Titles of the columns of values, then of differences."""
        return [*self.names, *(f"{name} {minus} {self.names[0]}" for name in self.names[1:])]

    def parts(self, file: str) -> Iterator[Any]:
        """The table, a quantity a row, values, then differences to the first, as a CSV file too; charts."""
        rows = [[name, *v, *(difference(v[0], other) for other in v[1:])] for name, v in self.rows()]
        yield csv(file, ["quantity", *self.titles("-")], rows)
        if self.angles and all(len(pressure) for pressure, _ in self.angles):
            (pressure, angle), values = self.angles[0], [a for _, a in self.angles]
            apart = [a - np.interp(p, pressure, angle) for p, a in self.angles]
            yield Beside(
                [
                    Chart(
                        lambda: _lines(self, values, "bending angle [deg]"),
                        "Bending angle against pressure.",
                        "Angle against pressure.",
                    ),
                    Chart(
                        lambda: _lines(self, apart, "difference [deg]"),
                        f"Angle minus that of {self.names[0]}.",
                        f"Difference of each angle to that of {self.names[0]}.",
                    ),
                ],
                across=3,
            )
        head = ["quantity", *Table.numbers(*self.titles("−"))]
        yield Table("Inputs that differ, and all results.", head, rows)


@attrs.frozen(kw_only=True, eq=False)
class Compared(Study):
    """Runs side by side, as `compare` shows them."""

    name = "compare"
    # It has no file of inputs, and nothing to resume.
    joins = True
    files = {"compare.csv": "inputs that differ and all results, with differences to the first run's"}

    found: Comparison

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the number of runs, and how their largest angles differ."""
        return f"Comparison of {', '.join(self.found.names)}", self.found.remark()

    @section("compare", "Side by side")
    def table(self) -> Iterator[Part]:
        """The comparison, with a line of the terminal for each quantity."""
        for name, status in self.found.unfinished:
            yield Warn(f"the run {name} is {status}: its results are those so far", name)
        *_, listed = parts = [*self.found.parts("compare.csv")]
        yield from parts
        cells = [[name, *(number(v)[:MOST] for v in values)] for name, *values in listed.rows]
        lines = [["", *self.found.titles("-")], *cells]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        for first, *rest in lines:
            columns = (cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))
            yield from echo("  ".join([first.ljust(widths[0]), *columns]))


def compare(items: Sequence[tuple[str, Any]]) -> Comparison:
    """The comparison of named designs, studies or runs; InputError for one alone, or of two kinds."""
    if len(items) < 2:
        raise InputError("only one is given", "items", "give two or more")
    kinds = {_kind(value) for _, value in items}
    if len(kinds) > 1:
        raise InputError(
            f"{' and '.join(sorted(kinds))} have no figures in common", "items", "compare things of one kind"
        )
    names = tuple(name for name, _ in items)
    values = [value for _, value in items]
    inputs = [_inputs(value) for value in values]
    results = [_results(value) for value in values]
    angles = tuple(_angles(value.summary) for value in values) if kinds == {"study"} else ()
    return Comparison(names, _side_by_side(inputs), _side_by_side(results), angles)


def of_runs(folders: Sequence[Path]) -> Comparison:
    """The comparison of runs in folders, named by these; InputError where one has no results."""
    last = [folder.resolve().name for folder in folders]
    names = last if len(set(last)) == len(last) else [str(folder) for folder in folders]
    items: list[tuple[str, Any]] = []
    for name, folder in zip(names, folders, strict=True):
        kind, summary = kind_of(folder), read_summary(folder / SUMMARY)
        if not summary:
            raise InputError("that run has no results", str(folder), f"start it: resume {folder}")
        study = kind.read(folder) if issubclass(kind, UnitStudy) else None
        items.append((name, Finished(folder, summary, study)))
    statuses = [(name, str(value.summary.get("status"))) for name, value in items]
    return attrs.evolve(compare(items), unfinished=tuple(s for s in statuses if s[1] != "complete"))


def _kind(value: Any) -> str:
    if isinstance(value, Design):
        return "unit"
    return "study" if isinstance(value.study, UnitStudy) else kind_of(value.folder).name


def _inputs(value: Any) -> Row:
    """Inputs of a thing, by name."""
    design = value.study if isinstance(value, Finished) else value
    if not isinstance(design, UnitStudy | Design):
        return {}
    found: Row = {"scale": design.unit.scale, "path": design.path}
    found |= {f"{section}.{d.name}": v for section, d, v in stated(design.unit)}
    if isinstance(design, UnitStudy):
        pressures = ", ".join(f"{p:g}" for p in design.samples.distinct_kPa)
        found |= {"times": design.times, "pressures_kPa": pressures, "self_contact": design.self_contact}
        found |= {"duration_s": float(design.samples.time_s[-1]), "self_friction": design.self_friction}
        found |= {f"mesh.{key}": v for key, v in attrs.asdict(design.mesh).items()}
        found |= {"effects": "; ".join(design.effects.words())}
    return found


def _results(value: Any) -> Row:
    if isinstance(value, Design):
        d = value.unit.dimensions
        low, high = d.bounds[0], d.bounds[1]
        return {
            "wall_mm": d.wall,
            "height_mm": d.height,
            "width_x_mm": low[1] - low[0],
            "width_y_mm": high[1] - high[0],
        }
    if isinstance(value.study, UnitStudy):
        return figures(value.summary, load_material(USUAL_RESIN).density_g_per_ml)
    return _flat(value.summary)


# Of a run's summary what is no result.
_NO_RESULT = (
    "status",
    "versions",
    "seconds",
    "experiments",
    "noise",
    "remarks",
    "size_mm",
    "gates",
    "next",
    "options",
)


def _flat(summary: Mapping[str, Any], before: str = "") -> Row:
    """Numbers and texts of a summary, names joined by dots."""
    found: Row = {}
    for key, value in summary.items():
        if not before and key in _NO_RESULT:
            continue
        name = f"{before}{key}"
        if isinstance(value, Mapping):
            found |= _flat(value, f"{name}.")
        elif isinstance(value, bool | int | float | str):
            found[name] = value
    return found


def _side_by_side(rows: Sequence[Row]) -> dict[str, tuple[Any, ...]]:
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: tuple(row.get(name, "") for row in rows) for name in names}


def _angles(summary: Mapping[str, Any]) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    found = angles_of(summary)
    return np.array([*found]), np.array([*found.values()])


def difference(first: Any, value: Any) -> Any:
    """Difference of a value from the first, "" if they are not numbers."""
    if is_number(first) and is_number(value):
        return value - first
    return ""


def _lines(found: Comparison, values: Sequence[np.ndarray[Any, Any]], words: str) -> str:
    with canvas(4.0, 2.8) as (drawn, svg):
        axes = drawn.add_axes((0.15, 0.17, 0.81, 0.78))
        axes.axhline(0, color=QUIET, linewidth=0.8)
        for i, (name, (pressure, _), value) in enumerate(zip(found.names, found.angles, values, strict=True)):
            color, style = BY_LENGTH[i % len(BY_LENGTH)], BY_START[i // len(BY_LENGTH) % len(BY_START)]
            axes.plot(pressure, value, color=color, linestyle=style, marker="o", markersize=3, label=name)
        axes.legend(frameon=False, fontsize=8)
        axes.set(xlabel="pressure [kPa]", ylabel=words)
    return svg()
