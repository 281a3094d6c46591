"""Runs of solids, and numbers of studies. Loads the solver: imported when one is needed."""

from __future__ import annotations

from ..errors import InputError
from ..graph.definition import Call, Outputs
from ..graph.evaluation import Finished, Order
from ..studies.parameter_study.results import angles_of
from ..studies.unit_ranking import UnitStudy
from .parts import solid_of


def _study_of_place(call: Call, what: str) -> Finished:
    study: Finished = call.inputs["study"]
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
    angles = angles_of(summary)
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


def solid_order(call: Call) -> Order:
    """Run that builds the printable solid of linked parts."""
    unit, given, path = solid_of(call)
    job = UnitStudy(unit=unit, stages=("design",), quality=given.quality, body=given.body, path=path)
    return Order(job)
