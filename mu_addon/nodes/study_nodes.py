"""Nodes of jobs on a unit: simulation, ranking of paths, the lattice's law, print, gripper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..design.body import read_body
from ..design.gripper import Fingers, Gripper, Plate
from ..design.quantity import describe
from ..design.rigid_body import RigidBody
from ..design.settings import FRICTION
from ..errors import InputError
from ..graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, node, setting
from ..graph.evaluation import Finished
from ..studies.parameter_study.results import angles_of
from .parts import refuse_body
from .studies import UNIT, node_of

SIMULATE, PLACE, GRASP = "Simulate", "Sensor", "Gripper"
FIGURES = (
    "angle at the highest pressure",
    "angle at the lowest pressure",
    "range of angles",
    "volume of resin",
    "least deviation",
)
_TAKES_STUDY = Input("study", ("study",), "link a node Simulate or Rank Paths")


@node(
    SIMULATE,
    outputs=(Output("obstacle", "obstacle", "the body"),),
    settings=(setting("file", "", "closed surface in mm: STL, OBJ or PLY", path=FILE), Setting(FRICTION)),
    remark=lambda outputs: outputs["obstacle"].name,
)
def obstacle(call: Call) -> Outputs:
    """A rigid body that the unit may touch, fixed in the unit's frame."""
    s = call.settings
    if not s["file"]:
        raise InputError("no body is named", "file", "give a file of a closed surface: STL, OBJ or PLY")
    return {"obstacle": RigidBody(read_body(s["file"]), s["friction"])}


def _found_by_place(call: Call, what: str) -> tuple[Path, dict[str, Any]]:
    """Folder of a study, and what its ranking found, by name; raises InputError without it."""
    study: Finished = call.inputs["study"]
    if what not in study.summary:
        raise InputError(
            f"the study has no {what}: its node ranks no paths, or its unit's state depends on history",
            "study",
            "link a node Rank Paths",
        )
    return study.folder, study.summary[what]


@node(
    PLACE,
    (_TAKES_STUDY,),
    (Output("field", "field", "sensitivity.vtu"), Output("largest", "number", "largest, in mm")),
    remark=lambda outputs: f"up to {outputs['largest']:.3g} mm",
)
def sensitivity(call: Call) -> Outputs:
    """The map of how much stiffness anywhere disturbs the motion, and its largest value in mm."""
    folder, found = _found_by_place(call, "sensitivity")
    return {"field": folder / found["file"], "largest": float(found["largest_mm"])}


@node(
    PLACE,
    (_TAKES_STUDY,),
    (Output("signals", "file", "signals.csv"), Output("largest", "number", "largest, per degree")),
    remark=lambda outputs: f"{outputs['path']}: {outputs['largest']:.3g} per degree",
)
def light(call: Call) -> Outputs:
    """The signal of a waveguide along every path, and the largest per degree of bending."""
    folder, found = _found_by_place(call, "light")
    per_deg = found["sensitivity_per_deg"]
    best = max(per_deg, key=lambda name: abs(per_deg[name]))
    return {"signals": folder / "signals.csv", "largest": per_deg[best], "path": best}


@node(
    SIMULATE,
    (_TAKES_STUDY,),
    (Output("number", "number", "the number"),),
    (setting("figure", FIGURES[0], "which number", choices=FIGURES),),
    label="Figure of a Study",
    remark=lambda outputs: f"{outputs['number']:.6g}",
)
def figure(call: Call) -> Outputs:
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


@node(
    GRASP,
    (UNIT,),
    (Output("gripper", "gripper", "the gripper"),),
    (
        setting("path", "alpha4", "path of the waveguides if the unit has none"),
        *map(Setting, (*describe(Fingers), *describe(Plate))),
    ),
    remark=lambda outputs: "{:.4g} x {:.4g} mm".format(*outputs["gripper"].size_mm),
)
def gripper(call: Call) -> Outputs:
    """Two equal units on a plate."""
    s, design = call.settings, call.inputs["unit"]
    refuse_body(design, "a gripper")
    fingers = Fingers(**{d.name: s[d.name] for d in describe(Fingers)})
    plate = Plate(**{d.name: s[d.name] for d in describe(Plate)})
    return {"gripper": Gripper(design.unit, path=design.path or s["path"], fingers=fingers, plate=plate)}


def study_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of simulation, sensor, print and gripper."""
    unit = node_of("simulate"), obstacle, node_of("place"), sensitivity, light, figure
    return *unit, *map(node_of, ("homogenize", "check", "export")), gripper, node_of("grip")
