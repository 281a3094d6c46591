"""A law at single points: energy, stress and tangent of given deformation gradients and parameters."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from ..arrays import Array
from . import kernels  # noqa: F401 (sets Warp up)
from .laws.tensors import f64, mat33, mat99


class Point(NamedTuple):
    """Energy (n,) in MPa, first Piola-Kirchhoff stress P (n, 3, 3) in MPa and dP/dF (n, 9, 9) in MPa.

    Rows and columns of dP/dF are numbered 3 i + J.
    """

    energy: Array
    stress: Array
    tangent: Array


def evaluate(law: Any, F: Array, rows: Array) -> Point:
    """A law at F (n, 3, 3) of parameters (n, count) or one row, on the CPU.

    For a law with history a row continues with its numbers and the time step, as in `Law`.
    """
    P, W, A = _found(law, F, rows, True)
    return Point(W, P, A)


def stress(law: Any, F: Array, rows: Array) -> Array:
    """First Piola-Kirchhoff stress (n, 3, 3) in MPa alone; law, F and rows as in `evaluate`."""
    return _found(law, F, rows, False)[0]


def _found(law: Any, F: Array, rows: Array, whole: bool) -> list[Array]:
    """Stress; energy and tangent, too, where they are asked for."""
    F = np.ascontiguousarray(F, float).reshape(-1, 3, 3)
    n, count = len(F), np.shape(rows)[-1]
    rows = np.ascontiguousarray(np.broadcast_to(rows, (n, count)), float)
    inputs = [wp.array(F, dtype=mat33, device="cpu"), wp.array(rows, dtype=f64, device="cpu")]
    sizes = ((n, mat33), (n * whole, f64), (n * whole, mat99))
    found = [wp.zeros(size, dtype=kind, device="cpu") for size, kind in sizes]
    wp.launch(_kernel(law, count, whole), n, [*inputs, *found], device="cpu")
    return [np.asarray(one.numpy()) for one in found]


@cache
def _kernel(law: Any, count: int, whole: bool) -> Any:
    energy_of, stress_of, tangent_of = law.energy, law.stress, law.tangent
    vector = wp.types.vector(length=count, dtype=f64)

    @wp.kernel(module="unique")
    def kernel(
        F: wp.array(dtype=mat33),
        rows: wp.array2d(dtype=f64),
        P: wp.array(dtype=mat33),
        W: wp.array(dtype=f64),
        A: wp.array(dtype=mat99),
    ):
        i = wp.tid()
        m = vector()
        for k in range(wp.static(count)):
            m[k] = rows[i, k]
        P[i] = stress_of(F[i], m)
        if wp.static(whole):
            W[i] = energy_of(F[i], m)
            A[i] = tangent_of(F[i], m)

    return kernel
