"""Overcure."""

from __future__ import annotations

import attrs

from ..unit_body import Body, UnitEffect
from .declaration import IN_MODEL, Data, Declaration, Law, Parameter, Setting, Values

OFFSET = Parameter(
    "offset_mm",
    "mm",
    0.0,
    0.25,
    0.0,
    (0.03, 0.1),
    "of every surface; printers cure 0.05 to 0.1 mm too far, J. Manuf. Mater. Process. 8(3) 90",
)


def _within(law: Law, data: Data) -> tuple[Law, ...]:
    """The law up to the largest offset that was computed."""
    (size,) = law.parameters
    return (attrs.evolve(law, parameters=(size.narrowed(size.low, data.largest_offset_mm),)),)


def _outward(printed: tuple[float, float], v: Values, at: Setting) -> tuple[float, float]:
    offset, excess = printed
    return offset + v["offset_mm"], excess


def _overcured(body: Body, offset_mm: float) -> Body:
    p = body.unit.print
    return body.printed(offset_xy_mm=p.offset_xy_mm + offset_mm, offset_z_mm=p.offset_z_mm + offset_mm)


EFFECT = Declaration(
    mechanism="light cures resin beyond the nominal surface, so every part is thicker",
    reveals="weighed specimens",
    remedy=f"{IN_MODEL}; print with that offset (export --compensate), or expose less",
    shown_by={
        "unit_pressure": "the wall of a unit cut open",
    },
    laws=(Law(("lattice_compression",), (OFFSET,), {"printed": _outward}, offered=_within),),
    unit=UnitEffect(
        OFFSET, (0.0, 0.06, 0.14, 0.25), body=_overcured, length=1, larger=(0.34,), first=(0.14,)
    ),
)
