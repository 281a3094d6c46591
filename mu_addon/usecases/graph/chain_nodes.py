"""The node of units in series: their tip under pressures over time, or the pressures that reach a point."""

from __future__ import annotations

from ...chain import settings as chain
from ...graph.definition import FILE, Definition, Input, Output, Outputs, Setting, setting
from .common import ORDER, of_orders

CHAIN = "Chain"
_ORDERS = "chain_orders"


def _remark(outputs: Outputs) -> str:
    x, y, z = outputs["summary"]["chain"]["tip_mm"]
    return f"tip at {x:.1f}, {y:.1f}, {z:.1f} mm"


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
                Output("angle", "number", "angle of the tip against the base, degrees"),
            ),
            (
                setting("copies", 1, "how often the linked units follow each other", low=1, high=8),
                setting("turns_deg", "", "turn of each unit about the axis, such as 0 0 180; empty: none"),
                setting(
                    "protocol", "", "CSV of time_s, pressure_1_kPa and so on, a column a unit", path=FILE
                ),
                setting(
                    "reach_mm", "", "point that the tip is to reach, such as 0 -25 405; no protocol then"
                ),
                setting("low_kPa", 0.0, "lowest pressure to reach it by", unit="kPa", low=-99.0, high=1000.0),
                setting("high_kPa", 30.0, "highest pressure", unit="kPa", low=-99.0, high=1000.0),
                Setting(chain.GRAVITY),
                setting(
                    "orientation_deg", 0.0, "of the base about x; 0: hanging", unit="deg", low=-360, high=360
                ),
                Setting(chain.TIP_MASS),
                Setting(chain.TIMES),
                Setting(chain.PRESSURE_STEP._replace(name="step_kPa")),
                Setting(chain.LOADED),
                ORDER,
                Setting(chain.REFINE),
            ),
            order=of_orders("chain_order", _ORDERS),
            read=of_orders("chain_of", _ORDERS),
            muting="neither this nor what needs it is computed",
            remark=_remark,
        ),
    )
