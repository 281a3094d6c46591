"""Run of a node Chain, and its results. Loads the solver."""

from __future__ import annotations

from pathlib import Path

from ...chain.learning import Sampling
from ...errors import InputError
from ...graph.definition import Call, Outputs
from ...graph.evaluation import Finished, Order
from ...meshing.settings import MeshSettings
from ..chain.job import MOST_UNITS, ChainUnit, Job, Target, read_pressures
from ..chain.run import USE_CASE
from .parts import refuse_body


def chain_order(call: Call) -> Order:
    """Run of the chain of linked units; raises InputError."""
    s = call.settings
    designs = [design for _, design in call.inputs["units"]] * s["copies"]
    if len(designs) > MOST_UNITS:
        raise InputError(
            f"a chain of {len(designs)} units", "units, copies", f"have {MOST_UNITS} units at most"
        )
    for design in designs:
        refuse_body(design, "a chain")
    turns = _numbers(s["turns_deg"], "turns_deg") or [0.0] * len(designs)
    if len(turns) != len(designs):
        raise InputError(
            f"{len(turns)} turns for {len(designs)} units", "turns_deg", "give one for each unit, or none"
        )
    reach = _numbers(s["reach_mm"], "reach_mm")
    if reach and len(reach) != 3:
        raise InputError(f"{s['reach_mm']!r} is no point", "reach_mm", "give x, y and z in mm")
    bounds = (s["low_kPa"], s["high_kPa"]) if reach else None
    job = Job(
        units=tuple(ChainUnit(d.unit, turn, bounds) for d, turn in zip(designs, turns, strict=True)),
        protocol=read_pressures(Path(s["protocol"]), len(designs)) if s["protocol"] else None,
        target=Target((reach[0], reach[1], reach[2])) if reach else None,
        gravity=s["gravity"],
        orientation_deg=s["orientation_deg"],
        tip_mass_g=s["tip_mass_g"],
        times=s["times"],
        mesh=MeshSettings(order=s["order"], refine=s["refine"], fraction="full"),
        joint=Sampling(pressure_step_kPa=s["step_kPa"], loaded=s["loaded"]),
    )
    return Order(USE_CASE, job)


def _numbers(text: str, where: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        raise InputError(f"{text!r} are no numbers", where, "give numbers, such as 0 0 180") from None


def chain_of(call: Call, done: Finished) -> Outputs:
    """Table of the tip, or of the target, and the tip's angle in degrees, of a finished chain."""
    name = "target.csv" if "target" in done.summary else "tip.csv"
    angle = float(done.summary["chain"]["angle_deg"])
    return {"tip": done.folder / name, "angle": angle, "summary": done.summary}
