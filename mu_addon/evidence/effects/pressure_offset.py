"""Pressure offset."""

from __future__ import annotations

import attrs

from .declaration import BENCH, OF_UNITS, Data, Declaration, Law, Parameter

# Of the largest reading: a gauge with a larger offset of its zero is noticed before any measurement.
OFFSET_SHARE, LEAST_OFFSET_kPa = 0.1, 1.0


def _noticed(law: Law, data: Data) -> tuple[Law, ...]:
    most = max(OFFSET_SHARE * data.largest("pressure_kPa"), LEAST_OFFSET_kPa)
    return (attrs.evolve(law, parameters=(law.parameters[0].narrowed(-most, most),)),)


EFFECT = Declaration(
    mechanism="the pressure gauge does not read zero at rest",
    reveals="a record at rest; pressure and vacuum",
    remedy="set the gauge's zero, or subtract the offset from the readings",
    shown_by={
        "pressure_hold": "the gauge open to the air before and after",
        "blocked_force": "the gauge open to the air before and after",
    },
    of=BENCH,
    instrument=True,
    level=True,
    laws=(
        Law(
            (*OF_UNITS, "pressure_hold"),
            (Parameter("offset_kPa", "kPa", -10.0, 10.0, 0.0, (-1.0, 1.0), "gauge pressures of benches"),),
            {
                "zero": lambda p, v, at: p - v["offset_kPa"],
                "read_zero": lambda p, v, at: p + v["offset_kPa"],
            },
            offered=_noticed,
        ),
    ),
)
