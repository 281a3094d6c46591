"""Neo-Hookean law."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .law import Law
from .tensors import THIRD, TWO_THIRDS, f64, mat33, mat99
from .valid import shear_and_bulk


@wp.func
def neo_hooke_energy(F: mat33, m: Any) -> wp.float64:
    J = wp.determinant(F)
    I1 = wp.pow(J, -TWO_THIRDS) * wp.ddot(F, F)
    return f64(0.5) * (m[0] * (I1 - f64(3.0)) + m[1] * (J - f64(1.0)) * (J - f64(1.0)))


@wp.func
def neo_hooke_stress(F: mat33, m: Any) -> mat33:
    J = wp.determinant(F)
    B = wp.transpose(wp.inverse(F))
    c = m[0] * wp.pow(J, -TWO_THIRDS)
    return c * (F - wp.ddot(F, F) * THIRD * B) + m[1] * (J - f64(1.0)) * J * B


@wp.func
def neo_hooke_tangent(F: mat33, m: Any) -> mat99:
    J = wp.determinant(F)
    B = wp.transpose(wp.inverse(F))
    c = m[0] * wp.pow(J, -TWO_THIRDS)
    I1 = wp.ddot(F, F)
    dev = -TWO_THIRDS * c
    vol = TWO_THIRDS * THIRD * c * I1 + m[1] * (f64(2.0) * J - f64(1.0)) * J
    rot = c * I1 * THIRD - m[1] * (J - f64(1.0)) * J
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


class NeoHooke(Law):
    """Neo-Hookean law, W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, in MPa.

    The volumetric term stays finite at J = 0, so a solver must refuse J <= 0 itself. Rubber follows it
    to stretches of about 1.5.
    """

    name = "neo-Hooke"
    parameter_names = ("mu_MPa", "kappa_MPa")
    positive = parameter_names
    example = (0.6 / 2.8, 1.0)
    wall = ""
    wall_text = "holds to stretches of about 1.5"
    fitted = (("mu_MPa", 0.0),)
    split_volume = True
    bulk = 1
    energy = staticmethod(neo_hooke_energy)
    stress = staticmethod(neo_hooke_stress)
    tangent = staticmethod(neo_hooke_tangent)

    @staticmethod
    def parameters(modulus_MPa: Any, poisson: Any) -> Array:
        """Parameters (k, 2), mu and kappa in MPa, of small-strain Young's modulus in MPa and Poisson's ratio.

        Each is a number or (k,). Raises InputError where the modulus is not positive or the ratio not between
        -1 and 0.5.
        """
        return np.stack(shear_and_bulk(NeoHooke, modulus_MPa, poisson), axis=1)
