"""Wall thickness."""

import attrs

from ..unit_body import Body, UnitEffect
from .declaration import IN_MODEL, Declaration, Parameter


def _thickened(body: Body, factor: float) -> Body:
    chambers = attrs.evolve(body.unit.chambers, wall_mm=factor * body.unit.chambers.wall_mm)
    return attrs.evolve(body, unit=attrs.evolve(body.unit, chambers=chambers), drawn=body.unit)


EFFECT = Declaration(
    mechanism="the chamber wall is thicker or thinner than nominal",
    reveals="a section, or the mass",
    remedy=f"{IN_MODEL}; cut one unit and measure its wall",
    shown_by={
        "unit_pressure": "the wall of a unit cut open",
    },
    unit=UnitEffect(
        Parameter("factor", "", 0.8, 1.3, 1.0, (0.95, 1.05), "assumed: printers miss it by a fifth at most"),
        (0.8, 0.9, 1.0, 1.15, 1.3),
        body=_thickened,
        first=(0.8, 1.3),
    ),
)
