"""Tension compression asymmetry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..unit_body import UnitEffect

if TYPE_CHECKING:
    from ...fem.materials import Materials
    from ...meshing.mesh import Mesh
from .declaration import IN_MODEL, Array, Declaration, Law, Parameter, Setting, Values

# Share of a one-sided foam on its other side: laws require more than none.
NEXT_TO_NOTHING = 1e-3
EXCESS = Parameter("excess", "", -0.8, 4.0, 0.0, (0.3,), "stiffness in compression over tension, less 1")


def _signed(stress: Array, v: Values, at: Setting) -> Array:
    return stress * np.where(at.strain < 0, 1 + v["excess"], 1.0)


def _asymmetric(materials: Materials, mesh: Mesh, excess: float) -> Materials:
    """Resin stiffer by `excess` in compression; below 0 less stiff, as if it buckled.

    A foam in parallel with the resin's law that resists only one sign of strain. For a less stiff one it
    resists tension and replaces an equal part of the law. Two such foams are the resin at small strain.
    """
    from ...fem.laws import Foam
    from ...fem.materials import Layer, Materials

    modulus, poisson = materials.small_strain(len(mesh.tets))
    both = Foam.parameters(modulus, poisson, 2.0, 2.0)
    both[:, 2 if excess < 0 else 0] *= NEXT_TO_NOTHING
    both[:, 4] /= 2
    foam = Layer(Foam, np.arange(len(mesh.tets)), both, abs(excess))
    share = min(1.0, 1.0 + excess)
    return Materials(
        (*(attrs.evolve(layer, weight=share * layer.weight) for layer in materials.layers), foam)
    )


EFFECT = Declaration(
    mechanism="the stiffness differs between tension and compression",
    reveals="pressure and vacuum",
    remedy=IN_MODEL,
    shown_by={
        "coupon": "one coupon pulled, another compressed",
    },
    laws=(Law(("coupon",), (EXCESS,), {"sign": _signed}),),
    unit=UnitEffect(
        # From the other side a fit may end in another minimum: beside it a thinner wall was named.
        attrs.evolve(EXCESS, starts=(-0.3, 0.3)),
        (-0.8, -0.4, 0.0, 0.5, 1.5, 4.0),
        materials=_asymmetric,
        first=(-0.4, 1.5),
    ),
)
