"""Gravity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..unit_body import Body, UnitEffect

if TYPE_CHECKING:
    from ...meshing.mesh import Mesh
from .declaration import ALL, IN_MODEL, Array, Declaration, Law, Parameter, Setting, Values

G = 9.80665
"""Of the earth, in m/s2."""
TONNE_PER_MM3 = 1e-12  # in kg/m3
DENSITY = Parameter(
    "density_kg_m3",
    "kg/m3",
    0.0,
    4000.0,
    0.0,
    (1000.0,),
    "elastomers 950 to 1300, filled ones 1800",
    plausible=(0.0, 2000.0),
)


def _weighed(beam: Mapping[str, Any], v: Values, at: Setting) -> Mapping[str, Any]:
    # kg/m3 is 1e-9 kg/mm3.
    weight = 1e-9 * G * v["density_kg_m3"] * at.width_mm * at.thickness_mm * at.length_mm
    return {**beam, "weight": weight * at.length_mm**2 / at.bending}


def _weight(body: Body, mesh: Mesh, density_kg_m3: float) -> Array:
    from ...fem.dead_loads import gravity

    return gravity(mesh, np.full(len(mesh.tets), density_kg_m3 * TONNE_PER_MM3), body.down)


EFFECT = Declaration(
    mechanism="weight bends the unit",
    reveals="one protocol in three orientations",
    remedy=f"{IN_MODEL}, and give the direction in which the unit hangs by --orientation",
    shown_by={
        "unit_pressure": "one protocol in three orientations",
        "beam_deadweight": "the beam upside down",
        "unit_pose": "a full turn about x at two pressures",
    },
    of=ALL,
    laws=(Law(("beam_deadweight",), (DENSITY,), {"beam": _weighed}, "the beam bends under its weight"),),
    unit=UnitEffect(
        DENSITY,
        (0.0, 1300.0, 4000.0),
        load=_weight,
        has_gravity=True,
        length=-1,
        larger=(6000.0, 9000.0),
        first=(1300.0,),
    ),
)
