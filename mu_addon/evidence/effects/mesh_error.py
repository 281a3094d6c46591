"""Mesh error."""

import attrs

from ..unit_body import Body, UnitEffect
from .declaration import ALL, Declaration, Parameter


def _refined(body: Body, share: float) -> Body:
    return attrs.evolve(body, mesh=body.finer) if share else body


EFFECT = Declaration(
    mechanism="the mesh of the model is too coarse",
    reveals="the same simulation on a finer mesh",
    remedy="simulate with a finer mesh, --refine",
    of=ALL,
    unit=UnitEffect(
        Parameter("share", "", 0.0, 2.0, 0.0, (1.0,), "1: the finer mesh; beyond: the way further on"),
        (0.0, 1.0),
        body=_refined,
        first=(1.0,),
    ),
)
