"""Laws of the first two invariants of C = F^T F."""

from __future__ import annotations

from typing import Any

import warp as wp

from .tensors import add_dyad, add_left, add_swapped, f64, mat33, mat99

# Derivatives by I1, I2 and, twice, by I1 I1, I1 I2, I2 I2.
slopes = wp.types.vector(length=5, dtype=wp.float64)


def of_invariants(energy: Any, slope: Any) -> tuple[Any, Any, Any]:
    """Energy, stress and tangent by F, Warp functions of (F, m), of a law W(I1, I2).

    energy, slope: Warp functions of (I1, I2, m) for W in MPa and its five derivatives, `slopes`. I1 = tr C,
    I2 = (tr(C)^2 - tr(C^2))/2; dI1/dF = 2 F, dI2/dF = 2 (I1 F - F C).
    """

    @wp.func
    def second(C: mat33) -> wp.float64:
        return f64(0.5) * (wp.trace(C) * wp.trace(C) - wp.ddot(C, C))

    @wp.func
    def invariant_energy(F: mat33, m: Any) -> wp.float64:
        C = wp.transpose(F) * F
        return energy(wp.trace(C), second(C), m)

    @wp.func
    def invariant_stress(F: mat33, m: Any) -> mat33:
        C = wp.transpose(F) * F
        w = slope(wp.trace(C), second(C), m)
        return f64(2.0) * (w[0] * F + w[1] * (wp.trace(C) * F - F * C))

    @wp.func
    def invariant_tangent(F: mat33, m: Any) -> mat99:
        C = wp.transpose(F) * F
        b = F * wp.transpose(F)
        I1 = wp.trace(C)
        w = slope(I1, second(C), m)
        D = I1 * F - F * C
        one = wp.identity(3, dtype=f64)
        two = f64(2.0)
        A = add_left(mat99(), two * (w[0] + w[1] * I1) * one - two * w[1] * C)
        A = add_dyad(A, two, F, (two * w[2] + two * w[1]) * F + two * w[3] * D)
        A = add_dyad(A, f64(4.0), D, w[3] * F + w[4] * D)
        A = add_swapped(A, -two * w[1], F, F)
        # b_ik delta_JL is what `add_left` is, with the pairs exchanged.
        for i in range(3):
            for k in range(3):
                for j in range(3):
                    A[3 * i + j, 3 * k + j] -= two * w[1] * b[i, k]
        return A

    return invariant_energy, invariant_stress, invariant_tangent
