"""The node of units in series: their tip under pressures over time, or the pressures that reach a point."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...chain import settings as chain
from ...errors import InputError
from ...graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, setting

if TYPE_CHECKING:
    from ...graph.evaluation import Finished, Order

CHAIN = "Chain"


def _remark(outputs: Outputs) -> str:
    x, y, z = outputs["summary"]["chain"]["tip_mm"]
    return f"tip at {x:.1f}, {y:.1f}, {z:.1f} mm"


def _chain(call: Call) -> Order:
    from ...chain.joint_learning import Sampling
    from ...chain.pressures import read_pressures
    from ...graph.evaluation import Order
    from ...studies.chain import MOST_UNITS, Chain, ChainUnit, MeshTable
    from ...studies.use_case import use_case
    from .parts import refuse_body

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
            f"{len(turns)} turns for {len(designs)} units",
            "turns_deg",
            "give one for each unit, or leave it empty",
        )
    reach = _numbers(s["reach_mm"], "reach_mm")
    bounds = (s["low_kPa"], s["high_kPa"]) if reach else None
    job = Chain(
        units=tuple(ChainUnit(d.unit, turn, bounds) for d, turn in zip(designs, turns, strict=True)),
        protocol=read_pressures(Path(s["protocol"]), len(designs)) if s["protocol"] else None,
        reach=tuple(reach),
        gravity=s["gravity"],
        orientation_deg=s["orientation_deg"],
        tip_mass_g=s["tip_mass_g"],
        times=s["times"],
        mesh=MeshTable(s["refine"]),
        joint=Sampling(pressure_step_kPa=s["step_kPa"], loaded=s["loaded"]),
    )
    return Order(use_case("chain"), job)


def _numbers(text: str, where: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        raise InputError(f"{text!r} are not numbers", where, "give numbers, such as 0 0 180") from None


def _solved(call: Call, done: Finished) -> Outputs:
    name = "target.csv" if "target" in done.summary else "tip.csv"
    angle = float(done.summary["chain"]["angle_deg"])
    return {"tip": done.folder / name, "angle": angle, "summary": done.summary}


def chain_nodes() -> tuple[Definition, ...]:
    """Definition of the node Chain."""
    return (
        Definition(
            "chain",
            "Chain",
            CHAIN,
            "units in series under gravity and a load at the tip",
            (Input("units", ("unit",), "link units, the one at the base first", many=True),),
            (
                Output("tip", "file", "tip.csv, or target.csv with a point to reach"),
                Output("angle", "number", "angle of the tip relative to the base, degrees"),
            ),
            (
                setting("copies", 1, "number of times that the linked units are repeated", low=1, high=8),
                setting("turns_deg", "", "turn of each unit about the axis, such as 0 0 180; empty: none"),
                setting(
                    "protocol",
                    "",
                    "CSV of time_s, pressure_1_kPa and so on, a column for each unit",
                    path=FILE,
                ),
                setting(
                    "reach_mm", "", "point that the tip is to reach, such as 0 -15 415; no protocol then"
                ),
                setting(
                    "low_kPa", 0.0, "lowest pressure allowed to reach it", unit="kPa", low=-99.0, high=1000.0
                ),
                setting("high_kPa", 30.0, "highest pressure", unit="kPa", low=-99.0, high=1000.0),
                Setting(chain.GRAVITY),
                Setting(chain.ORIENTATION),
                Setting(chain.TIP_MASS),
                Setting(chain.TIMES),
                Setting(chain.PRESSURE_STEP._replace(name="step_kPa")),
                Setting(chain.LOADED),
                Setting(chain.REFINE),
            ),
            order=_chain,
            read=_solved,
            muting="this node and those that need it are not computed",
            remark=_remark,
        ),
    )
