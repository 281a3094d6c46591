"""Stretch of struts along the diagonals of a cell, whose lengths hardly change."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .green import of_green_strain
from .law import Law
from .tensors import add_dyad, f64, mat33, mat99


@wp.func
def diagonal_energy(E: mat33, m: Any) -> wp.float64:
    return f64(0.5) * m[0] * wp.trace(E) * wp.trace(E)


@wp.func
def diagonal_stress(E: mat33, m: Any) -> mat33:
    return m[0] * wp.trace(E) * wp.identity(3, dtype=f64)


@wp.func
def diagonal_stiffness(E: mat33, m: Any) -> mat99:
    one = wp.identity(3, dtype=f64)
    return add_dyad(mat99(), m[0], one, one)


class DiagonalStretch(Law):
    """W(E) = C/2 (tr E)^2, where tr E/3 is the mean Green strain along the four diagonals of a cube.

    It resists changes of length of the struts from a cell's centre to its corners, but not deformations that
    keep the sum of squared stretches. The volume may shrink under tension and compression, as in a
    body-centred lattice. In parallel with CubicShear of G = C it is four springs along the diagonals. C adds
    to C11 and C12. Under compression from all sides the springs buckle: a companion with shear modulus mu
    keeps the body elliptic up to a trace of about -mu/C.
    """

    name = "diagonal stretch"
    parameter_names = ("C_MPa",)
    from_zero = parameter_names
    example = (0.5,)
    whole = False
    energy, stress, tangent = map(
        staticmethod, of_green_strain(diagonal_energy, diagonal_stress, diagonal_stiffness)
    )

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa of parameters (k, 1): 0 and C."""
        C = parameters[:, 0]
        return np.stack([np.zeros_like(C), C], axis=1)
