"""Strain stiffening."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..stretching import first_invariant, ogden, yeoh
from ..unit_body import UnitEffect

if TYPE_CHECKING:
    from ...fem.materials import Materials
    from ...meshing.mesh import Mesh
from .declaration import IN_MODEL, Array, Declaration, Law, Parameter, Setting, Values

YEOH = Parameter(
    "c2_over_c1", "", -0.03, 2.0, 0.0, (0.02, 0.3), "Yeoh 1993: -0.01 of filled rubber to 1 of foams"
)
# W' = c1 (1 + q s (I1 - 3))^(1/q): Yeoh's two terms at q = 1, Fung's and Demiray's exponential at 0, Gent's
# limit of I1 at -1; Knowles, Int. J. Fracture 13 (1977) 611.
POWER = (
    Parameter(
        "by_invariant", "", -0.03, 3.0, 0.0, (0.05, 0.3), "slope of W' over c1; Gent's: 1 over his limit"
    ),
    Parameter("form", "", -2.0, 2.0, 1.0, (1.0, -1.0), "1 Yeoh 1993, 0 Demiray 1972, -1 Gent 1996"),
)
# A term of Ogden's beside the neo-Hookean one: Ogden, Proc. R. Soc. A 326 (1972) 565.
OGDEN = (
    Parameter("by_stretch", "", 0.0, 5.0, 0.0, (0.2,), "modulus of the term over the neo-Hookean one's"),
    Parameter("stretch_power", "", 2.5, 20.0, 6.0, (6.0,), "Ogden 1972: 5.0 of rubber"),
)
CLOSING = (
    Parameter(
        "closing",
        "",
        -5.0,
        2.4,
        0.0,
        (-1.0, 1.0),
        "1 over the strain at which cells have closed; below 0 struts buckle",
    ),
)
BUCKLING = (
    Parameter("at_tenth", "", -20.0, 0.95, 0.0, (-0.1, 0.1), "change of 1 over the stiffness at 10 %"),
    Parameter("order", "", 0.3, 6.0, 1.0, (1.0, 2.0), "1 where cells close, 2 where struts buckle"),
)


def _yeoh(stress: Array, v: Values, at: Setting) -> Array:
    return yeoh(at.modulus_kPa / 6, v["c2_over_c1"], at.mode, 1 + at.strain)


def _power(stress: Array, v: Values, at: Setting) -> Array:
    """Held constant where it would be without bound."""
    form = v["form"]
    x = v["by_invariant"] * (first_invariant(at.mode, 1 + at.strain) - 3)
    if abs(form) >= 1e-6:
        x = np.log1p(np.maximum(form * x, -0.98)) / form
    return stress * np.exp(np.minimum(x, 20.0))


def _ogden(stress: Array, v: Values, at: Setting) -> Array:
    return stress + v["by_stretch"] * ogden(at.modulus_kPa, v["stretch_power"], at.mode, 1 + at.strain)


def _closing(stress: Array, v: Values, at: Setting) -> Array:
    # Slope 1 at first; a strain near 1/closing would be beyond the last gap between struts.
    return stress / np.maximum(1 - v["closing"] * at.strain, 0.02)


def _buckling(stress: Array, v: Values, at: Setting) -> Array:
    return stress / np.maximum(1 - v["at_tenth"] * (10.0 * np.abs(at.strain)) ** v["order"], 0.02)


def _bent(beam: Mapping[str, Any], v: Values, at: Setting) -> Mapping[str, Any]:
    # c2 (I1 - 3)^2 adds 6 c2/c1 e^2 to the modulus, and 3/20 of that at the faces to the moment.
    return {**beam, "stiffening": 0.9 * v["c2_over_c1"] * (at.thickness_mm / at.length_mm) ** 2}


def _stiffening(materials: Materials, mesh: Mesh, c2_over_c1: float) -> Materials:
    from ...fem.laws import NeoHooke, Yeoh
    from ...fem.materials import Layer, Materials

    stiffer = []
    for layer in materials.layers:
        if layer.law is not NeoHooke:
            # The law that makes its layers differ stays proportional to stretch.
            stiffer.append(layer)
            continue
        # The unit's resin is neo-Hookean, which is Yeoh's law with c1 = mu/2 alone.
        mu, kappa = layer.parameters.T
        c1 = mu / 2
        rows = np.stack([c1, c2_over_c1 * c1, np.zeros_like(c1), kappa], axis=1)
        stiffer.append(Layer(Yeoh, layer.elements, rows, layer.weight))
    return Materials(tuple(stiffer))


EFFECT = Declaration(
    mechanism="the material stiffens at large stretch",
    reveals="an amplitude ladder to full pressure",
    remedy=IN_MODEL,
    shown_by={
        "coupon": "a test to a larger stretch",
        "beam_deadweight": "larger weights",
    },
    laws=(
        Law(("coupon",), (YEOH,), {"law": _yeoh}),
        Law(("coupon",), POWER, {"law": _power}, refines=True),
        Law(("coupon",), OGDEN, {"law": _ogden}, refines=True),
        Law(("beam_deadweight",), (YEOH,), {"beam": _bent}),
        Law(
            ("lattice_compression",),
            CLOSING,
            {"law": _closing},
            "cells close or struts buckle, so the stiffness changes with strain",
        ),
        Law(
            ("lattice_compression",),
            BUCKLING,
            {"law": _buckling},
            "cells close or struts buckle, so the stiffness changes with strain",
            refines=True,
        ),
    ),
    unit=UnitEffect(YEOH, (-0.03, 0.0, 0.1, 0.4, 1.0, 2.0), materials=_stiffening, first=(1.0,)),
)
