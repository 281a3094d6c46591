"""Isotropic laws of the principal stretches.

With C = sum of x_a N_a (x) N_a, x = stretch^2, the second Piola-Kirchhoff stress is the sum of s_a N_a (x)
N_a. Its derivative needs (s_b - s_a)/(x_b - x_a). A law gives this in a form that is exact also for two equal
stretches; then stress and tangent are exact there, too.
"""

from __future__ import annotations

from typing import Any

import warp as wp

from .tensors import add_dyad, add_left, f64, mat33, mat99, vec3


@wp.func
def power_difference(a: wp.float64, b: wp.float64, r: wp.float64) -> wp.float64:
    """(b^2r - a^2r)/(b^2 - a^2) of stretches a and b, by sinh(r t)/sinh(t) with t = log(b/a)."""
    t = wp.log(b / a)
    ratio = f64(0.0)
    if wp.abs(t) > f64(1.0e-3):
        ratio = wp.sinh(r * t) / wp.sinh(t)
    else:
        # The first three terms of its series: the rest is below rounding.
        s = (r * r - f64(1.0)) * t * t / f64(6.0)
        ratio = r * (f64(1.0) + s * (f64(1.0) + (f64(3.0) * r * r - f64(7.0)) * t * t / f64(60.0)))
    return wp.pow(a * b, r - f64(1.0)) * ratio


def of_stretches(energy: Any, stress: Any, slope: Any, difference: Any) -> tuple[Any, Any, Any]:
    """Energy, stress and tangent by F, Warp functions of (F, m), of a law in principal stretches.

    Arguments are Warp functions of (stretches, m), in MPa: energy: W; stress: s_a = dW/d(stretch_a)/stretch_a
    (vec3); slope: ds_a/dx_b (mat33), x = stretch^2; difference: (s_b - s_a)/(x_b - x_a) for the pairs 01, 12,
    20 (vec3).
    """

    @wp.func
    def stretches(x: vec3) -> vec3:
        return vec3(wp.sqrt(x[0]), wp.sqrt(x[1]), wp.sqrt(x[2]))

    @wp.func
    def stretch_energy(F: mat33, m: Any) -> wp.float64:
        _, x = wp.eig3(wp.transpose(F) * F)
        return energy(stretches(x), m)

    @wp.func
    def stretch_stress(F: mat33, m: Any) -> mat33:
        N, x = wp.eig3(wp.transpose(F) * F)
        return F * N * wp.diag(stress(stretches(x), m)) * wp.transpose(N)

    @wp.func
    def stretch_tangent(F: mat33, m: Any) -> mat99:
        N, x = wp.eig3(wp.transpose(F) * F)
        lengths = stretches(x)
        s = stress(lengths, m)
        ds = slope(lengths, m)
        g = difference(lengths, m)
        A = add_left(mat99(), N * wp.diag(s) * wp.transpose(N))
        f = F * N
        for a in range(3):
            M = mat33()
            for b in range(3):
                M += (f64(2.0) * ds[a, b]) * wp.outer(dyad_column(f, b), dyad_column(N, b))
            A = add_dyad(A, f64(1.0), wp.outer(dyad_column(f, a), dyad_column(N, a)), M)
            c = (a + 1) % 3
            Z = wp.outer(dyad_column(f, a), dyad_column(N, c)) + wp.outer(
                dyad_column(f, c), dyad_column(N, a)
            )
            A = add_dyad(A, g[a], Z, Z)
        return A

    return stretch_energy, stretch_stress, stretch_tangent


@wp.func
def dyad_column(M: mat33, a: int) -> vec3:
    return vec3(M[0, a], M[1, a], M[2, a])
