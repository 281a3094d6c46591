"""Strain energies: each law gives energy, first Piola-Kirchhoff stress and tangent by F."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import warp as wp

Array = np.ndarray[Any, Any]

mat33 = wp.mat33d
mat99 = wp.types.matrix(shape=(9, 9), dtype=wp.float64)
parameters = wp.types.vector(length=2, dtype=wp.float64)


# Written as an expression inside a kernel, 2/3 would be rounded to single precision.
TWO_THIRDS = wp.constant(wp.float64(2 / 3))


@wp.func
def neo_hooke_energy(F: mat33, m: parameters) -> wp.float64:
    J = wp.determinant(F)
    I1 = wp.pow(J, -TWO_THIRDS) * wp.ddot(F, F)
    return wp.float64(0.5) * (
        m[0] * (I1 - wp.float64(3.0)) + m[1] * (J - wp.float64(1.0)) * (J - wp.float64(1.0))
    )


@wp.func
def neo_hooke_stress(F: mat33, m: parameters) -> mat33:
    J = wp.determinant(F)
    B = wp.transpose(wp.inverse(F))
    c = m[0] * wp.pow(J, -TWO_THIRDS)
    return c * (F - wp.ddot(F, F) / wp.float64(3.0) * B) + m[1] * (J - wp.float64(1.0)) * J * B


@wp.func
def neo_hooke_tangent(F: mat33, m: parameters) -> mat99:
    J = wp.determinant(F)
    B = wp.transpose(wp.inverse(F))
    c = m[0] * wp.pow(J, -TWO_THIRDS)
    I1 = wp.ddot(F, F)
    dev = -TWO_THIRDS * c
    vol = TWO_THIRDS / wp.float64(3.0) * c * I1 + m[1] * (wp.float64(2.0) * J - wp.float64(1.0)) * J
    rot = c * I1 / wp.float64(3.0) - m[1] * (J - wp.float64(1.0)) * J
    A = mat99()
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for n in range(3):
                    a = dev * (F[i, j] * B[k, n] + B[i, j] * F[k, n])
                    a += vol * B[i, j] * B[k, n] + rot * B[i, n] * B[k, j]
                    if i == k and j == n:
                        a += c
                    A[3 * i + j, 3 * k + n] = a
    return A


@attrs.frozen
class NeoHooke:
    """Neo-Hookean law, W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, in MPa.

    The volumetric term stays finite at J = 0, so a solver must refuse J <= 0 itself.
    """

    name = "neo-Hooke"
    energy = staticmethod(neo_hooke_energy)
    stress = staticmethod(neo_hooke_stress)
    tangent = staticmethod(neo_hooke_tangent)

    @staticmethod
    def parameters(modulus_MPa: Array, poisson: Array) -> Array:
        """Shear and bulk modulus (m, 2) in MPa of small-strain Young's modulus and Poisson's ratio (m,)."""
        mu = modulus_MPa / (2 * (1 + poisson))
        kappa = modulus_MPa / (3 * (1 - 2 * poisson))
        return np.stack([mu, kappa], axis=1)
