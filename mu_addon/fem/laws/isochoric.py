"""The split of a law into a part without change of volume and kappa/2 (J - 1)^2.

Source: Flory, Trans. Faraday Soc. 57 (1961) 829.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from .tensors import THIRD, add_dyad, add_swapped, contract, f64, isochoric, mat33, mat99


def split(energy: Any, stress: Any, tangent: Any, bulk: int | None) -> tuple[Any, Any, Any]:
    """Energy, stress and tangent of W(J^(-1/3) F) + kappa/2 (J - 1)^2, of those of W(F).

    bulk: which of the parameters is kappa; None leaves the volumetric term out.
    """
    number = -1 if bulk is None else bulk

    @wp.func
    def kappa(m: Any):
        k = f64(0.0)
        if wp.static(number >= 0):
            k = m[wp.static(max(number, 0))]
        return k

    @wp.func
    def split_energy(F: mat33, m: Any) -> wp.float64:
        J = wp.determinant(F)
        return energy(isochoric(F), m) + f64(0.5) * kappa(m) * (J - f64(1.0)) * (J - f64(1.0))

    @wp.func
    def split_stress(F: mat33, m: Any) -> mat33:
        J = wp.determinant(F)
        j = wp.pow(J, -THIRD)
        F_ = j * F
        B_ = wp.transpose(wp.inverse(F_))
        P_ = stress(F_, m)
        return j * (P_ + (kappa(m) * (J - f64(1.0)) * J - THIRD * wp.ddot(P_, F_)) * B_)

    @wp.func
    def split_tangent(F: mat33, m: Any) -> mat99:
        J = wp.determinant(F)
        j = wp.pow(J, -THIRD)
        F_ = j * F
        B_ = wp.transpose(wp.inverse(F_))
        P_ = stress(F_, m)
        A = tangent(F_, m)
        AF = contract(A, F_)
        X = -THIRD * (AF + P_)
        trace = wp.ddot(P_, F_)
        k = kappa(m)
        both = THIRD * THIRD * (wp.ddot(F_, AF) + trace) + k * (f64(2.0) * J - f64(1.0)) * J
        A = add_dyad(A, f64(1.0), X, B_)
        A = add_dyad(A, f64(1.0), B_, X + both * B_)
        A = add_swapped(A, THIRD * trace - k * (J - f64(1.0)) * J, B_, B_)
        return (j * j) * A

    return split_energy, split_stress, split_tangent
