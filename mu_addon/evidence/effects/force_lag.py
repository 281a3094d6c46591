"""Force lag."""

from ..lags import first_order_lag
from ..load_cell import if_timed
from ..ringing import swinging
from .declaration import BENCH, CELL, Array, Declaration, Law, Parameter, Setting, Values

FILTER = (Parameter("time_s", "s", 0.0, 2.0, 0.0, (0.05, 0.5), "amplifiers average over 1 ms to 1 s"),)
# Of two poles: equal ones are damped by 1, a Bessel filter's by 0.87, a Butterworth filter's by 0.71.
OF_TWO = (
    Parameter("period_s", "s", 0.0, 10.0, 0.0, (0.2, 1.0), "of two poles: 6.3 times the time of each"),
    Parameter("damping", "", 0.5, 0.999, 0.87, (0.87,), "share of the critical damping, as filters have it"),
)


def _delayed(force: Array, v: Values, at: Setting) -> Array:
    return first_order_lag(at.time_s, force, v["time_s"])


def _delayed_twice(force: Array, v: Values, at: Setting) -> Array:
    return swinging(at.time_s, force[None], 1.0 / v["period_s"], v["damping"])[0]


EFFECT = Declaration(
    mechanism="the filter of the load cell delays its reading",
    reveals="the filter switched off; one protocol at two rates a decade apart",
    remedy="switch off the load cell's filter, or test slower",
    of=BENCH,
    instrument=True,
    laws=(
        Law(CELL, FILTER, {"filter": _delayed}, offered=if_timed),
        Law(
            CELL,
            OF_TWO,
            {"filter": _delayed_twice},
            "the filter of the load cell, of two poles, delays its reading",
            refines=True,
            offered=if_timed,
        ),
    ),
)
