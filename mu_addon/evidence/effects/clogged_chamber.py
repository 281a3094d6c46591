"""Clogged chamber."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import InputError
from ..unit_body import Body, UnitEffect

if TYPE_CHECKING:
    from ...fem.model import Model
    from ...meshing.mesh import Mesh
from .declaration import Declaration, Parameter


def _clogged(body: Body, mesh: Mesh, share_lost: float) -> Model:
    from ...fem.clogged import CloggedModel

    d = body.unit.printed
    if not 0 < body.distal < d.count:
        raise InputError(
            f"{body.distal} of {d.count} chambers cannot be cut off", "clogged_chamber", "give 1 or more"
        )
    return CloggedModel(mesh, (d.count - body.distal) * d.cell, share_lost, device=body.device, threads=1)


EFFECT = Declaration(
    mechanism="one chamber receives less pressure than the others",
    reveals="markers along the unit",
    remedy="drain and clean the unit, and look for cured resin in its necks; print with drains",
    unit=UnitEffect(
        Parameter("share_lost", "", 0.0, 1.0, 0.0, (0.1, 0.5), "of the pressure, in the last chambers"),
        (0.0, 0.3, 0.65, 1.0),
        model=_clogged,
        first=(0.65,),
    ),
)
