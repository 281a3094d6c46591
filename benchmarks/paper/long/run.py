"""The paper's table with its long studies: how much of it is the mesh, and what the paper leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError
from mu_addon.files import write_csv
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.cache import Cache
from mu_addon.run.context import RunContext
from mu_addon.run.folder import begin
from mu_addon.run.pool import each
from mu_addon.run.progress import Progress
from mu_addon.toml_writer import toml_text

from ..table.found import Found
from ..table.published import Published
from ..table.report import write_report
from ..table.run import solve, summary, write_tables
from ..table.settings import LAYOUT as TABLE_LAYOUT
from ..table.settings import REPORT, Settings, between
from ..table.values import unit_of_table_column
from . import open_study, scatter
from .open_study import OpenPoint, point
from .open_values import BESIDE, Beside, PointResult, design, kept

Array = np.ndarray[Any, Any]

MESHES, OPEN_TABLE = "meshes.csv", "open.csv"
LAYOUT = attrs.evolve(TABLE_LAYOUT, results=(*TABLE_LAYOUT.results, MESHES, OPEN_TABLE))
# Mesh of the points of the open values.
OPEN_MESH = MeshSettings(refine=0.5)


@attrs.frozen
class LongSettings:
    """What decides a reproduction with its long studies. Raises InputError.

    meshes: random ones a family, points: sets of open values; where 0, the tables that lie here are shown.
    """

    table: Settings = attrs.field(factory=Settings)
    meshes: int = attrs.field(default=12, validator=between(0, 1000))
    points: int = attrs.field(default=0, validator=between(0, 4096))

    @property
    def workers(self) -> int:
        """Processes."""
        return self.table.workers

    def texts(self) -> dict[str, str]:
        """Text of the file of inputs, by name: all that decides the results."""
        long = {"meshes": self.meshes, "points": self.points}
        return {LAYOUT.inputs: toml_text({**self.table.inputs(), "long": long}, LAYOUT.header)}


@attrs.frozen(eq=False)
class LongFound:
    """The table and what the long studies found, in this run or in the tables that lie here: see `origin`."""

    table: Found
    drawn: tuple[scatter.Drawn, ...]
    points: tuple[OpenPoint, ...]
    origin: Mapping[str, str]

    def scatters(self) -> dict[tuple[str, str, float], scatter.Scatter]:
        """What many meshes say, by family, rule and scale."""
        return scatter.scatters(
            self.drawn, {s: self.table.paper.table_column(s) for s in self.table.paper.scales}
        )


def reproduce(settings: LongSettings, folder: Path, context: RunContext) -> LongFound:
    """Make a folder with table, long studies and report; InputError, MeshingError, ConvergenceError."""
    from .report import sections

    progress = context.progress
    begin(context, folder, LAYOUT, settings.texts())
    cache = Cache(folder / "cache")
    table = solve(settings.table, cache, progress)
    paper, unit, samples = table.paper, settings.table.unit, table.samples_kPa
    units = [unit_of_table_column(unit, scale, modulus) for scale, modulus in paper.modulus_kPa.items()]
    drawn, points, origin = shipped(paper)
    if settings.meshes:
        with progress.stage("random meshes"):
            drawn = _draws(units, settings, samples, cache, progress)
        origin["meshes"] = "this run"
    if settings.points:
        with progress.stage("open values"):
            points = _points(unit, paper, settings, samples, cache, progress)
        origin["points"] = "this run"
    found = LongFound(table, tuple(drawn), tuple(points), origin)
    write_tables(table, folder)
    write_long_tables(found, folder)
    context.summary |= summary(table)
    with progress.stage("report", expected_s=10.0):
        write_report(table, folder / REPORT, sections(found))
    return found


def _draws(
    units: Sequence[Unit], settings: LongSettings, samples: Array, cache: Cache, progress: Progress
) -> list[scatter.Drawn]:
    todo = scatter.draws(units, settings.meshes)
    work = partial(scatter.draw, samples_kPa=samples, cache=cache)
    known: dict[int, list[scatter.Drawn]] = {}
    for number, found in each(work, todo, settings.workers):
        known[number] = found
        progress.update(len(known) / len(todo))
    return [drawn for number in sorted(known) for drawn in known[number]]


def _points(
    unit: Unit, paper: Published, settings: LongSettings, samples: Array, cache: Cache, progress: Progress
) -> list[OpenPoint]:
    sets = [Beside("", values) for values in design(settings.points)]
    sets = [*BESIDE, *sets]
    work = partial(_open, unit=unit, cache=cache, moduli=dict(paper.modulus_kPa))
    known: dict[int, PointResult | str] = {}
    for number, found in each(work, sets, settings.workers):
        known[number] = found
        progress.update(len(known) / len(sets))
    own = open_study.values_of(unit)
    points = [point(one.name, {**own, **one.values}, known[i], samples) for i, one in enumerate(sets)]
    solved_ones = [p for p in points if not p.name and not p.failed]
    if len(solved_ones) >= open_study.FEWEST:
        proposed = Beside(open_study.PROPOSED, open_study.proposal(solved_ones, paper))
        points.append(point(proposed.name, proposed.values, work(proposed), samples))
    return points


def _open(one: Beside, unit: Unit, cache: Cache, moduli: Mapping[float, float]) -> PointResult | str:
    return kept(cache, unit, one.values, moduli, OPEN_MESH, one.held_cells)


def shipped(paper: Published) -> tuple[list[scatter.Drawn], list[OpenPoint], dict[str, str]]:
    """The tables of the long studies that lie here, and what their first lines say of them."""
    folder = Path(__file__).parent
    names = [p.name for p in paper.paths]
    try:
        meshes, opened = ((folder / name).read_text(encoding="utf-8") for name in (MESHES, OPEN_TABLE))
    except OSError as error:
        raise InputError(
            f"the tables of the long studies are missing: {error}",
            str(folder),
            "check out the whole repository",
        ) from error
    origin = {"meshes": _first_line(meshes), "points": _first_line(opened)}
    return (
        scatter.from_text(meshes, folder / MESHES),
        open_study.from_text(opened, paper.scales, names, folder / OPEN_TABLE),
        origin,
    )


def _first_line(text: str) -> str:
    lines = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    return " ".join(lines)


def write_long_tables(found: LongFound, folder: Path) -> None:
    """The long studies that this run made, as CSV. Raises OutputError."""
    paper = found.table.paper
    names = [p.name for p in paper.paths]
    if found.origin["meshes"] == "this run":
        write_csv(folder / MESHES, [*scatter.COLUMNS, *names], scatter.to_rows(found.drawn))
    if found.origin["points"] == "this run":
        head = open_study.columns(paper.scales, names)
        write_csv(folder / OPEN_TABLE, head, open_study.to_rows(found.points, paper.scales, names))
