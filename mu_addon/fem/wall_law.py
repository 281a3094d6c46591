"""Layers of laws in a membrane's wall, as the unit's [wall] asks for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from .laws import LAWS, Friction, Layered, NeoHooke
from .materials import Layer

if TYPE_CHECKING:
    from ..design.wall_material import Wall


# Across the axis, along which a unit is printed.
LAYER_NORMAL = (0.0, 0.0, 1.0)


def wall_layers(wall: Wall, elements: Array, modulus_MPa: float, poisson: float) -> tuple[Layer, ...]:
    """Layers of laws in a wall's elements (k,), of its Young's modulus in MPa and Poisson's ratio.

    Both are of small strain: long-term for a wall that relaxes, unstretched for one that softens; a sliding
    branch is added to them. Laws: the one that the wall names, `Layered` where stiffness along and across the
    print's layers differ, `Friction` where it slides.
    """
    (mu, kappa) = NeoHooke.parameters(modulus_MPa, poisson)[0]
    added, share = layer_stiffness(1 + wall.layers_excess, mu, kappa) if wall.layers_excess else (0.0, 1.0)
    less = min(added, 0.0)
    law = LAWS[wall.law]
    row = np.array(law.row_of_wall(wall, mu + less / 2, kappa + less / 3))
    found = [_layer(law, elements, row, share)]
    if added:
        more = Layered.parameters(max(added, 0.0), -less, LAYER_NORMAL)[0]
        found.append(_layer(Layered, elements, more, share))
    if wall.friction_share:
        sliding = np.array([wall.friction_share * mu, in_MPa(wall.friction_yield_kPa)])
        found.append(_layer(Friction, elements, sliding))
    return tuple(found)


def layer_stiffness(ratio: float, shear_MPa: float, bulk_MPa: float) -> tuple[float, float]:
    """Stiffness in MPa that `Layered` adds along the layers, and its share of all.

    ratio: Young's modulus along the layers over that across, which is unchanged; shear_MPa, bulk_MPa: of the
    parallel isotropic law. For a ratio below 1 as much is added across them and taken from the isotropic
    law's shear, which is the same at small strain.
    """
    from scipy.optimize import brentq

    lame = bulk_MPa - 2 * shear_MPa / 3

    def moduli(added: float) -> tuple[float, float]:
        """Young's moduli along and across the layers."""
        stiffness = np.full((3, 3), lame) + np.diag(2 * shear_MPa + added * np.array([1.0, 1.0, 0.0]))
        compliance = np.linalg.inv(stiffness)
        return 1 / compliance[0, 0], 1 / compliance[2, 2]

    def off(added: float) -> float:
        along, across = moduli(added)
        return along / across - ratio

    added = float(brentq(off, -1.999 * shear_MPa, 1e4 * shear_MPa, xtol=1e-12 * shear_MPa))
    return added, moduli(0.0)[1] / moduli(added)[1]


def _layer(law: Any, elements: Array, row: Array, weight: float = 1.0) -> Layer:
    return Layer(law, elements, np.tile(row, (len(elements), 1)), weight)
