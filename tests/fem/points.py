"""A law at a single point taken along a path, and derivatives by differences."""

from __future__ import annotations

from functools import cache

import numpy as np
import warp as wp

from mu_addon.fem.law_at_points import evaluate
from mu_addon.fem.laws.tensors import mat33

f64 = wp.float64


@cache
def _advance_kernel(law, count):
    advance_of = law.advance
    vector = wp.types.vector(length=count, dtype=f64)

    @wp.kernel(module="unique")
    def kernel(F: wp.array(dtype=mat33), rows: wp.array2d(dtype=f64), out: wp.array2d(dtype=f64)):
        i = wp.tid()
        m = vector()
        for k in range(wp.static(count)):
            m[k] = rows[i, k]
        found = advance_of(F[i], m)
        for k in range(wp.static(law.history)):
            out[i, k] = found[k]

    return kernel


def drive(law, parameters, F, time):
    """Energy (n,) and stress (n, 3, 3) of one point taken through F (n, 3, 3) at times (n,), from rest."""
    history = np.zeros(law.history)
    energies, stresses = [], []
    before = time[0]
    for now, at in zip(time, F, strict=True):
        row = np.concatenate([parameters, history, [now - before]])
        W, P, _ = evaluate(law, at, row)
        inputs = [wp.array([at], dtype=mat33, device="cpu"), wp.array([row], dtype=f64, device="cpu")]
        out = wp.zeros((1, law.history), dtype=f64, device="cpu")
        wp.launch(_advance_kernel(law, len(row)), 1, [*inputs, out], device="cpu")
        history, before = out.numpy()[0], now
        energies.append(W[0])
        stresses.append(P[0])
    return np.array(energies), np.array(stresses)


def difference(values, F, h):
    """Derivative of values(F) -> (n, ...) by F (n, 3, 3), of the fourth order in h: (n, ..., 9)."""
    columns = []
    for c in range(9):
        d = np.zeros(9)
        d[c] = h
        d = d.reshape(3, 3)
        v = {s: values(F + s * d) for s in (-2, -1, 1, 2)}
        columns.append((8 * (v[1] - v[-1]) - (v[2] - v[-2])) / (12 * h))
    return np.stack(columns, axis=-1)
