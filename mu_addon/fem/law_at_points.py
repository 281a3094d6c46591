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
    inputs, n, count = _inputs(F, rows)
    outputs = [wp.zeros(n, dtype=d, device="cpu") for d in (f64, mat33, mat99)]
    wp.launch(_kernel(law, count), n, [*inputs, *outputs], device="cpu")
    return Point(*(o.numpy() for o in outputs))


def stress(law: Any, F: Array, rows: Array) -> Array:
    """First Piola-Kirchhoff stress (n, 3, 3) in MPa alone; law, F and rows as in `evaluate`."""
    inputs, n, count = _inputs(F, rows)
    P = wp.zeros(n, dtype=mat33, device="cpu")
    wp.launch(_stress_kernel(law, count), n, [*inputs, P], device="cpu")
    return np.asarray(P.numpy())


def _inputs(F: Array, rows: Array) -> tuple[list[Any], int, int]:
    F = np.ascontiguousarray(F, float).reshape(-1, 3, 3)
    n, count = len(F), np.shape(rows)[-1]
    rows = np.ascontiguousarray(np.broadcast_to(rows, (n, count)), float)
    return [wp.array(F, dtype=mat33, device="cpu"), wp.array(rows, dtype=f64, device="cpu")], n, count


@cache
def _kernel(law: Any, count: int) -> Any:
    energy_of, stress_of, tangent_of = law.energy, law.stress, law.tangent
    vector = wp.types.vector(length=count, dtype=f64)

    @wp.kernel(module="unique")
    def kernel(
        F: wp.array(dtype=mat33),
        rows: wp.array2d(dtype=f64),
        W: wp.array(dtype=f64),
        P: wp.array(dtype=mat33),
        A: wp.array(dtype=mat99),
    ):
        i = wp.tid()
        m = vector()
        for k in range(wp.static(count)):
            m[k] = rows[i, k]
        W[i] = energy_of(F[i], m)
        P[i] = stress_of(F[i], m)
        A[i] = tangent_of(F[i], m)

    return kernel


@cache
def _stress_kernel(law: Any, count: int) -> Any:
    stress_of = law.stress
    vector = wp.types.vector(length=count, dtype=f64)

    @wp.kernel(module="unique")
    def kernel(F: wp.array(dtype=mat33), rows: wp.array2d(dtype=f64), P: wp.array(dtype=mat33)):
        i = wp.tid()
        m = vector()
        for k in range(wp.static(count)):
            m[k] = rows[i, k]
        P[i] = stress_of(F[i], m)

    return kernel
