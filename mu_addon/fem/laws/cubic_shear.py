"""Shear stiffness along fixed axes, for a lattice whose struts shear resists and stretch does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .green import of_green_strain, symmetric_identity
from .law import Law
from .tensors import f64, mat33, mat99


@wp.func
def cubic_shear_energy(E: mat33, m: Any) -> wp.float64:
    return f64(2.0) * m[0] * (E[0, 1] * E[0, 1] + E[1, 2] * E[1, 2] + E[2, 0] * E[2, 0])


@wp.func
def cubic_shear_stress(E: mat33, m: Any) -> mat33:
    S = f64(2.0) * m[0] * E
    for a in range(3):
        S[a, a] = f64(0.0)
    return S


@wp.func
def cubic_shear_stiffness(E: mat33, m: Any) -> mat99:
    D = symmetric_identity(f64(2.0) * m[0])
    for a in range(3):
        D[4 * a, 4 * a] = f64(0.0)
    return D


class CubicShear(Law):
    """W(E) = 2 G (Exy^2 + Eyz^2 + Ezx^2): resists shear between the axes x, y, z, and no stretch along them.

    It acts in parallel with a law for the stretches, such as Foam: the whole's C44 is the sum of their shear
    moduli. The energy is in the squared cosine between two axes' images and therefore never negative. But
    shear compresses the diagonals across it: a parallel law with shear modulus mu keeps the body elliptic up
    to a shear of about mu/G.
    """

    name = "cubic shear"
    parameter_names = ("G_MPa",)
    from_zero = parameter_names
    example = (0.7,)
    whole = isotropic = False
    energy, stress, tangent = map(
        staticmethod, of_green_strain(cubic_shear_energy, cubic_shear_stress, cubic_shear_stiffness)
    )

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa of parameters (k, 1).

        3/5 of G, its mean over directions, and 0.
        """
        G = parameters[:, 0]
        return np.stack([0.6 * G, np.zeros_like(G)], axis=1)
