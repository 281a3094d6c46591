"""Warp kernels of conjugate gradients for many systems side by side: vectors are (k, n), a row a system."""

from functools import cache
from typing import Any

import warp as wp

f64 = wp.float64


@cache
def product_kernel(width: int) -> Any:
    """Warp kernel of y = A x of a sparse matrix for `width` systems a thread.

    A matrix row is read once for all of them.
    """
    vector = wp.types.vector(length=width, dtype=f64)

    @wp.kernel(module="unique")
    def product(
        offsets: wp.array(dtype=int),
        columns: wp.array(dtype=int),
        values: wp.array(dtype=f64),
        x: wp.array2d(dtype=f64),
        y: wp.array2d(dtype=f64),
    ):
        group, row = wp.tid()
        # Past the last system a thread computes that one again.
        last = x.shape[0] - 1
        total = vector()
        for at in range(offsets[row], offsets[row + 1]):
            a = values[at]
            column = columns[at]
            for j in range(width):
                total[j] += a * x[wp.min(group * width + j, last), column]
        for j in range(width):
            y[wp.min(group * width + j, last), row] = total[j]

    return product


@wp.kernel
def pick(index: wp.array(dtype=int), values: wp.array(dtype=f64), out: wp.array(dtype=f64)):
    """Entries of an array by index."""
    i = wp.tid()
    out[i] = values[index[i]]


@wp.kernel
def step_length(
    squared: wp.array2d(dtype=f64),
    goal: wp.array2d(dtype=f64),
    descent: wp.array2d(dtype=f64),
    curvature: wp.array2d(dtype=f64),
    lost: wp.array(dtype=int),
    length: wp.array(dtype=f64),
):
    """Length of each system's step: none at its goal, none more where the curvature is not positive."""
    s = wp.tid()
    length[s] = f64(0.0)
    if squared[s, 0] <= goal[s, 0] or lost[s] == 1:
        return
    if curvature[s, 0] > f64(0.0):
        length[s] = descent[s, 0] / curvature[s, 0]
    else:
        lost[s] = 1


@wp.kernel
def advance(
    length: wp.array(dtype=f64),
    p: wp.array2d(dtype=f64),
    Ap: wp.array2d(dtype=f64),
    x: wp.array2d(dtype=f64),
    r: wp.array2d(dtype=f64),
):
    """Go along the direction p: the solution x and the residual r."""
    s, i = wp.tid()
    x[s, i] = x[s, i] + length[s] * p[s, i]
    r[s, i] = r[s, i] - length[s] * Ap[s, i]


@wp.kernel
def turn(
    length: wp.array(dtype=f64),
    descent: wp.array2d(dtype=f64),
    before: wp.array2d(dtype=f64),
    z: wp.array2d(dtype=f64),
    p: wp.array2d(dtype=f64),
):
    """The next direction, conjugate to those before it."""
    s, i = wp.tid()
    share = f64(0.0)
    if length[s] > f64(0.0):
        share = descent[s, 0] / before[s, 0]
    p[s, i] = z[s, i] + share * p[s, i]
