"""Force nonlinearity."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the load cell's reading is not proportional to the force, by at most 5 % of its largest",
    reveals="dead weights hung from the load cell, in steps up to the largest force",
    remedy="calibrate the load cell by dead weights up to its largest force",
    of=BENCH,
    instrument=True,
)
