"""Force nonlinearity."""

from ..instrument_curve import bow, curved
from ..load_cell import if_timed
from .declaration import BENCH, CELL, Declaration, Law

EFFECT = Declaration(
    mechanism="the load cell's reading is not proportional to the force, by at most 5 % of its largest",
    reveals="dead weights hung from the load cell, in steps up to the largest force",
    remedy="calibrate the load cell by dead weights up to its largest force",
    of=BENCH,
    instrument=True,
    laws=(
        Law(
            CELL,
            (bow("off straight at half load, of the largest; load cells 0.0005, film sensors 0.03"),),
            {"cell_curve": lambda force, v, at: curved(force, v["bow"], at.largest)},
            offered=if_timed,
        ),
    ),
)
