"""Warp kernels: element energies, forces and stiffness blocks, and the gathers."""

from __future__ import annotations

import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

import attrs
import warp as wp

from .kernel_cache import own_cache, usable_cache
from .laws.tensors import add_dyad, add_swapped, contract, mat33

vec3 = wp.vec3d
f64 = wp.float64

wp.config.log_level = wp.LOG_WARNING
wp.config.enable_backward = False


@cache
def start_warp() -> None:
    """Start Warp with a cache that can be used, without its notice that this machine has no NVIDIA driver.

    That is not a fault of the run, and is written by native code straight to the process's standard error.
    """
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        try:
            wp.init()
        except OSError:
            # The folder of its cache cannot be made.
            wp.config.kernel_cache_dir = str(own_cache())
            wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
    wp.config.kernel_cache_dir = str(usable_cache(Path(wp.config.kernel_cache_dir)))


start_warp()


@wp.func
def deformation_gradient(
    u: wp.array(dtype=vec3), tets: wp.array2d(dtype=int), G: wp.array3d(dtype=vec3), e: int, q: int
) -> mat33:
    F = wp.identity(3, dtype=f64)
    for a in range(tets.shape[1]):
        F += wp.outer(u[tets[e, a]], G[e, q, a])
    return F


@wp.func
def cofactors(F: mat33) -> mat33:
    """det F F^-T, of singular matrices as well."""
    a = vec3(F[0, 0], F[0, 1], F[0, 2])
    b = vec3(F[1, 0], F[1, 1], F[1, 2])
    c = vec3(F[2, 0], F[2, 1], F[2, 2])
    bc = wp.cross(b, c)
    ca = wp.cross(c, a)
    ab = wp.cross(a, b)
    return mat33(bc[0], bc[1], bc[2], ca[0], ca[1], ca[2], ab[0], ab[1], ab[2])


@wp.kernel
def mean_dilatation(
    first: int,
    elements: wp.array(dtype=int),
    u: wp.array(dtype=vec3),
    tets: wp.array2d(dtype=int),
    G: wp.array3d(dtype=vec3),
    dV: wp.array2d(dtype=f64),
    mean_J: wp.array(dtype=f64),
    slope: wp.array2d(dtype=vec3),
):
    """Mean of det F over each of some elements, and its derivatives by the nodes' displacements."""
    e = elements[first + wp.tid()]
    total = f64(0.0)
    swept = f64(0.0)
    for a in range(tets.shape[1]):
        slope[e, a] = vec3()
    for q in range(dV.shape[1]):
        F = deformation_gradient(u, tets, G, e, q)
        total += dV[e, q]
        swept += dV[e, q] * wp.determinant(F)
        cofactor = dV[e, q] * cofactors(F)
        for a in range(tets.shape[1]):
            slope[e, a] = slope[e, a] + cofactor * G[e, q, a]
    # Elements replaced by a waveguide have no volume, and no mean.
    mean_J[e] = f64(1.0)
    if total > f64(0.0):
        mean_J[e] = swept / total
    else:
        total = f64(1.0)
    for a in range(tets.shape[1]):
        slope[e, a] = slope[e, a] / total


@attrs.frozen
class LawKernels:
    """The element kernels of one material law: energy, force, stiffness, and advance of its history.

    along: the stress at each point, and how it changes along other displacements. `advance` is None for a law
    without history.
    """

    energy: Any
    force: Any
    stiffness: Any
    along: Any
    advance: Any


@cache
def law_kernels(law: Any, mean: bool = False) -> LawKernels:
    """Compile the element kernels of a law (see laws.Law).

    Each runs over the rows of one layer; an element's first layer sets its output, later ones add to it.
    mean: of the law's kappa/2 (J - 1)^2, the part mean_kappa (k,) takes the mean J of the element, which is
    the three-field principle with constant pressure and dilatation, both eliminated. Source: Simo, Taylor
    and Pister, Comput. Methods Appl. Mech. Eng. 51 (1985) 177.
    """
    energy_of, stress_of, tangent_of, advance_of = law.energy, law.stress, law.tangent, law.advance
    count, history_count = len(law.parameter_names), law.history
    size = count + history_count + 1 if history_count else count
    vector = wp.types.vector(length=size, dtype=wp.float64)
    bulk = law.bulk if mean else None

    @wp.func
    def parameters_at(
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        dt: f64,
        r: int,
        q: int,
    ) -> vector:
        m = vector()
        for i in range(wp.static(count)):
            m[i] = rows[r, i]
        if wp.static(history_count > 0):
            for i in range(wp.static(history_count)):
                m[wp.static(count) + i] = history[r, q, i]
            m[wp.static(size - 1)] = dt
        if wp.static(bulk is not None):
            m[wp.static(bulk or 0)] -= mean_kappa[r]
        return m

    @wp.kernel(module="unique")
    def energy(
        first: int,
        elements: wp.array(dtype=int),
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        weight: wp.array(dtype=f64),
        adds: wp.array(dtype=int),
        dt: f64,
        u: wp.array(dtype=vec3),
        tets: wp.array2d(dtype=int),
        G: wp.array3d(dtype=vec3),
        dV: wp.array2d(dtype=f64),
        mean_J: wp.array(dtype=f64),
        out: wp.array(dtype=f64),
        smallest_J: wp.array(dtype=f64),
    ):
        r = first + wp.tid()
        e = elements[r]
        total = f64(0.0)
        volume = f64(0.0)
        least = f64(1.0e30)
        for q in range(dV.shape[1]):
            F = deformation_gradient(u, tets, G, e, q)
            J = wp.determinant(F)
            least = wp.min(least, J)
            volume += dV[e, q]
            if f64(0.0) < J:
                total += dV[e, q] * energy_of(F, parameters_at(rows, mean_kappa, history, dt, r, q))
        if wp.static(bulk is not None):
            growth = mean_J[e] - f64(1.0)
            total += f64(0.5) * mean_kappa[r] * growth * growth * volume
        total *= weight[r]
        if adds[r] == 1:
            total += out[e]
        out[e] = total
        smallest_J[e] = least

    @wp.kernel(module="unique")
    def force(
        first: int,
        elements: wp.array(dtype=int),
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        weight: wp.array(dtype=f64),
        adds: wp.array(dtype=int),
        dt: f64,
        u: wp.array(dtype=vec3),
        tets: wp.array2d(dtype=int),
        G: wp.array3d(dtype=vec3),
        dV: wp.array2d(dtype=f64),
        mean_J: wp.array(dtype=f64),
        slope: wp.array2d(dtype=vec3),
        out: wp.array2d(dtype=vec3),
    ):
        r = first + wp.tid()
        e = elements[r]
        if adds[r] == 0:
            for a in range(tets.shape[1]):
                out[e, a] = vec3()
        volume = f64(0.0)
        for q in range(dV.shape[1]):
            m = parameters_at(rows, mean_kappa, history, dt, r, q)
            P = (weight[r] * dV[e, q]) * stress_of(deformation_gradient(u, tets, G, e, q), m)
            volume += dV[e, q]
            for a in range(tets.shape[1]):
                out[e, a] = out[e, a] + P * G[e, q, a]
        if wp.static(bulk is not None):
            pressure = mean_kappa[r] * (mean_J[e] - f64(1.0))
            for a in range(tets.shape[1]):
                out[e, a] = out[e, a] + (weight[r] * pressure * volume) * slope[e, a]

    @wp.kernel(module="unique")
    def stiffness(
        first: int,
        elements: wp.array(dtype=int),
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        weight: wp.array(dtype=f64),
        adds: wp.array(dtype=int),
        dt: f64,
        u: wp.array(dtype=vec3),
        tets: wp.array2d(dtype=int),
        G: wp.array3d(dtype=vec3),
        dV: wp.array2d(dtype=f64),
        mean_J: wp.array(dtype=f64),
        slope: wp.array2d(dtype=vec3),
        out: wp.array(dtype=mat33),
    ):
        # Blocks of node pairs a <= b, row by row; the others are their transposes.
        r = first + wp.tid()
        e = elements[r]
        n = tets.shape[1]
        start = e * ((n * (n + 1)) // 2)
        volume = f64(0.0)
        for q in range(dV.shape[1]):
            volume += dV[e, q]
            F = deformation_gradient(u, tets, G, e, q)
            A = tangent_of(F, parameters_at(rows, mean_kappa, history, dt, r, q))
            if wp.static(bulk is not None):
                B = wp.transpose(wp.inverse(F))
                pressure = mean_kappa[r] * (mean_J[e] - f64(1.0)) * wp.determinant(F)
                A = add_swapped(add_dyad(A, pressure, B, B), -pressure, B, B)
            A *= weight[r] * dV[e, q]
            for b in range(n):
                g = G[e, q, b]
                # T[i, 3 J + k] = sum_L A[iJ, kL] g_L
                T0 = mat33()
                T1 = mat33()
                T2 = mat33()
                for J in range(3):
                    for k in range(3):
                        c = 3 * k
                        T0[J, k] = A[J, c] * g[0] + A[J, c + 1] * g[1] + A[J, c + 2] * g[2]
                        T1[J, k] = A[3 + J, c] * g[0] + A[3 + J, c + 1] * g[1] + A[3 + J, c + 2] * g[2]
                        T2[J, k] = A[6 + J, c] * g[0] + A[6 + J, c + 1] * g[1] + A[6 + J, c + 2] * g[2]
                for a in range(b + 1):
                    h = G[e, q, a]
                    block = wp.matrix_from_rows(h * T0, h * T1, h * T2)
                    at = start + a * n - (a * (a - 1)) // 2 + (b - a)
                    if q == 0 and adds[r] == 0:
                        out[at] = block
                    else:
                        out[at] = out[at] + block
        if wp.static(bulk is not None):
            for a in range(n):
                for b in range(a, n):
                    block = (weight[r] * mean_kappa[r] * volume) * wp.outer(slope[e, a], slope[e, b])
                    at = start + a * n - (a * (a - 1)) // 2 + (b - a)
                    out[at] = out[at] + block

    @wp.kernel(module="unique")
    def along(
        first: int,
        elements: wp.array(dtype=int),
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        dt: f64,
        u: wp.array(dtype=vec3),
        tets: wp.array2d(dtype=int),
        G: wp.array3d(dtype=vec3),
        other: wp.array2d(dtype=vec3),
        stress: wp.array2d(dtype=mat33),
        change: wp.array3d(dtype=mat33),
    ):
        # Of the part of the law that acts point by point.
        r = first + wp.tid()
        e = elements[r]
        for q in range(G.shape[1]):
            m = parameters_at(rows, mean_kappa, history, dt, r, q)
            F = deformation_gradient(u, tets, G, e, q)
            stress[r, q] = stress_of(F, m)
            A = tangent_of(F, m)
            for k in range(other.shape[0]):
                H = mat33()
                for a in range(tets.shape[1]):
                    H += wp.outer(other[k, tets[e, a]], G[e, q, a])
                change[k, r, q] = contract(A, H)

    if not history_count:
        return LawKernels(energy, force, stiffness, along, None)

    @wp.kernel(module="unique")
    def advance(
        first: int,
        elements: wp.array(dtype=int),
        rows: wp.array2d(dtype=f64),
        mean_kappa: wp.array(dtype=f64),
        history: wp.array3d(dtype=f64),
        dt: f64,
        u: wp.array(dtype=vec3),
        tets: wp.array2d(dtype=int),
        G: wp.array3d(dtype=vec3),
    ):
        r = first + wp.tid()
        for q in range(history.shape[1]):
            F = deformation_gradient(u, tets, G, elements[r], q)
            found = advance_of(F, parameters_at(rows, mean_kappa, history, dt, r, q))
            for i in range(wp.static(history_count)):
                history[r, q, i] = found[i]

    return LawKernels(energy, force, stiffness, along, advance)


@wp.kernel
def gather_vectors(
    parts: wp.array(dtype=vec3),
    start: wp.array(dtype=int),
    index: wp.array(dtype=int),
    out: wp.array(dtype=vec3),
):
    """Sum each node's contributions in a fixed order, so that the result does not depend on timing."""
    i = wp.tid()
    total = vec3()
    for k in range(start[i], start[i + 1]):
        total += parts[index[k]]
    out[i] = total


@wp.kernel
def gather_blocks(
    first: int,
    parts: wp.array(dtype=mat33),
    start: wp.array(dtype=int),
    index: wp.array(dtype=int),
    out: wp.array(dtype=mat33),
):
    """Sum each matrix block's contributions; a negative index -k-1 takes part k transposed."""
    i = first + wp.tid()
    total = mat33()
    for k in range(start[i], start[i + 1]):
        j = index[k]
        if j >= 0:
            total += parts[j]
        else:
            total += wp.transpose(parts[-j - 1])
    out[i] = total


@wp.kernel
def spread_blocks(
    first: int,
    parts: wp.array(dtype=mat33),
    start: wp.array(dtype=int),
    index: wp.array(dtype=int),
    weight: wp.array(dtype=f64),
    out: wp.array(dtype=mat33),
):
    """As `gather_blocks`, each contribution times its weight."""
    i = first + wp.tid()
    total = mat33()
    for k in range(start[i], start[i + 1]):
        j = index[k]
        if j >= 0:
            total += weight[k] * parts[j]
        else:
            total += weight[k] * wp.transpose(parts[-j - 1])
    out[i] = total
