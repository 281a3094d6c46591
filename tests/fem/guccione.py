"""Guccione's exponential law of heart muscle, which the benchmark of Land et al. (2015) is solved with."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from mu_addon.fem.laws.green import of_green_strain, symmetric_identity
from mu_addon.fem.laws.isochoric import split
from mu_addon.fem.laws.law import Array, Law
from mu_addon.fem.laws.tensors import add_dyad, f64, mat33, mat99, vec3
from mu_addon.fem.laws.valid import require_positive, require_unit, unit

_FIBRE = 5


@wp.func
def add_fibre_shear(A: mat99, factor: wp.float64, f: vec3) -> mat99:
    """A + factor times the second derivative of |E f|^2 by a symmetric E."""
    for i in range(3):
        for j in range(3):
            for k in range(3):
                x = f64(0.5) * factor * f[i] * f[k]
                y = f64(0.5) * factor * f[j] * f[k]
                A[3 * i + j, 3 * k + j] += x
                A[3 * i + j, 3 * j + k] += x
                A[3 * i + j, 3 * k + i] += y
                A[3 * i + j, 3 * i + k] += y
    return A


@wp.func
def _fibre(m: Any) -> vec3:
    return vec3(m[5], m[6], m[7])


@wp.func
def _exponent(E: mat33, m: Any) -> wp.float64:
    """Q = b_f Eff^2 + b_t (Ess^2 + Enn^2 + 2 Esn^2) + 2 b_fs (Efs^2 + Efn^2), without s and n."""
    f = _fibre(m)
    v = E * f
    along = wp.dot(f, v)
    Q = (m[1] + m[2] - f64(2.0) * m[3]) * along * along
    return Q + f64(2.0) * (m[3] - m[2]) * wp.dot(v, v) + m[2] * wp.ddot(E, E)


@wp.func
def _exponent_slope(E: mat33, m: Any) -> mat33:
    f = _fibre(m)
    v = E * f
    two = f64(2.0)
    slope = (two * (m[1] + m[2] - two * m[3]) * wp.dot(f, v)) * wp.outer(f, f)
    return slope + two * (m[3] - m[2]) * (wp.outer(f, v) + wp.outer(v, f)) + two * m[2] * E


@wp.func
def guccione_energy(E: mat33, m: Any) -> wp.float64:
    return f64(0.5) * m[0] * (wp.exp(_exponent(E, m)) - f64(1.0))


@wp.func
def guccione_stress(E: mat33, m: Any) -> mat33:
    return (f64(0.5) * m[0] * wp.exp(_exponent(E, m))) * _exponent_slope(E, m)


@wp.func
def guccione_stiffness(E: mat33, m: Any) -> mat99:
    f = _fibre(m)
    slope = _exponent_slope(E, m)
    two = f64(2.0)
    D = symmetric_identity(two * m[2])
    D = add_fibre_shear(D, two * (m[3] - m[2]), f)
    D = add_dyad(D, two * (m[1] + m[2] - two * m[3]), wp.outer(f, f), wp.outer(f, f))
    D = add_dyad(D, f64(1.0), slope, slope)
    return (f64(0.5) * m[0] * wp.exp(_exponent(E, m))) * D


class Guccione(Law):
    """Guccione law, W = C/2 (e^Q - 1) + kappa/2 (J - 1)^2, transversely isotropic about a fibre f.

    Q = b_f Eff^2 + b_t (Ess^2 + Enn^2 + 2 Esn^2) + 2 b_fs (Efs^2 + Efn^2) of the Green strain at constant
    volume, E = (J^(-2/3) F^T F - 1)/2: with the whole strain a nearly incompressible body has no stable
    path. The fibre is a unit vector in the undeformed body. Meant for strains up to about 0.4, where Q
    stays below about 5. Source: Guccione, McCulloch and Waldman, J. Biomech. Eng. 113 (1991) 42.
    """

    name = "Guccione"
    isotropic = False
    parameter_names = ("C_MPa", "b_f", "b_t", "b_fs", "kappa_MPa", "fibre_x", "fibre_y", "fibre_z")
    split_volume = True
    bulk = 4
    energy, stress, tangent = map(
        staticmethod, split(*of_green_strain(guccione_energy, guccione_stress, guccione_stiffness), bulk)
    )

    @staticmethod
    def parameters(C_MPa: Any, b_f: Any, b_t: Any, b_fs: Any, kappa_MPa: Any, fibre: Array) -> Array:
        """Parameters (k, 8) of numbers or arrays (k,) and fibre directions (3,) or (k, 3) of any length."""
        fibre = unit(fibre)
        values = np.broadcast_arrays(*np.atleast_1d(C_MPa, b_f, b_t, b_fs, kappa_MPa, fibre[:, 0]))[:5]
        return np.column_stack([*values, np.broadcast_to(fibre, (len(values[0]), 3))])

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus, averaged over directions, and kappa (k, 2) in MPa."""
        C, b_f, b_t, b_fs, kappa = parameters.T[:5]
        none = np.zeros_like(C)
        fibre = C * (b_f + b_t - 2 * b_fs)
        return np.stack([averaged(none, C * b_t / 2, none, C * b_fs / 2, fibre)[:, 0], kappa], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless C, all b and kappa are positive and the fibre is a unit vector."""
        require_positive(Guccione, parameters, *Guccione.parameter_names[:_FIBRE])
        require_unit(Guccione, parameters, _FIBRE)


def averaged(lame: Array, across: Array, alpha: Array, along: Array, beta: Array) -> Array:
    """Voigt's average of a transversely isotropic stiffness: shear and bulk modulus (k, 2)."""
    axial = lame + 2 * alpha + 4 * along - 2 * across + beta
    pressure = axial + 2 * (lame + 2 * across) + 4 * (lame + alpha) + 2 * lame
    total = axial + 2 * (lame + 2 * across) + 4 * along + 2 * across
    return np.stack([(3 * total - pressure) / 30, pressure / 9], axis=1)
