"""Pressure nonlinearity."""

from ..instrument_curve import bow, straightened
from .declaration import BENCH, OF_UNITS, Declaration, Law

EFFECT = Declaration(
    mechanism="the gauge's reading is not proportional to the pressure, by at most 5 % of its largest",
    reveals="the gauge and a second one on the same pressure, in steps up to the largest",
    remedy="compare the gauge with another one in steps up to the largest pressure",
    of=BENCH,
    instrument=True,
    # A hold's own first pressure absorbs a curve.
    laws=(
        Law(
            OF_UNITS,
            (bow("off straight at half pressure, of the largest; gauges 0.0025, cheap ones 0.03"),),
            {"curve": lambda p, v, at: straightened(p, v["bow"], at.largest)},
        ),
    ),
)
