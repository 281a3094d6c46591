"""The paper's table, done again: three units and the gripper's finger, beside what the paper prints."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from mu_addon.design.parameters import Unit
from mu_addon.files import write_csv
from mu_addon.run.cache import Cache
from mu_addon.run.context import RunContext
from mu_addon.run.pool import each
from mu_addon.run.progress import Progress
from mu_addon.run.usecase import UseCase
from mu_addon.run.versions import package_versions
from mu_addon.usecases.simulate_and_place.job import grasp

from ..inclusion_rules import RULES
from . import gripper
from .found import Found, OtherTableColumn
from .published import Published, name_of, published
from .report import write_report
from .settings import AGREEMENT, BENDING, LAYOUT, REPORT, STATEMENTS, TABLE, Settings, read_settings
from .table_columns import BENDING_KPA, Solved, TableColumn, solved, tasks
from .values import RULE, unit_of_table_column

Array = np.ndarray[Any, Any]

# Samples of the grasp protocol, as in `place`.
TIMES = 13


def reproduce(settings: Settings, folder: Path, context: RunContext) -> Found:
    """Make the paper's table again, with figures. Raises InputError, MeshingError and ConvergenceError."""
    found = solve(settings, Cache(folder / "cache"), context.progress)
    write_tables(found, folder)
    context.summary |= summary(found)

    def write(_: str) -> None:
        with context.progress.stage("report", expected_s=10.0):
            write_report(found, folder / REPORT)

    context.report = write
    return found


def solve(settings: Settings, cache: Cache, progress: Progress) -> Found:
    """Table and bending of the three units, and the gripper's column where it is asked for."""
    paper, unit = published(), settings.unit
    _, samples = grasp().sample(TIMES)
    units = [unit_of_table_column(unit, scale, modulus) for scale, modulus in paper.modulus_kPa.items()]
    with progress.stage("columns"):
        columns = _columns(units, settings, samples, cache, progress)
    others: dict[str, OtherTableColumn] = {}
    if settings.gripper:
        with progress.stage("gripper"):
            others = _gripper(settings, paper, cache, progress)
    return Found(settings, paper, columns, others, samples)


def _columns(
    units: Sequence[Unit], settings: Settings, samples: Array, cache: Cache, progress: Progress
) -> tuple[TableColumn, ...]:
    todo = tasks(units, settings.mesh, samples, settings.held_cells)
    known: dict[int, Solved] = {}
    for number, one in each(partial(solved, cache=cache), todo, settings.workers, "columns"):
        known[number] = one
        progress.update(len(known) / len(todo))
    return tuple(
        TableColumn(name_of(unit.scale), unit.scale, known[2 * i], known[2 * i + 1])
        for i, unit in enumerate(units)
    )


def _gripper(
    settings: Settings, paper: Published, cache: Cache, progress: Progress
) -> dict[str, OtherTableColumn]:
    refine = min(settings.mesh.refine, gripper.REFINE)
    todo = gripper.tasks(settings.values, [p.name for p in paper.paths], refine)
    known: dict[int, Array | str] = {}
    for number, J_hat in each(partial(gripper.solved, cache=cache), todo, settings.workers, "columns"):
        known[number] = J_hat
        progress.update(len(known) / len(todo))
    found: dict[str, OtherTableColumn] = {}
    for number, task in enumerate(todo):
        column = found.setdefault(task.name, OtherTableColumn({}))
        J_hat = known[number]
        if isinstance(J_hat, str):
            found[task.name] = attrs.evolve(column, remark=f"{task.rule}: {J_hat}")
        else:
            found[task.name] = attrs.evolve(column, J_hat={**column.J_hat, task.rule: J_hat})
    return found


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
    counts: dict[str, int] = {}
    for verdict in summary.get("statements", {}).get(RULE, {}).values():
        counts[verdict] = counts.get(verdict, 0) + 1
    if counts:
        lines.append("statements: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    return lines


USE_CASE = UseCase("reproduce", LAYOUT, read_settings, reproduce, console_summary)
