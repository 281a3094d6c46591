"""Leak."""

from .declaration import EITHER, Declaration

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
)
