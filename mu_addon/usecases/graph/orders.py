"""Runs of nodes, and their results. Loads the solver: imported when one is needed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from ...design.rigid_body import require_beside
from ...errors import InputError
from ...graph.definition import Call, Outputs
from ...graph.evaluation import Finished, Order
from ...meshing.settings import MeshSettings
from ...studies.unit_inputs import protocol_of
from ...studies.unit_ranking import UnitStudy
from ...studies.use_case import use_case
from ..simulate_and_place.extended_unit import read_extended
from ..simulate_and_place.named_effects import NamedEffects
from .parts import solid_of


@attrs.frozen(eq=False)
class Study:
    """A finished study: its inputs, its folder and its summary."""

    job: UnitStudy
    folder: Path
    summary: Mapping[str, Any]


def study_of(call: Call, done: Finished) -> Outputs:
    """Study of a finished run."""
    return {"study": Study(_simulated(call) if "unit" in call.inputs else _placed(call), *_kept(done))}


def _kept(done: Finished) -> tuple[Path, Mapping[str, Any]]:
    return done.folder, done.summary


def _simulated(call: Call) -> UnitStudy:
    """Study of a node Simulate; raises InputError."""
    s, design = call.settings, call.inputs["unit"]
    unit, effects = design.unit, NamedEffects(orientation_deg=s["orientation_deg"], where=call.node)
    model: Path | None = call.inputs["model"]
    if model is not None:
        found = read_extended(unit, model)
        unit, effects = found.unit, attrs.evolve(found.effects, orientation_deg=s["orientation_deg"])
    obstacles = tuple(body for _, body in call.inputs["obstacles"])
    require_beside(obstacles, unit.dimensions, design.body)
    return UnitStudy(
        unit=unit,
        protocol=protocol_of(s["protocol"] or None),
        mesh=MeshSettings(refine=s["refine"]),
        times=s["times"],
        self_contact=s["self_contact"],
        self_friction=s["self_friction"],
        body=design.body,
        obstacles=obstacles,
        effects=effects,
        stages=("design", "simulate"),
    )


def _placed(call: Call) -> UnitStudy:
    """Study of a node Rank Paths: the simulated one with its paths. Raises InputError."""
    s, study = call.settings, call.inputs["study"]
    return attrs.evolve(
        study.job,
        stages=("design", "simulate", "place"),
        stations=s["stations"],
        mesh_check=s["mesh_check"],
        all_paths=s["all_paths"],
        paths=s["paths"],
        checks=s["checks"],
        workers=s["workers"],
    )


def _study_of_place(call: Call, what: str) -> Study:
    study: Study = call.inputs["study"]
    if what not in study.summary:
        raise InputError(
            f"the study has no {what}: its node ranks no paths, or its unit's state depends on history",
            "study",
            "link a node Rank Paths",
        )
    return study


def sensitivity_of(call: Call) -> Outputs:
    """File of a study's sensitivity map, and its largest value in mm."""
    found = _study_of_place(call, "sensitivity").summary["sensitivity"]
    return {"field": call.inputs["study"].folder / found["file"], "largest": float(found["largest_mm"])}


def light_of(call: Call) -> Outputs:
    """File of a study's signals, and the largest per degree."""
    found = _study_of_place(call, "light").summary["light"]["sensitivity_per_deg"]
    best = max(found, key=lambda name: abs(found[name]))
    return {"signals": call.inputs["study"].folder / "signals.csv", "largest": found[best], "path": best}


def figure_of(call: Call) -> Outputs:
    """One number of a study."""
    summary, what = call.inputs["study"].summary, call.settings["figure"]
    angles = {float(p): a for p, a in (summary.get("angle_deg") or {}).items()}
    volume = ((summary.get("gates") or {}).get("unit.stl") or {}).get("volume_mm3")
    by_path = summary.get("J_hat_mm")
    found = {
        "angle at the highest pressure": angles[max(angles)] if angles else None,
        "angle at the lowest pressure": angles[min(angles)] if angles else None,
        "range of angles": max(angles.values()) - min(angles.values()) if angles else None,
        "volume of resin": volume,
        "least deviation": min(by_path.values()) if by_path else None,
    }[what]
    if found is None:
        raise InputError(f"the study has no {what}", "figure", "choose another figure, or link Rank Paths")
    return {"number": float(found)}


def simulate_order(call: Call) -> Order:
    """Run that simulates a unit."""
    return Order(use_case("simulate"), _simulated(call))


def place_order(call: Call) -> Order:
    """Run that ranks a study's paths, continuing it."""
    return Order(use_case("place"), _placed(call), after=call.inputs["study"].folder)


def solid_order(call: Call) -> Order:
    """Run that builds the printable solid of linked parts."""
    unit, given, path = solid_of(call)
    job = UnitStudy(unit=unit, stages=("design",), quality=given.quality, body=given.body, path=path)
    return Order(use_case("design"), job)
