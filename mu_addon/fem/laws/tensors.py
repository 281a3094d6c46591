"""Tensors as Warp has them: F and P as 3 x 3, dP/dF as 9 x 9 with rows and columns 3 i + J."""

from __future__ import annotations

from typing import Any

import warp as wp

f64 = wp.float64
vec3 = wp.vec3d
mat33 = wp.mat33d
mat99 = wp.types.matrix(shape=(9, 9), dtype=wp.float64)

# Written as an expression inside a kernel, 2/3 would be rounded to single precision.
THIRD = wp.constant(f64(1 / 3))
TWO_THIRDS = wp.constant(f64(2 / 3))


@wp.func
def contract(A: mat99, X: mat33) -> mat33:
    """A : X, the sum over A's columns."""
    out = mat33()
    for i in range(3):
        for j in range(3):
            total = f64(0.0)
            for k in range(3):
                for n in range(3):
                    total += A[3 * i + j, 3 * k + n] * X[k, n]
            out[i, j] = total
    return out


@wp.func
def add_dyad(A: mat99, factor: wp.float64, X: mat33, Y: mat33) -> mat99:
    """A + factor X (x) Y."""
    for i in range(3):
        for j in range(3):
            x = factor * X[i, j]
            for k in range(3):
                for n in range(3):
                    A[3 * i + j, 3 * k + n] += x * Y[k, n]
    return A


@wp.func
def add_swapped(A: mat99, factor: wp.float64, X: mat33, Y: mat33) -> mat99:
    """A + factor times the tensor X_iL Y_kJ."""
    for i in range(3):
        for n in range(3):
            x = factor * X[i, n]
            for k in range(3):
                for j in range(3):
                    A[3 * i + j, 3 * k + n] += x * Y[k, j]
    return A


@wp.func
def add_left(A: mat99, S: mat33) -> mat99:
    """A + the tensor delta_ik S_JL, the contribution of a fixed second Piola-Kirchhoff stress."""
    for i in range(3):
        for j in range(3):
            for n in range(3):
                A[3 * i + j, 3 * i + n] += S[j, n]
    return A


@wp.func
def symmetric_at(m: Any, first: int) -> mat33:
    """The symmetric tensor kept as 6 numbers 00, 11, 22, 01, 12, 02 from `first` on."""
    a, b, c = m[first], m[first + 1], m[first + 2]
    d, e, f = m[first + 3], m[first + 4], m[first + 5]
    return mat33(a, d, f, d, b, e, f, e, c)


@wp.func
def isochoric(F: mat33) -> mat33:
    """F without its change of volume."""
    return wp.pow(wp.determinant(F), -THIRD) * F


@wp.func
def put_symmetric(m: Any, first: int, T: mat33) -> Any:
    """m with a symmetric tensor's 6 numbers written from `first` on, as `symmetric_at` reads them."""
    for a in range(3):
        m[first + a] = T[a, a]
    m[first + 3] = T[0, 1]
    m[first + 4] = T[1, 2]
    m[first + 5] = T[0, 2]
    return m
