"""Line lag."""

from ..lags import first_order_lag
from .declaration import BENCH, DRIVEN, IN_MODEL, Array, Declaration, Law, Parameter, Setting, Values

# A second law: the volume before the chambers (tube, filter, manifold) fills first. Two volumes, each behind
# a resistance, have two real time constants, whatever their sizes.
TWO_VOLUMES = (
    Parameter("slower_s", "s", 0.0, 5.0, 0.0, (0.05, 0.5), "slower time of two volumes in a row"),
    Parameter("faster_share", "", 0.0, 0.99, 0.3, (0.3,), "the other time, of the slower one"),
)


def _through_two(p: Array, v: Values, at: Setting) -> Array:
    """One lag after the other, in partial fractions: exact for p linear between its samples."""
    slower, share = v["slower_s"] / at.fed, v["faster_share"]
    slow, fast = (first_order_lag(at.time_s, p, time) for time in (slower, share * slower))
    return (slow - share * fast) / (1.0 - share)


EFFECT = Declaration(
    mechanism="the resistance of the air line delays the chamber pressure behind the gauge",
    reveals="steps and fast cycles",
    remedy=f"{IN_MODEL}; a shorter or wider line, or a gauge at the unit",
    shown_by={
        "unit_pressure": "steps of pressure, with the camera at 30 frames a second or more",
        "pressure_step": "the same steps with the gauge at the unit's end of the line",
    },
    of=BENCH,
    laws=(
        Law(
            DRIVEN,
            (Parameter("time_s", "s", 0.0, 5.0, 0.0, (0.05, 0.5), "resistance times the chambers' volume"),),
            {"line": lambda p, v, at: first_order_lag(at.time_s, p, v["time_s"] / at.fed)},
        ),
        Law(
            DRIVEN,
            TWO_VOLUMES,
            {"line": _through_two},
            "two volumes of the air line fill in a row, so that the chamber pressure lags behind the gauge",
            refines=True,
        ),
    ),
)
