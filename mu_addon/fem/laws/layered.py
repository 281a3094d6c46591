"""Anisotropy of a print's layers added to an isotropic law: stiffness along or across them, at any strain."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .green import of_green_strain
from .law import Law
from .tensors import f64, mat33, mat99, vec3
from .valid import require_unit, unit

_NORMAL = 2


@wp.func
def layered_weights(m: Any) -> mat33:
    """in_plane (1 - n n) + across n n."""
    n = vec3(m[2], m[3], m[4])
    return m[0] * wp.identity(3, dtype=f64) + (m[1] - m[0]) * wp.outer(n, n)


@wp.func
def layered_inverse(E: mat33) -> mat33:
    """Inverse of C = 1 + 2 E."""
    return wp.inverse(wp.identity(3, dtype=f64) + f64(2.0) * E)


@wp.func
def layered_energy(E: mat33, m: Any) -> wp.float64:
    # C + C^-1 - 2 = 4 E C^-1 E, which does not lose its digits at small strain.
    return f64(0.5) * wp.trace(layered_weights(m) * E * layered_inverse(E) * E)


@wp.func
def layered_stress(E: mat33, m: Any) -> mat33:
    K = layered_weights(m)
    B = layered_inverse(E)
    # (K - B K B)/4 with 1 - B = 2 E B, again for the sake of small strains.
    D = f64(2.0) * E * B
    return f64(0.25) * (K * D + wp.transpose(D) * K - wp.transpose(D) * K * D)


@wp.func
def layered_stiffness(E: mat33, m: Any) -> mat99:
    B = layered_inverse(E)
    M = B * layered_weights(m) * B
    A = mat99()
    q = f64(0.25)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for n in range(3):
                    A[3 * i + j, 3 * k + n] = q * (
                        B[i, k] * M[j, n] + B[i, n] * M[j, k] + M[i, k] * B[j, n] + M[i, n] * B[j, k]
                    )
    return A


class Layered(Law):
    """W = (K:C + K:C^-1 - 2 tr K)/8 with K = in_plane (1 - n n) + across n n, n the layers' normal.

    In parallel with an isotropic law it makes stiffness depend on direction. At small strain W = K:e^2/2; at
    large strain the energy of a stretch l along n is (l^2 + 1/l^2 - 2)/8. It stiffens in tension and
    compression and, unlike a law quadratic in Green strain, keeps its stiffness under compression. n is a
    unit vector in the undeformed body.
    """

    name = "layered"
    parameter_names = ("in_plane_MPa", "across_MPa", "normal_x", "normal_y", "normal_z")
    from_zero = parameter_names[:_NORMAL]
    example = (0.7, 0.2, *unit([1.0, 2.0, -1.0])[0])
    whole = isotropic = False
    energy, stress, tangent = map(
        staticmethod, of_green_strain(layered_energy, layered_stress, layered_stiffness)
    )

    @staticmethod
    def parameters(in_plane_MPa: Any, across_MPa: Any, normal: Any) -> Array:
        """Parameters (k, 5) of two moduli in MPa and the layers' normal, of any length.

        Moduli are numbers or (k,), normals (3,) or (k, 3).
        """
        moduli = np.stack(np.broadcast_arrays(*np.atleast_1d(in_plane_MPa, across_MPa)), axis=1)
        normals = np.broadcast_to(unit(normal), (len(moduli), 3))
        return np.hstack([moduli, normals])

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa of parameters (k, 5), averaged over directions.

        A half and a third of the mean of K's principal values.
        """
        mean = (2 * parameters[:, 0] + parameters[:, 1]) / 3
        return np.stack([mean / 2, mean / 3], axis=1)

    @classmethod
    def valid(cls, parameters: Array) -> None:
        """Raise InputError unless both moduli are 0 or more and finite and the normal is a unit vector.

        parameters: (k, 5), moduli in MPa. The normal's length may differ from 1 by 1e-9.
        """
        super().valid(parameters)
        require_unit(cls, parameters, _NORMAL)
