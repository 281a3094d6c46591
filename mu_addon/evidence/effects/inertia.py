"""Inertia."""

import numpy as np

from ..ringing import swinging
from .declaration import Array, Declaration, Law, Parameter, Setting, Values

# Longest period of units of the printed sizes, with their damping.
SLOWEST_s = 2.0
ONE_MODE = (
    Parameter(
        "period_s",
        "s",
        0.0,
        SLOWEST_s,
        0.0,
        (0.03, 0.06, 0.12, 0.25, 0.5),
        "of the first bending mode, undamped; 0 has no mass",
    ),
    Parameter("damping", "", 0.005, 0.95, 0.1, (0.05, 0.3), "share of the critical damping"),
)
# A law with a second mode, tried where inertia is found. A uniform beam clamped at one end swings 6.27 times
# as fast in its second bending mode (1.8751 and 4.6941 squared). Elastomers lose about the same share of
# energy in each cycle at any frequency, hence one damping.
TWO_MODES = (
    Parameter("first_s", "s", 0.0, SLOWEST_s, 0.0, (0.06, 0.12, 0.25, 0.5), "of the first bending mode"),
    Parameter("loss", "", 0.005, 0.5, 0.1, (0.1,), "half the tangent of loss of elastomers, below 1"),
    Parameter("second", "", -0.5, 0.5, 0.0, (0.05,), "share of the way that the second mode has"),
    Parameter("faster", "", 1.5, 20.0, 6.27, (4.0, 6.27), "of a clamped beam, and with a mass at its tip"),
)


def _swinging(still: Array, v: Values, at: Setting) -> Array:
    moved = swinging(at.time_s, still, 1.0 / v["period_s"], v["damping"])
    return _seen(still, moved, v["period_s"], at)


def _in_two_modes(still: Array, v: Values, at: Setting) -> Array:
    first, fast = (
        swinging(at.time_s, still, times / v["first_s"], v["loss"]) for times in (1.0, v["faster"])
    )
    return _seen(still, (1.0 - v["second"]) * first + v["second"] * fast, v["first_s"], at)


def _seen(still: Array, moved: Array, period_s: float, at: Setting) -> Array:
    """Channels (c, n) of a swing as a camera sees them: reduced where an exposure takes a period.

    Each picture is a mean over its exposure. Otherwise a swing faster than the pictures would alias to
    any slow one, and fit noise.
    """
    share = min(1.0, period_s / (2.0 * at.picture_s)) ** 2
    return np.asarray(still + share * (moved - still))


EFFECT = Declaration(
    mechanism="the unit's mass swings after each change of pressure",
    reveals="the same steps through a narrower line; a ballast on the tip lengthens its period",
    remedy="read steps after they have settled, or let pressure in slowly: the simulation has no inertia",
    laws=(
        Law(("pressure_step",), ONE_MODE, {"swing": _swinging}),
        Law(
            ("pressure_step",),
            TWO_MODES,
            {"swing": _in_two_modes},
            "the unit's mass swings after each change of pressure, in two modes of bending",
            refines=True,
        ),
    ),
)
