"""Runs of a unit side by side: the inputs in which they differ, and their results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from ..design.parameters import SECTIONS
from ..design.quantity import describe
from .unit_runs import Run

_SETTINGS = (
    ("refinement", "simulate", "mesh", "refine"),
    ("meshed part", "simulate", "mesh", "fraction"),
    ("instants", "simulate", "times"),
    ("without suction", "simulate", "under_pressure"),
    ("self-contact", "simulate", "self_contact"),
    ("self-friction", "simulate", "self_friction"),
    ("protocol", "simulate", "protocol_sha256"),
    ("obstacles", "simulate", "obstacles_sha256"),
    ("body", "design", "body_sha256"),
    ("effects", "simulate", "effects"),
    ("gravity", "simulate", "orientation_deg"),
    ("paths", "place", "paths"),
    ("stations", "place", "stations"),
    ("mesh check", "place", "mesh_check"),
)
"""Settings of a run: the label of each, its stage in study.toml, and its keys there."""
NONE = "-"
"""Shown where a run has no such value."""


@attrs.frozen
class Row:
    """One line of a comparison: quantity, unit, a value (text) of each run, and True if it is an input."""

    what: str
    unit: str
    values: tuple[str, ...]
    is_input: bool = False


def compare(runs: Sequence[Run]) -> list[Row]:
    """Inputs in which runs differ, then bending angles, best path, J and seconds of each."""
    rows = [row for row in _inputs(runs) if len(set(row.values)) > 1]
    met = [{p for p, _ in run.angles} for run in runs if run.angles]
    # A stopped run has not reached every pressure: compared are those that both have.
    pressures = sorted(set.intersection(*met) or set.union(*met)) if met else []
    for p in (pressures[0], pressures[-1]) if len(pressures) > 1 else pressures:
        angles = [dict(run.angles).get(p) for run in runs]
        rows.append(Row(f"At {p:g} kPa", "deg", tuple(_number(a, "+.2f") for a in angles)))
    if any(run.ranking for run in runs):
        best = [run.ranking[0] if run.ranking else (NONE, None) for run in runs]
        rows.append(Row("Best path", "", tuple(name for name, _ in best)))
        rows.append(Row("Its deviation", "mm", tuple(_number(j, ".4f") for _, j in best)))
    rows.append(Row("Time taken", "s", tuple(_number(run.seconds or None, ".0f") for run in runs)))
    return rows


def _inputs(runs: Sequence[Run]) -> list[Row]:
    jobs = {"simulate": "motion", "place": "ranking"}
    rows = [Row("job", "", tuple(jobs.get(run.job, run.job) for run in runs), True)]
    rows.append(Row("scale", "", tuple(_text(run.unit.scale) for run in runs), True))
    for section in SECTIONS:
        groups = [getattr(run.unit, section.section) for run in runs]  # type: ignore[attr-defined]
        for d in describe(section):
            values = tuple(_text(getattr(group, d.name)) for group in groups)
            # Its name ends with its unit, which has a separate column.
            bare = d.name.removesuffix("_" + d.unit.replace("/", "_")) if d.unit else d.name
            rows.append(Row(bare.replace("_", " "), d.unit, values, True))

    for what, stage, *keys in _SETTINGS:
        # A stage that one of them lacks is shown by its job.
        if not all(stage in run.tables for run in runs):
            continue
        rows.append(Row(what, "", tuple(_text(_setting(run, stage, keys)) for run in runs), True))
    return rows


def _setting(run: Run, stage: str, keys: Sequence[str]) -> Any:
    """Value of nested keys in a run's study.toml; None if it has none."""
    found: Any = run.tables.get(stage, {})
    for name in keys:
        found = found.get(name) if isinstance(found, dict) else None
    # The hash of a file shows a difference, and nothing more.
    return found[:8] if keys[-1].endswith("_sha256") and isinstance(found, str) else found


def _text(value: Any) -> str:
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, dict):
        return ", ".join(f"{k} {_text(v)}" for k, v in value.items()) or NONE
    return ", ".join(map(_text, value)) if isinstance(value, list | tuple) else str(value)


def _number(value: float | None, form: str) -> str:
    return NONE if value is None else format(value, form)
