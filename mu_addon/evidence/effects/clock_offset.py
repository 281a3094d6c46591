"""Clock offset."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the clocks of camera and gauge differ",
    reveals="steps and fast cycles",
    remedy="record with one clock, or shift the records by the offset",
    of=BENCH,
    instrument=True,
)
