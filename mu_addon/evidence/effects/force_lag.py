"""Force lag."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the filter of the load cell delays its reading",
    reveals="the filter switched off; one protocol at two rates a decade apart",
    remedy="switch off the load cell's filter, or test slower",
    of=BENCH,
    instrument=True,
)
