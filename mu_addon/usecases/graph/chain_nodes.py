"""The node of units in series: their tip under pressures over time, or the pressures that reach a point."""

from __future__ import annotations

from ...graph.definition import FILE, Definition, Input, Output, Outputs, setting
from .common_settings import ORDER, QUICK_REFINE
from .loading import of_orders

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
                setting("gravity", True, "whether the units' weight acts"),
                setting(
                    "orientation_deg", 0.0, "of the base about x; 0: hanging", unit="deg", low=-360, high=360
                ),
                setting("tip_mass_g", 0.0, "at the middle of the tip", unit="g", low=0.0, high=1e5),
                setting("times", 13, "instants of the protocol", low=2, high=10_000),
                setting(
                    "step_kPa",
                    10.0,
                    "pressures between which a joint is interpolated",
                    unit="kPa",
                    low=0.5,
                    high=50.0,
                ),
                setting("loaded", True, "learn from loaded states; without: a quick look"),
                ORDER,
                QUICK_REFINE,
            ),
            order=of_orders("chain_order", _ORDERS),
            read=of_orders("chain_of", _ORDERS),
            muting="neither this nor what needs it is computed",
            remark=_remark,
        ),
    )
