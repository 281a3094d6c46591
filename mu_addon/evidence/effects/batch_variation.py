"""Batch variation."""

from .declaration import Declaration, Law, factor

EFFECT = Declaration(
    mechanism="the modulus of one specimen, or its section as typed, differs from that of the others",
    reveals="another specimen in its place, its height and section measured, clamped again",
    remedy="print and test the specimens in one batch, or give that specimen another modulus",
    modulus=True,
    differs=Law((), (factor("change", 0.1, "batches differ by 5 to 20 %, struts by more"),)),
)
