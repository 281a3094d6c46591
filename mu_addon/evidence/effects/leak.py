"""Leak."""

import math
from collections.abc import Callable

import attrs

from ...measured.folder import ATMOSPHERE_kPa
from ..chamber import AIR_GAMMA, Chamber
from .declaration import DRIVEN, EITHER, Array, Declaration, Law, Parameter, Setting, Values

HOLD = ("pressure_hold",)
# Pressure outside over that inside below which flow through a hole grows no more.
CHOKED = (2 / (AIR_GAMMA + 1)) ** (AIR_GAMMA / (AIR_GAMMA - 1))
SEEPING = (
    Parameter("loss_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.03), "share of a small overpressure lost"),
    Parameter(
        "inertia",
        "",
        0.0,
        3000.0,
        0.0,
        (0.0, 1.0, 100.0),
        "of the flow, after Forchheimer; 0 is laminar, a hole has hundreds",
    ),
)
UNTIL_TIGHT = (
    Parameter("loss_until_tight_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.01), "as long as it lasts"),
    Parameter("tight_s", "s", 0.5, 3600.0, 60.0, (30.0, 100.0), "when a seal or a valve has closed"),
)
ABOVE = (
    Parameter("loss_above_per_s", "1/s", 0.0, 0.5, 0.0, (1e-3, 0.01), "of the excess over it"),
    Parameter("opens_kPa", "kPa", 0.0, 1000.0, 0.0, (30.0, 100.0), "relief valves, seams that part"),
)
Flow = Callable[[float], float]
"""Rate in 1/s, of the gas of the chamber at one atmosphere, at a pressure in atmospheres."""


def _through_the_line(p: Array, v: Values, at: Setting) -> Array:
    """The line feeds the leak: tau dp_c/dt = p - p_c - leak p_c."""
    at.fed = 1.0 + v["conductance_ratio"]
    return p / at.fed


def _lost(
    gas: Chamber, loss: float, flow: Flow, abrupt_s: float = math.inf, tight_s: float = math.inf
) -> Chamber:
    return attrs.evolve(gas, loss_per_s=loss, flow=flow, abrupt_s=abrupt_s, tight_s=tight_s)


def _seeping(loss: float, inertia: float = 0.0) -> Flow:
    """Laminar flow, with inertia after Forchheimer: nearly that of an orifice where that is large.

    With x + b x^2 = (P^2 - 1)/2 the flow is k x, so that a small overpressure falls by exp(-k t).
    """
    if not inertia:
        return lambda P: 0.5 * loss * (P * P - 1)

    def flow(P: float) -> float:
        drive = P * P - 1
        return loss * drive / (1 + math.sqrt(1 + 2 * inertia * abs(drive)))

    return flow


def _until_tight(gas: Chamber, v: Values, at: Setting) -> Chamber:
    loss = v["loss_until_tight_per_s"]
    return _lost(gas, loss, _seeping(loss), 0.0, v["tight_s"])


def _above(gas: Chamber, v: Values, at: Setting) -> Chamber:
    """Flow in proportion to the excess of a pressure over another."""
    loss, opens = v["loss_above_per_s"], 1.0 + v["opens_kPa"] / ATMOSPHERE_kPa
    return _lost(gas, loss, lambda P: loss * max(P - opens, 0.0), 0.0)


def _by_a_hole(gas: Chamber, v: Values, at: Setting) -> Chamber:
    """Isentropic flow through a hole (Saint-Venant and Wantzel)."""
    hole = v["hole_per_s"]
    one, other, scale = 2 / AIR_GAMMA, (AIR_GAMMA + 1) / AIR_GAMMA, hole * math.sqrt(2 / (AIR_GAMMA - 1))
    choked = scale * math.sqrt(CHOKED**one - CHOKED**other)

    def flow(P: float) -> float:
        high, low = (P, 1.0) if P > 1.0 else (1.0, P)
        if low < CHOKED * high:
            most = choked * high
        else:
            ratio = low / high
            most = scale * high * math.sqrt(max(ratio**one - ratio**other, 0.0))
        return most if P > 1.0 else -most

    return _lost(gas, hole, flow, 1.0 / hole)


EFFECT = Declaration(
    mechanism=(
        "leaking air flows through the line, so the chamber pressure is nearer the air's than the gauge"
    ),
    reveals="a closed valve",
    remedy="find the leak (soapy water at joints and inlet) and seal it, then measure again",
    shown_by={
        "pressure_hold": "the same hold with a plug of metal in the unit's place",
        "unit_pressure": "the valve shut at pressure: any fall is the leak",
        "pressure_step": "the valve shut after the step: any fall is the leak",
    },
    of=EITHER,
    laws=(
        Law(
            DRIVEN,
            (Parameter("conductance_ratio", "", 0.0, 1.0, 0.0, (0.1,), "of the leak over the line"),),
            {"leak": _through_the_line},
        ),
        Law(
            HOLD,
            SEEPING,
            {"gas": lambda gas, v, at: _lost(gas, v["loss_per_s"], _seeping(v["loss_per_s"], v["inertia"]))},
            "gas flows through pores or cracks, out or in, by the difference of the squared absolute "
            "pressures",
        ),
        Law(
            HOLD,
            (Parameter("hole_per_s", "1/s", 0.0, 0.2, 0.0, (3e-4, 0.01), "flow through a hole, as below"),),
            {"gas": _by_a_hole},
            "gas flows through a hole, out or in, choked where one pressure is 1.9 times the other",
        ),
        Law(
            HOLD,
            UNTIL_TIGHT,
            {"gas": _until_tight},
            "gas flows out until a seal or a valve has closed",
            refines=True,
        ),
        Law(
            HOLD,
            ABOVE,
            {"gas": _above},
            "gas flows out above a pressure at which a valve or a seam opens",
            refines=True,
        ),
    ),
)
