"""Anisotropy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..unit_body import UnitEffect

if TYPE_CHECKING:
    from ...fem.materials import Materials
    from ...meshing.mesh import Mesh
from .declaration import IN_MODEL, MACHINE, Declaration, Law, Parameter, Setting, Values

# One for x and y alike: with one each, an axis left out could not be predicted from the others.
IN_PLANE = Parameter("in_plane", "", -0.9, 9.0, 0.0, (-0.3, 0.5), "modulus along x and y over z's, less 1")


def _across(stiffness: float, v: Values, at: Setting) -> float:
    return stiffness * (1 + v["in_plane"]) if at.experiment.axis in ("x", "y") else stiffness


def _layered(materials: Materials, mesh: Mesh, in_plane: float) -> Materials:
    """The resin stiffer along the print's layers, which lie across the axis."""
    from ...fem.laws import Layered
    from ...fem.materials import Layer, Materials
    from ...fem.wall_law import LAYER_NORMAL, layer_stiffness

    layered: list[Layer] = []
    for layer in materials.layers:
        # The unit's resin is neo-Hookean, alike everywhere but for its skin, which is only stiffer.
        shear, bulk = layer.parameters[0]
        added, share = layer_stiffness(1 + in_plane, float(shear), float(bulk))
        less = min(added, 0.0)
        base = layer.parameters[0] + np.array([less / 2, less / 3])
        more = Layered.parameters(max(added, 0.0), -less, LAYER_NORMAL)
        weight = share * layer.weight * (layer.parameters[:, 0] / shear)
        for law, row in ((layer.law, base), (Layered, more)):
            layered.append(Layer(law, layer.elements, np.tile(row, (len(layer.elements), 1)), weight))
    return Materials(tuple(layered))


EFFECT = Declaration(
    mechanism="layers make the modulus depend on direction",
    reveals="specimens printed along x, y and z",
    remedy=f"{IN_MODEL}; print all parts the same way, or along another direction",
    laws=(Law(MACHINE, (IN_PLANE,), {"stiffness": _across}),),
    unit=UnitEffect(
        attrs.evolve(IN_PLANE, low=-0.6, high=3.0, starts=(-0.3, 0.3)),
        (-0.6, -0.3, 0.0, 0.5, 1.3, 3.0),
        materials=_layered,
        first=(-0.3, 1.3),
    ),
)
