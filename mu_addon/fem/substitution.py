"""Warp kernels of triangular substitution with many right-hand sides."""

from functools import cache
from typing import Any

import warp as wp

# Columns with the same rows below them that are treated as one: a row of x is then read once for four.
COLUMNS = wp.constant(4)


@cache
def substitution_kernels(width: int) -> tuple[Any, Any]:
    """Forward and backward substitution in single precision, in place: `width` right-hand sides a launch.

    x (n,): their values, a vector a row;
    block (b + 1,): first columns of blocks of up to COLUMNS columns that have the same rows below them;
    indptr (n + 1,), row and value (nnz,): the factor by columns, the diagonal first.
    """
    vector = wp.types.vector(length=width, dtype=wp.float32)

    @wp.kernel(module="unique")
    def forward(
        block: wp.array(dtype=int),
        indptr: wp.array(dtype=wp.int64),
        row: wp.array(dtype=int),
        value: wp.array(dtype=wp.float32),
        x: wp.array(dtype=vector),
    ):
        for b in range(block.shape[0] - 1):
            j = block[b]
            n = block[b + 1] - j
            for c in range(n):
                at = int(indptr[j + c])
                y = x[j + c] / value[at]
                x[j + c] = y
                for k in range(1, n - c):
                    x[j + c + k] = x[j + c + k] - value[at + k] * y
            a0 = int(indptr[j]) + n
            below = int(indptr[j + 1]) - a0
            if n == COLUMNS:
                y0 = x[j]
                y1 = x[j + 1]
                y2 = x[j + 2]
                y3 = x[j + 3]
                a1 = int(indptr[j + 1]) + 3
                a2 = int(indptr[j + 2]) + 2
                a3 = int(indptr[j + 3]) + 1
                for k in range(below):
                    r = row[a0 + k]
                    x[r] = (
                        x[r]
                        - value[a0 + k] * y0
                        - value[a1 + k] * y1
                        - value[a2 + k] * y2
                        - value[a3 + k] * y3
                    )
            else:
                for c in range(n):
                    y = x[j + c]
                    at = int(indptr[j + c]) + n - c
                    for k in range(below):
                        r = row[at + k]
                        x[r] = x[r] - value[at + k] * y

    @wp.kernel(module="unique")
    def backward(
        block: wp.array(dtype=int),
        indptr: wp.array(dtype=wp.int64),
        row: wp.array(dtype=int),
        value: wp.array(dtype=wp.float32),
        x: wp.array(dtype=vector),
    ):
        for i in range(1, block.shape[0]):
            b = block.shape[0] - 1 - i
            j = block[b]
            n = block[b + 1] - j
            a0 = int(indptr[j]) + n
            below = int(indptr[j + 1]) - a0
            if n == COLUMNS:
                y0 = x[j]
                y1 = x[j + 1]
                y2 = x[j + 2]
                y3 = x[j + 3]
                a1 = int(indptr[j + 1]) + 3
                a2 = int(indptr[j + 2]) + 2
                a3 = int(indptr[j + 3]) + 1
                for k in range(below):
                    z = x[row[a0 + k]]
                    y0 -= value[a0 + k] * z
                    y1 -= value[a1 + k] * z
                    y2 -= value[a2 + k] * z
                    y3 -= value[a3 + k] * z
                x[j] = y0
                x[j + 1] = y1
                x[j + 2] = y2
                x[j + 3] = y3
            else:
                for c in range(n):
                    y = x[j + c]
                    at = int(indptr[j + c]) + n - c
                    for k in range(below):
                        y -= value[at + k] * x[row[at + k]]
                    x[j + c] = y
            for d in range(n):
                c = n - 1 - d
                at = int(indptr[j + c])
                y = x[j + c]
                for k in range(1, n - c):
                    y -= value[at + k] * x[j + c + k]
                x[j + c] = y / value[at]

    return forward, backward
