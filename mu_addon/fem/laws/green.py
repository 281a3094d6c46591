"""Laws of the Green-Lagrange strain E = (F^T F - 1)/2."""

from __future__ import annotations

from typing import Any

import warp as wp

from .tensors import add_left, f64, mat33, mat99


def of_green_strain(energy: Any, stress: Any, stiffness: Any) -> tuple[Any, Any, Any]:
    """Energy, stress and tangent by F, Warp functions of (F, m), of a law W(E) of the Green-Lagrange strain.

    energy, stress, stiffness: Warp functions of (E, m) for W in MPa, S = dW/dE (mat33, MPa) and dS/dE (mat99,
    MPa), which must have the minor symmetries. P = F S and
    dP_iJ/dF_kL = delta_ik S_JL + F_iM F_kN dS_MJ/dE_NL.
    """

    @wp.func
    def green_energy(F: mat33, m: Any) -> wp.float64:
        return energy(green_strain(F), m)

    @wp.func
    def green_stress(F: mat33, m: Any) -> mat33:
        return F * stress(green_strain(F), m)

    @wp.func
    def green_tangent(F: mat33, m: Any) -> mat99:
        E = green_strain(F)
        D = stiffness(E, m)
        half = mat99()
        for i in range(3):
            for j in range(3):
                for c in range(9):
                    half[3 * i + j, c] = F[i, 0] * D[j, c] + F[i, 1] * D[3 + j, c] + F[i, 2] * D[6 + j, c]
        A = mat99()
        for r in range(9):
            for k in range(3):
                for n in range(3):
                    A[r, 3 * k + n] = (
                        F[k, 0] * half[r, n] + F[k, 1] * half[r, 3 + n] + F[k, 2] * half[r, 6 + n]
                    )
        return add_left(A, stress(E, m))

    return green_energy, green_stress, green_tangent


@wp.func
def green_strain(F: mat33) -> mat33:
    return f64(0.5) * (wp.transpose(F) * F - wp.identity(3, dtype=f64))


@wp.func
def symmetric_identity(factor: wp.float64) -> mat99:
    """factor times dE/dE of a symmetric E."""
    A = mat99()
    for i in range(3):
        for j in range(3):
            A[3 * i + j, 3 * i + j] += f64(0.5) * factor
            A[3 * i + j, 3 * j + i] += f64(0.5) * factor
    return A
