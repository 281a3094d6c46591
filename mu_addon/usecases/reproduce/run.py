"""The paper's table, done again: three units, their meshes' share in it, and what the paper leaves open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.assets import asset_root
from ...design.parameters import Unit
from ...errors import InputError
from ...files import write_csv
from ...meshing.settings import MeshSettings
from ...placement.inclusion import RULES
from ...run.cache import Cache
from ...run.context import RunContext
from ...run.pool import each
from ...run.progress import Progress
from ...run.usecase import UseCase
from ...run.versions import package_versions
from ..simulate_and_place.job import grasp
from . import gripper, open_study, scatter
from .columns import BENDING_KPA, Solved, TableColumn, solved, tasks
from .found import Found, OtherColumn
from .open_study import OpenPoint, point
from .open_values import BESIDE, RULE, Beside, PointResult, column_unit, design, kept
from .published import Published, name_of, published
from .report import write_report
from .settings import (
    AGREEMENT,
    BENDING,
    FOLDER,
    LAYOUT,
    MESHES,
    OPEN_TABLE,
    REPORT,
    STATEMENTS,
    TABLE,
    Settings,
    read_settings,
)

Array = np.ndarray[Any, Any]

# Samples of the grasp protocol, as in `place`.
TIMES = 13
# Mesh of the points of the open values.
OPEN_MESH = MeshSettings(refine=0.5)


def reproduce(settings: Settings, folder: Path, context: RunContext) -> Found:
    """Make the paper's table again, with figures. Raises InputError, MeshingError and ConvergenceError."""
    progress = context.progress
    paper, unit = published(), settings.unit
    _, samples = grasp().sample(TIMES)
    units = [column_unit(unit, scale, modulus) for scale, modulus in paper.modulus_kPa.items()]
    cache = Cache(folder / "cache")
    with progress.stage("columns"):
        columns = _columns(units, settings, samples, cache, progress)
    others: dict[str, OtherColumn] = {}
    if settings.gripper:
        with progress.stage("gripper"):
            others = _gripper(settings, paper, cache, progress)
    drawn, points, origin = shipped(paper)
    if settings.meshes:
        with progress.stage("random meshes"):
            drawn = _draws(units, settings, samples, cache, progress)
        origin["meshes"] = "this run"
    if settings.points:
        with progress.stage("open values"):
            points = _points(unit, paper, settings, samples, cache, progress)
        origin["points"] = "this run"
    found = Found(settings, paper, columns, others, tuple(drawn), tuple(points), samples, origin)
    write_tables(found, folder)
    context.summary |= summary(found)
    context.report = lambda _: write_report(found, folder / REPORT, progress)
    return found


def _columns(
    units: Sequence[Unit], settings: Settings, samples: Array, cache: Cache, progress: Progress
) -> tuple[TableColumn, ...]:
    todo = tasks(units, settings.mesh, samples, settings.held_cells)
    known: dict[int, Solved] = {}
    for number, one in each(partial(solved, cache=cache), todo, settings.workers):
        known[number] = one
        progress.update(len(known) / len(todo))
    return tuple(
        TableColumn(name_of(unit.scale), unit.scale, known[2 * i], known[2 * i + 1])
        for i, unit in enumerate(units)
    )


def _gripper(
    settings: Settings, paper: Published, cache: Cache, progress: Progress
) -> dict[str, OtherColumn]:
    refine = min(settings.mesh.refine, gripper.REFINE)
    todo = gripper.tasks(settings.values, [p.name for p in paper.paths], refine)
    known: dict[int, Array | str] = {}
    for number, J_hat in each(partial(gripper.solved, cache=cache), todo, settings.workers):
        known[number] = J_hat
        progress.update(len(known) / len(todo))
    found: dict[str, OtherColumn] = {}
    for number, task in enumerate(todo):
        column = found.setdefault(task.name, OtherColumn({}))
        J_hat = known[number]
        if isinstance(J_hat, str):
            found[task.name] = attrs.evolve(column, remark=f"{task.rule}: {J_hat}")
        else:
            found[task.name] = attrs.evolve(column, J_hat={**column.J_hat, task.rule: J_hat})
    return found


def _draws(
    units: Sequence[Unit], settings: Settings, samples: Array, cache: Cache, progress: Progress
) -> list[scatter.Drawn]:
    todo = scatter.draws(units, settings.meshes)
    work = partial(scatter.draw, samples_kPa=samples, cache=cache)
    known: dict[int, list[scatter.Drawn]] = {}
    for number, found in each(work, todo, settings.workers):
        known[number] = found
        progress.update(len(known) / len(todo))
    return [drawn for number in sorted(known) for drawn in known[number]]


def _points(
    unit: Unit, paper: Published, settings: Settings, samples: Array, cache: Cache, progress: Progress
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
    """The tables of the long studies that come with the package, and what their first lines say of them."""
    folder = asset_root() / FOLDER
    names = [p.name for p in paper.paths]
    try:
        meshes, opened = ((folder / name).read_text(encoding="utf-8") for name in (MESHES, OPEN_TABLE))
    except OSError as error:
        raise InputError(
            f"the tables of the long studies are missing: {error}", str(folder), "install the whole extension"
        ) from error
    origin = {"meshes": _first_words(meshes), "points": _first_words(opened)}
    return (
        scatter.from_text(meshes, folder / MESHES),
        open_study.from_text(opened, paper.scales, names, folder / OPEN_TABLE),
        origin,
    )


def _first_words(text: str) -> str:
    lines = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    return " ".join(lines)


def write_tables(found: Found, folder: Path) -> None:
    """Every table as CSV. Raises OutputError."""
    paper = found.paper
    rows = []
    for rule in RULES:
        spread = found.uncertainty_mm(rule)
        for name, J in found.table(rule).items():
            ours, theirs = (np.argsort(np.argsort(v)) + 1 for v in (J, paper.like(name)))
            for i, path in enumerate(paper.paths):
                figures = (
                    f"{J[i]:.6g}",
                    f"{paper.like(name)[i]:.3f}",
                    ours[i],
                    theirs[i],
                    f"{spread[name]:.3g}" if np.isfinite(spread[name]) else "",
                )
                rows.append((name, rule, path.name, path.start, path.length, *figures))
    head = ["column", "rule", "path", "start", "length", "J_hat_mm", "paper_J_hat_mm", "rank", "paper_rank"]
    write_csv(folder / TABLE, [*head, "mesh_uncertainty_mm"], rows)
    write_csv(
        folder / AGREEMENT,
        ["column", "rule", "spearman", "magnitude", "chosen", "paper_chosen", "tied_with_chosen"],
        [
            (name, rule, f"{a.spearman:.4f}", f"{a.magnitude:.4g}", a.chosen, a.theirs, " ".join(a.tied))
            for rule in RULES
            for name, a in found.agreements(rule).items()
        ],
    )
    write_csv(
        folder / STATEMENTS,
        ["rule", "statement", "verdict", "numbers"],
        [
            (rule, s.text, s.verdict, s.numbers.replace(",", ";"))
            for rule in RULES
            for s in found.statements(rule)
        ],
    )
    write_csv(
        folder / BENDING,
        ["column", "pressure_kPa", "angle_deg", "coarser_mesh_angle_deg"],
        [
            (c.name, f"{p:g}", f"{a:.6g}", f"{b:.6g}")
            for c in found.columns
            for p, a, b in zip(BENDING_KPA, c.fine.angle_deg, c.coarse.angle_deg, strict=True)
        ],
    )
    names = [p.name for p in paper.paths]
    if found.origin["meshes"] == "this run":
        write_csv(folder / MESHES, [*scatter.COLUMNS, *names], scatter.to_rows(found.drawn))
    if found.origin["points"] == "this run":
        head = open_study.columns(paper.scales, names)
        write_csv(folder / OPEN_TABLE, head, open_study.to_rows(found.points, paper.scales, names))


def summary(found: Found) -> dict[str, Any]:
    """Figures of a reproduction for summary.json."""
    per_rule = {}
    for rule in RULES:
        spread = found.uncertainty_mm(rule)
        per_rule[rule] = {
            name: {**attrs.asdict(a), "same_choice": a.same_choice, "mesh_uncertainty_mm": spread[name]}
            for name, a in found.agreements(rule).items()
        }
    ends = {
        c.name: {f"{p:g}": float(a) for p, a in zip(BENDING_KPA, c.fine.angle_deg, strict=True)}
        for c in found.columns
    }
    return {
        "set": found.settings.values_name,
        "agreement": per_rule,
        "angle_deg": ends,
        "statements": {rule: {s.text: s.verdict for s in found.statements(rule)} for rule in RULES},
        "versions": package_versions(),
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """What a reproduction came to, in a few lines of text."""
    lines = []
    for rule, by_column in summary.get("agreement", {}).items():
        words = [
            f"{name} {a['spearman']:.2f} ({a['chosen']}, paper {a['theirs']}, x{a['magnitude']:.2f})"
            for name, a in by_column.items()
        ]
        lines.append(f"{rule}: rank correlation {', '.join(words)}")
    held: dict[str, int] = {}
    for verdict in summary.get("statements", {}).get(RULE, {}).values():
        held[verdict] = held.get(verdict, 0) + 1
    if held:
        lines.append("statements: " + ", ".join(f"{count} {verdict}" for verdict, count in held.items()))
    return lines


USE_CASE = UseCase("reproduce", LAYOUT, read_settings, reproduce, console_summary)
