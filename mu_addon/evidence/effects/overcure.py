"""Overcure."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="light cures resin beyond the nominal surface, so every part is thicker",
    reveals="weighed specimens",
    remedy=f"{IN_MODEL}; print with that offset (export --compensate), or expose less",
    shown_by={
        "unit_pressure": "the wall of a unit cut open",
    },
)
