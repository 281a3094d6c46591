"""Viscoelasticity: relaxation at a held stretch, creep at a held load or pressure."""

import attrs
import numpy as np

from ..chamber import Chamber
from ..lags import first_order_lag
from .declaration import (
    CYCLED,
    DRIVEN,
    IN_MODEL,
    MACHINE,
    Array,
    Data,
    Declaration,
    Law,
    Parameter,
    Setting,
    Values,
)

HOLD = ("pressure_hold",)
# Relaxation by the second law goes on for so many decades of time.
DECADES = 4
# Times of the third law, evenly by their logarithms.
TIMES = 7
ONE = (
    Parameter("share", "", 0.0, 0.7, 0.0, (0.1,), "share of the instantaneous modulus that relaxes"),
    Parameter("time_s", "s", 0.02, 1000.0, 1.0, (0.5, 5.0, 50.0), "relaxation time"),
)
# A second law: polymers relax over many decades of time, and if one relaxation time is too few a drift of the
# gauge would be named instead.
BY_DECADES = (
    Parameter("per_decade", "", 0.0, 0.2, 0.0, (0.03,), "share of the modulus that relaxes in a decade"),
    Parameter("onset_s", "s", 0.02, 1000.0, 1.0, (0.5, 5.0), "when that begins"),
)
# A third one with a parameter more, tried where one of the two is found: relaxation times evenly by their
# logarithms over some decades, which is near a stretched exponential and a Prony series of any length.
SPREAD = (
    Parameter("spread_share", "", 0.0, 0.9, 0.0, (0.15,), "share of the modulus that relaxes in all"),
    Parameter("middle_s", "s", 0.02, 1000.0, 1.0, (0.5, 10.0), "middle of the relaxation times"),
    Parameter("decades", "", 0.0, 8.0, 0.0, (2.0,), "over which they spread"),
)
CREEP = (
    Parameter("creep_per_MPa", "1/MPa", 0.0, 2.0, 0.0, (3e-3,), "the volume's growth a decade of time"),
    Parameter("onset_s", "s", 0.1, 100.0, 1.0, (1.0, 10.0), "when that growth begins"),
)
GROWTH = (
    Parameter("growth_per_MPa", "1/MPa", 0.0, 2.0, 0.0, (3e-3,), "the volume's, as the logarithm of time"),
    Parameter("begins_s", "s", 0.5, 1e4, 30.0, (5.0, 50.0), "began before the valve was shut"),
)
FINDLEY = (
    # From a small size alone fits of a large one end in another minimum, as bad as a wrong law.
    Parameter("findley_per_MPa", "1/MPa", 0.0, 2.0, 0.0, (3e-3, 0.1), "the volume's growth in 100 s"),
    Parameter("findley_power", "", 0.05, 0.8, 0.3, (0.3,), "plastics 0.1 to 0.5 (Findley 1944)"),
)
Elements = tuple[tuple[float, float], ...]
"""Share of the modulus, and time in s, of each part that relaxes."""


def _begun(law: Law, data: Data) -> tuple[Law, ...]:
    """The law, which begins before the longest record ends: later on it is a drift of anything."""
    lasts = [float(np.ptp(e["time_s"])) for e in data.own if "time_s" in e.columns]
    share, onset = law.parameters
    return (attrs.evolve(law, parameters=(share, onset.narrowed(onset.low, max([onset.null, *lasts])))),)


def _one(p: Array, v: Values, at: Setting) -> Array:
    share = v["share"]
    return (1.0 - share) * p + share * first_order_lag(at.time_s, p, v["time_s"] / (1.0 - share))


def _stress_one(stress: Array, v: Values, at: Setting) -> Array:
    # From equilibrium: sigma = sigma_0 - share of the dashpot's strain.
    if at.time_s is None:
        return stress
    return stress - v["share"] * first_order_lag(at.time_s, stress, v["time_s"])


def _element(elements: Elements, v: Values, at: Setting) -> Elements:
    return (*elements, (v["share"], v["time_s"] / (1.0 - v["share"])))


def _in_decades(at: Setting, x: Array, onset_s: float) -> Array:
    """Sum (n,) of lags by onset_s, ten times that, ..., over `DECADES`."""
    return np.asarray(sum(first_order_lag(at.time_s, x, onset_s * 10.0**k) for k in range(DECADES)))


def _decades(p: Array, v: Values, at: Setting) -> Array:
    share = v["per_decade"]
    return (1.0 - DECADES * share) * p + share * _in_decades(at, p, v["onset_s"])


def _stress_decades(stress: Array, v: Values, at: Setting) -> Array:
    return stress if at.time_s is None else stress - v["per_decade"] * _in_decades(at, stress, v["onset_s"])


def _elements(elements: Elements, v: Values, at: Setting) -> Elements:
    return (*elements, *((v["per_decade"], v["onset_s"] * 10.0**k) for k in range(DECADES)))


def spread_lag(time_s: Array, x: Array, middle_s: float, decades: float) -> Array:
    """Mean (n,) of lags of x (n,) by `TIMES` times around a middle one, spread over so many decades."""
    times = middle_s * 10.0 ** (decades * np.linspace(-0.5, 0.5, TIMES))
    return np.asarray(sum(first_order_lag(time_s, x, time) for time in times.tolist()) / TIMES)


def _spread(p: Array, v: Values, at: Setting) -> Array:
    share = v["spread_share"]
    return (1.0 - share) * p + share * spread_lag(at.time_s, p, v["middle_s"] / (1.0 - share), v["decades"])


def _stress_spread(stress: Array, v: Values, at: Setting) -> Array:
    if at.time_s is None:
        return stress
    return stress - v["spread_share"] * spread_lag(at.time_s, stress, v["middle_s"], v["decades"])


def _creeping(gas: Chamber, v: Values, at: Setting) -> Chamber:
    return attrs.evolve(gas, creep_per_kPa=1e-3 * v["creep_per_MPa"], onset_s=v["onset_s"])


def _growing(gas: Chamber, v: Values, at: Setting) -> Chamber:
    growth, begins = 1e-3 * v["growth_per_MPa"], v["begins_s"]
    return attrs.evolve(gas, softness=(*gas.softness, lambda t: growth * np.log10(1.0 + t / begins)))


def _by_power(gas: Chamber, v: Values, at: Setting) -> Chamber:
    growth, power = 1e-3 * v["findley_per_MPa"], v["findley_power"]
    return attrs.evolve(gas, softness=(*gas.softness, lambda t: growth * (t / 100.0) ** power))


EFFECT = Declaration(
    mechanism="all moduli relax with time",
    reveals="pressure holds, and one protocol at two rates a decade apart",
    remedy=f"{IN_MODEL}; compare loads at one rate, and read holds at one time",
    shown_by={
        "coupon": "one coupon at two rates a decade apart, or held at a stretch",
        "lattice_compression": "one block at two rates a decade apart, or held",
        "pressure_hold": "a longer hold, and the same in a rigid chamber of that volume",
        "pressure_step": "one step held for two decades of time longer",
        "blocked_force": "the tip blocked at a larger gap, held for two decades of time",
    },
    memory=True,
    laws=(
        Law(
            (*DRIVEN, *MACHINE),
            ONE,
            {"relaxation": _one, "stress_relaxation": _stress_one, "elements": _element},
        ),
        Law(
            (*DRIVEN, *MACHINE),
            BY_DECADES,
            {"relaxation": _decades, "stress_relaxation": _stress_decades, "elements": _elements},
            "all moduli relax with time, equally in each decade",
            offered=_begun,
        ),
        Law(
            (*CYCLED, *MACHINE),
            SPREAD,
            {"relaxation": _spread, "stress_relaxation": _stress_spread},
            "all moduli relax with time, by times spread over some decades",
            refines=True,
        ),
        Law(
            HOLD,
            CREEP,
            {"gas": _creeping},
            "the wall creeps under pressure, so the chamber grows by as much in each decade of time",
        ),
        Law(
            HOLD,
            GROWTH,
            {"gas": _growing},
            "the wall creeps under pressure, so the chamber grows by as much in each decade of time",
        ),
        Law(
            HOLD,
            FINDLEY,
            {"gas": _by_power},
            "the wall creeps under pressure, so the chamber grows as a power of time",
            refines=True,
        ),
    ),
)
