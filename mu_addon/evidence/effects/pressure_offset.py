"""Pressure offset."""

from .declaration import BENCH, Declaration

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
)
