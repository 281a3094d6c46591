"""Force drift."""

from ..drift import drift, drift_laws
from ..load_cell import ZERO_SHARE, largest_N
from .declaration import BENCH, CELL, Array, Data, Declaration, Setting, Values


def _most(data: Data) -> float:
    return ZERO_SHARE * largest_N(data)


def _drifting(shown: Array, v: Values, at: Setting) -> Array:
    """One cell reads all specimens, so that its zero drifts in N."""
    return shown + at.kPa_per_N * drift(at.time_s, v)


EFFECT = Declaration(
    mechanism="the zero of the load cell drifts while it records",
    reveals="the load cell read for as long without a specimen",
    remedy="let the load cell warm up, and read its zero before and after",
    of=BENCH,
    instrument=True,
    level=True,
    laws=drift_laws(CELL, "N", _most, {"cell_drift": _drifting}),
)
