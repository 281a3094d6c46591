"""Linear elasticity of a cubic crystal or lattice: what laws fitted to a lattice are held against."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from mu_addon.fem.laws.green import of_green_strain, symmetric_identity
from mu_addon.fem.laws.law import Array, Law
from mu_addon.fem.laws.tensors import add_dyad, f64, mat33, mat99, vec3
from mu_addon.fem.laws.valid import require, require_positive, require_unit, unit


@wp.func
def _axis(a: int, m: Any) -> vec3:
    """The a-th axis: two are parameters, the third is across both."""
    first = vec3(m[3], m[4], m[5])
    second = vec3(m[6], m[7], m[8])
    if a == 0:
        return first
    if a == 1:
        return second
    return wp.cross(first, second)


@wp.func
def cubic_energy(E: mat33, m: Any) -> wp.float64:
    W = f64(0.5) * m[1] * wp.trace(E) * wp.trace(E) + m[2] * wp.ddot(E, E)
    for a in range(3):
        along = wp.dot(_axis(a, m), E * _axis(a, m))
        W += f64(0.5) * (m[0] - m[1] - f64(2.0) * m[2]) * along * along
    return W


@wp.func
def cubic_stress(E: mat33, m: Any) -> mat33:
    S = m[1] * wp.trace(E) * wp.identity(3, dtype=f64) + f64(2.0) * m[2] * E
    for a in range(3):
        e = _axis(a, m)
        S += ((m[0] - m[1] - f64(2.0) * m[2]) * wp.dot(e, E * e)) * wp.outer(e, e)
    return S


@wp.func
def cubic_stiffness(E: mat33, m: Any) -> mat99:
    one = wp.identity(3, dtype=f64)
    D = add_dyad(symmetric_identity(f64(2.0) * m[2]), m[1], one, one)
    for a in range(3):
        e = wp.outer(_axis(a, m), _axis(a, m))
        D = add_dyad(D, m[0] - m[1] - f64(2.0) * m[2], e, e)
    return D


class Cubic(Law):
    """Linear law of cubic symmetry: W(E) = C12/2 tr(E)^2 + C44 tr(E^2) + (C11 - C12 - 2 C44)/2 sum of Eaa^2.

    Eaa are the strains along three axes, of which a and b, perpendicular unit vectors in the undeformed
    body, are parameters. Linear between Green strain and second Piola-Kirchhoff stress: rotations may be
    large, strains should stay below about 0.05.
    """

    name = "cubic"
    isotropic = False
    parameter_names = ("C11_MPa", "C12_MPa", "C44_MPa", "a_x", "a_y", "a_z", "b_x", "b_y", "b_z")
    energy, stress, tangent = map(staticmethod, of_green_strain(cubic_energy, cubic_stress, cubic_stiffness))

    @staticmethod
    def parameters(
        modulus_MPa: Any, poisson: Any, shear_MPa: Any, a: Array = (1, 0, 0), b: Array = (0, 1, 0)
    ) -> Array:
        """Parameters (k, 9) of Young's modulus, Poisson's ratio and shear modulus along the axes.

        a, b: (3,) or (k, 3), of any length; b is turned square to a.
        """
        a = unit(a)
        b = np.atleast_2d(np.asarray(b, float))
        b = unit(b - (a * b).sum(axis=1, keepdims=True) * a)
        first, second, third = np.atleast_1d(modulus_MPa, poisson, shear_MPa)
        scale = first / ((1 + second) * (1 - 2 * second))
        columns = [scale * (1 - second), scale * second, third, *a.T, *b.T]
        return np.stack(np.broadcast_arrays(*columns), axis=1)

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus, averaged over directions, and bulk modulus (k, 2) in MPa."""
        C11, C12, C44 = parameters.T[:3]
        return np.stack([(C11 - C12 + 3 * C44) / 5, (C11 + 2 * C12) / 3], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless the stiffness is positive definite and a, b are square unit vectors."""
        require_positive(Cubic, parameters, "C44_MPa")
        C11, C12 = parameters.T[:2]
        for name, value in (("C11 - C12", C11 - C12), ("C11 + 2 C12", C11 + 2 * C12)):
            require(value > 0, Cubic, name, value, "positive", "check Poisson's ratio against the moduli")
        require_unit(Cubic, parameters, 3)
        require_unit(Cubic, parameters, 6)
        cosine = (parameters[:, 3:6] * parameters[:, 6:9]).sum(axis=1)
        require(np.abs(cosine) < 1e-9, Cubic, "a . b", cosine, "0", "let Cubic.parameters make the row")
