"""Force drift."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the zero of the load cell drifts while it records",
    reveals="the load cell read for as long without a specimen",
    remedy="let the load cell warm up, and read its zero before and after",
    of=BENCH,
    instrument=True,
    level=True,
)
