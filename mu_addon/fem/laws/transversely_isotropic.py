"""Linear elasticity with one stiff or soft direction, in the body's own frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .green import add_fibre_shear, of_green_strain, symmetric_identity
from .law import Array, Law
from .tensors import add_dyad, f64, mat33, mat99, vec3
from .valid import require, require_positive

_FIBRE = 5


@wp.func
def transverse_energy(E: mat33, m: Any) -> wp.float64:
    f = vec3(m[5], m[6], m[7])
    v = E * f
    along = wp.dot(f, v)
    trace = wp.trace(E)
    W = f64(0.5) * m[0] * trace * trace + m[1] * wp.ddot(E, E) + m[2] * along * trace
    return W + f64(2.0) * (m[3] - m[1]) * wp.dot(v, v) + f64(0.5) * m[4] * along * along


@wp.func
def transverse_stress(E: mat33, m: Any) -> mat33:
    f = vec3(m[5], m[6], m[7])
    v = E * f
    along = wp.dot(f, v)
    trace = wp.trace(E)
    two = f64(2.0)
    S = (m[0] * trace + m[2] * along) * wp.identity(3, dtype=f64) + two * m[1] * E
    S += (m[2] * trace + m[4] * along) * wp.outer(f, f)
    return S + two * (m[3] - m[1]) * (wp.outer(f, v) + wp.outer(v, f))


@wp.func
def transverse_stiffness(E: mat33, m: Any) -> mat99:
    f = vec3(m[5], m[6], m[7])
    one = wp.identity(3, dtype=f64)
    ff = wp.outer(f, f)
    two = f64(2.0)
    D = add_dyad(symmetric_identity(two * m[1]), f64(1.0), one, m[0] * one + m[2] * ff)
    D = add_dyad(D, f64(1.0), ff, m[2] * one + m[4] * ff)
    return add_fibre_shear(D, two * (m[3] - m[1]), f)


class TransverselyIsotropic(Law):
    """Linear law, isotropic across a direction f.

    W(E) = lambda/2 tr(E)^2 + mu_across tr(E^2) + alpha Eff tr(E) + 2 (mu_along - mu_across) |E f|^2
    + beta/2 Eff^2. Linear between Green strain and second Piola-Kirchhoff stress, so that rotations may be
    large; strains should stay below about 0.05, beyond which compression softens without end. f is a unit
    vector in the undeformed body.
    """

    name = "transversely isotropic"
    parameter_names = (
        "lambda_MPa",
        "mu_across_MPa",
        "alpha_MPa",
        "mu_along_MPa",
        "beta_MPa",
        "fibre_x",
        "fibre_y",
        "fibre_z",
    )
    energy, stress, tangent = map(
        staticmethod, of_green_strain(transverse_energy, transverse_stress, transverse_stiffness)
    )

    @staticmethod
    def parameters(
        along_MPa: float,
        across_MPa: float,
        poisson_along: float,
        poisson_across: float,
        shear_MPa: float,
        fibre: Array,
    ) -> Array:
        """Parameters (k, 8) of engineering constants and directions (3,) or (k, 3) of any length.

        Young's moduli along and across f; Poisson's ratios of the strain across by a pull along, and of
        that across by one across; the shear modulus of planes that hold f.
        """
        s12, s23 = -poisson_along / along_MPa, -poisson_across / across_MPa
        compliance = [
            [1 / along_MPa, s12, s12],
            [s12, 1 / across_MPa, s23],
            [s12, s23, 1 / across_MPa],
        ]
        c = np.linalg.inv(np.array(compliance))
        across = (c[1, 1] - c[1, 2]) / 2
        alpha = c[0, 1] - c[1, 2]
        beta = c[0, 0] - c[1, 2] - 2 * alpha - 4 * shear_MPa + 2 * across
        fibre = unit(fibre)
        constants = np.broadcast_to([c[1, 2], across, alpha, shear_MPa, beta], (len(fibre), 5))
        return np.hstack([constants, fibre])

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa, averaged over directions."""
        return averaged(*parameters.T[:_FIBRE])

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless the stiffness is positive definite and the fibre a unit vector."""
        law = TransverselyIsotropic
        require_positive(law, parameters, "mu_across_MPa", "mu_along_MPa")
        lame, across, alpha, along, beta = parameters.T[:_FIBRE]
        plane, coupling = 2 * (lame + across), lame + alpha
        axial = lame + 2 * alpha + 4 * along - 2 * across + beta
        for name, value in (("plane stiffness", plane), ("least stiffness", axial * plane - 2 * coupling**2)):
            require(value > 0, law, name, value, "positive", "check the Poisson's ratios against the moduli")
        require_unit(law, parameters, _FIBRE)


def averaged(lame: Array, across: Array, alpha: Array, along: Array, beta: Array) -> Array:
    """Voigt's average of a transversely isotropic stiffness: shear and bulk modulus (k, 2)."""
    axial = lame + 2 * alpha + 4 * along - 2 * across + beta
    pressure = axial + 2 * (lame + 2 * across) + 4 * (lame + alpha) + 2 * lame
    total = axial + 2 * (lame + 2 * across) + 4 * along + 2 * across
    return np.stack([(3 * total - pressure) / 30, pressure / 9], axis=1)


def unit(directions: Array) -> Array:
    """Directions (3,) or (k, 3) as unit vectors (k, 3)."""
    directions = np.atleast_2d(np.asarray(directions, float))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def require_unit(law: Any, parameters: Array, first: int) -> None:
    """Raise InputError unless the three parameters from `first` on are a unit vector."""
    length = np.linalg.norm(parameters[:, first : first + 3], axis=1)
    name = f"length of ({', '.join(law.parameter_names[first : first + 3])})"
    require(np.abs(length - 1) < 1e-9, law, name, length, "1", f"let {law.__name__}.parameters make the row")
