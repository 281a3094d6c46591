"""Force scale."""

from ..load_cell import if_timed
from .declaration import BENCH, CELL, Declaration, Law, factor

EFFECT = Declaration(
    mechanism="the force is scaled: load cell, section as typed, clamping or specimen",
    reveals="a dead weight on the load cell, the section measured, the specimen clamped again",
    remedy=(
        "check which specimen was in each test, hang a dead weight from the load cell, measure the "
        "section, and clamp the specimen again"
    ),
    of=BENCH,
    laws=(
        Law(
            CELL,
            (factor("gain", 0.05, "calibrations of load cells, sections, units"),),
            {"cell_gain": lambda force, v, at: force * (1.0 + v["gain"])},
            offered=if_timed,
        ),
    ),
)
