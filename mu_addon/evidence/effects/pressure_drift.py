"""Pressure drift."""

from ..drift import drift, drift_laws
from .declaration import BENCH, DRIVEN, Data, Declaration

# Of the largest reading, possible drift of a gauge's zero: data sheets allow 0.25 to 2 % of full scale, a few
# times the reading.
GAUGE_SHARE = 0.05


def _most(data: Data) -> float:
    return GAUGE_SHARE * data.largest("pressure_kPa")


EFFECT = Declaration(
    mechanism="the zero of the pressure gauge drifts while it records",
    reveals="the same hold at another pressure; the gauge read at rest for as long",
    remedy="let the gauge warm up, and read its zero before and after",
    of=BENCH,
    instrument=True,
    level=True,
    laws=drift_laws(
        (*DRIVEN, "pressure_hold"),
        "kPa",
        _most,
        {
            "drift": lambda p, v, at: p - drift(at.time_s, v),
            "read_drift": lambda p, v, at: p + drift(at.time_s, v),
        },
    ),
)
