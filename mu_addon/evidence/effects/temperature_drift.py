"""Temperature drift."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from ...measured.folder import ATMOSPHERE_kPa
from ..chamber import AIR_GAMMA, ROOM, ROOM_K, Chamber, beginning_kPa, warmed
from .declaration import EITHER, MACHINE, OF_UNITS, Array, Data, Declaration, Law, Parameter, Setting, Values

HOLD = ("pressure_hold",)
REFERENCE_C = 23.0
SUPPLY_K = 5.0
COOLING = (
    Parameter("cooling_K", "K", -40.0, 120.0, 0.0, (-3.0, 3.0), "compressed gas is warm"),
    Parameter("cooling_s", "s", 0.5, 3600.0, 30.0, (10.0, 60.0), "to the temperature of the wall"),
)
BY_COMPRESSION = (
    Parameter("warmth", "", 0.0, 1.0, 0.0, (0.05,), "share of the warming by adiabatic compression"),
    Parameter("cools_s", "s", 0.5, 3600.0, 30.0, (10.0, 60.0), "to the temperature of the wall"),
)
TWO_RATES = (
    Parameter("cooling_K_per_100_kPa", "K", 0.0, 60.0, 0.0, (3.0,), "without any loss of heat 64 K"),
    Parameter("first_s", "s", 0.5, 600.0, 10.0, (5.0, 20.0), "to the temperature of the wall"),
    Parameter("later_share", "", 0.0, 0.9, 0.0, (0.3,), "of the cooling that waits for the wall"),
    Parameter("later_times", "", 1.5, 60.0, 6.0, (6.0,), "as long takes the wall to the room's"),
)


def _warm(modulus: Any, v: Values, at: Setting) -> Any:
    kelvin = at.experiment.temperature_C - REFERENCE_C
    return modulus * (1.0 + v["per_K"] * (kelvin if math.isfinite(kelvin) else 0.0))


def _adiabatic(law: Law, data: Data) -> tuple[Law, ...]:
    """The law, no warmer than gas compressed or expanded adiabatically, by a few kelvin.

    T / T0 = (P / P0)^((gamma - 1) / gamma), gamma of air; supplies and rooms differ.
    """
    begun = [0.0, *(beginning_kPa(e) for e in data.own)]
    ratio = np.array([max(1.0 + p / ATMOSPHERE_kPa, 0.05) for p in (min(begun), max(begun))])
    low, high = _adiabatic_K(ratio) + np.array([-SUPPLY_K, SUPPLY_K])
    cooling, lasts = law.parameters
    return (attrs.evolve(law, parameters=(cooling.narrowed(float(low), float(high)), lasts)),)


def _adiabatic_K(ratio: Any) -> Any:
    """Warming in K of the room's air by compression to `ratio` times its pressure, without loss of heat."""
    return ROOM_K * (ratio ** (1.0 - 1.0 / AIR_GAMMA) - 1.0)


def _excess(gas: Chamber, excess_K: float, left: Any) -> Chamber:
    """Of gas that is warmer at the start by an excess; left: of times, what is left of it, less 1."""
    return attrs.evolve(gas, warming=(*gas.warming, lambda t: excess_K * left(t) / (ROOM_K + excess_K)))


def _cooling(gas: Chamber, v: Values, at: Setting) -> Chamber:
    return _excess(gas, v["cooling_K"], lambda t: np.expm1(-t / v["cooling_s"]))


def _compressed(gas: Chamber, v: Values, at: Setting) -> Chamber:
    excess_K = v["warmth"] * _adiabatic_K((gas.initial_kPa + ATMOSPHERE_kPa) / ATMOSPHERE_kPa)
    return _excess(gas, excess_K, lambda t: np.expm1(-t / v["cools_s"]))


def _at_two_rates(gas: Chamber, v: Values, at: Setting) -> Chamber:
    first_s, later, times = v["first_s"], v["later_share"], v["later_times"]
    return _excess(
        gas,
        0.01 * v["cooling_K_per_100_kPa"] * gas.initial_kPa,
        lambda t: (1.0 - later) * np.expm1(-t / first_s) + later * np.expm1(-t / (times * first_s)),
    )


def _in_a_warm_room(p: Array, v: Values, at: Setting) -> Array:
    if ROOM in at.experiment.columns:
        return p
    return warmed(p, v["room_K_per_hour"] * (at.time_s - at.time_s[0]) / 3600.0)


EFFECT = Declaration(
    mechanism="the modulus depends on temperature",
    reveals="one protocol at two temperatures",
    remedy="keep the temperature constant, or record it with every experiment",
    shown_by={
        "pressure_hold": "the same hold reached slowly, so that its gas is not warm at first",
    },
    of=EITHER,
    laws=(
        Law(
            (*OF_UNITS, *MACHINE),
            (Parameter("per_K", "1/K", -0.05, 0.05, 0.0, (-0.005,), "modulus lost a kelvin"),),
            {"modulus": _warm, "stiffness": _warm},
        ),
        Law(
            HOLD,
            COOLING,
            {"gas": _cooling},
            "the gas cools to the temperature of the wall, and its pressure with it",
            offered=_adiabatic,
        ),
        Law(
            HOLD,
            (
                Parameter(
                    "room_K_per_hour", "K/h", -12.0, 12.0, 0.0, (2.0,), "rooms over a morning; logs tell"
                ),
            ),
            {"room": _in_a_warm_room},
            "the room warms or cools steadily, and the gas in the chamber with it",
        ),
        Law(
            HOLD,
            BY_COMPRESSION,
            {"gas": _compressed},
            "gas cools that was compressed faster than it gives off its heat, the more the higher its "
            "pressure",
        ),
        Law(
            HOLD,
            TWO_RATES,
            {"gas": _at_two_rates},
            "the gas cools to the temperature of the wall, and more slowly with the wall to that of the room",
            refines=True,
        ),
    ),
)
