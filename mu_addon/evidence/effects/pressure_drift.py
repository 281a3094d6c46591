"""Pressure drift."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the zero of the pressure gauge drifts while it records",
    reveals="the same hold at another pressure; the gauge read at rest for as long",
    remedy="let the gauge warm up, and read its zero before and after",
    of=BENCH,
    instrument=True,
    level=True,
)
