"""Compressible foam, with different stiffness in tension and in compression."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .law import Law
from .principal import of_stretches, power_difference
from .tensors import f64, mat33, vec3
from .valid import require, require_positive

vec2 = wp.vec2d


@wp.func
def _side(stretch: wp.float64, m: Any) -> vec2:
    """Modulus and exponent for a stretch: those of tension from 1 on, else of compression."""
    if stretch < f64(1.0):
        return vec2(m[2], m[3])
    return vec2(m[0], m[1])


@wp.func
def _volume_stress(J: wp.float64, m: Any) -> wp.float64:
    """J dv/dJ of v = lambda/gamma (ln J + (J^-gamma - 1)/gamma)."""
    return m[4] / m[5] * (f64(1.0) - wp.pow(J, -m[5]))


@wp.func
def foam_energy(stretch: vec3, m: Any) -> wp.float64:
    J = stretch[0] * stretch[1] * stretch[2]
    total = m[4] / m[5] * (wp.log(J) + (wp.pow(J, -m[5]) - f64(1.0)) / m[5])
    for a in range(3):
        c = _side(stretch[a], m)
        growth = (wp.pow(stretch[a], c[1]) - f64(1.0)) / c[1] - wp.log(stretch[a])
        total += f64(2.0) * c[0] / c[1] * growth
    return total


@wp.func
def foam_stress(stretch: vec3, m: Any) -> vec3:
    volume = _volume_stress(stretch[0] * stretch[1] * stretch[2], m)
    s = vec3()
    for a in range(3):
        c = _side(stretch[a], m)
        own = f64(2.0) * c[0] / c[1] * (wp.pow(stretch[a], c[1]) - f64(1.0))
        s[a] = (own + volume) / (stretch[a] * stretch[a])
    return s


@wp.func
def foam_slope(stretch: vec3, m: Any) -> mat33:
    J = stretch[0] * stretch[1] * stretch[2]
    volume = _volume_stress(J, m)
    growth = f64(0.5) * m[4] * wp.pow(J, -m[5])
    ds = mat33()
    for a in range(3):
        x = stretch[a] * stretch[a]
        for b in range(3):
            ds[a, b] = growth / (x * stretch[b] * stretch[b])
        c = _side(stretch[a], m)
        power = wp.pow(stretch[a], c[1])
        own = c[0] / c[1] * ((c[1] - f64(2.0)) * power + f64(2.0))
        ds[a, a] += (own - volume) / (x * x)
    return ds


@wp.func
def _own_difference(a: wp.float64, b: wp.float64, c: vec2) -> wp.float64:
    """Divided difference by x of 2 mu/alpha (x^(alpha/2 - 1) - 1/x), of one side of stretch 1."""
    power = power_difference(a, b, f64(0.5) * c[1] - f64(1.0))
    return f64(2.0) * c[0] / c[1] * (power + f64(1.0) / (a * a * b * b))


@wp.func
def foam_difference(stretch: vec3, m: Any) -> vec3:
    volume = _volume_stress(stretch[0] * stretch[1] * stretch[2], m)
    g = vec3()
    one = f64(1.0)
    for i in range(3):
        a = wp.min(stretch[i], stretch[(i + 1) % 3])
        b = wp.max(stretch[i], stretch[(i + 1) % 3])
        if a < one and one < b:
            # Both sides are 0 at stretch 1, so each adds its own difference up to there.
            share = (b - one) * (b + one) / ((b - a) * (b + a))
            g[i] = share * _own_difference(one, b, _side(b, m))
            g[i] += (one - share) * _own_difference(a, one, _side(a, m))
        else:
            g[i] = _own_difference(a, b, _side(a, m))
        g[i] -= volume / (a * a * b * b)
    return g


class Foam(Law):
    """Ogden-Storakers foam with separate moduli for principal stretches above and below 1.

    W = sum over principal stretches a of 2 mu/alpha ((a^alpha - 1)/alpha - ln a), with mu and alpha of
    tension for a >= 1 and of compression for a < 1, + lambda/gamma (ln J + (J^-gamma - 1)/gamma). With one mu
    and alpha, and gamma = alpha beta, lambda = 2 mu beta, this is the hyperfoam of one term.

    Energy and stress are continuous. The tangent is continuous if mu of tension and compression agree;
    otherwise it jumps where a principal stretch passes 1. lambda is the first Lame constant (0: no lateral
    strain). A large alpha in compression gives a plateau. Meant for open lattices from about 0.4 to 1.5.
    Source: Storakers, J. Mech. Phys. Solids 34 (1986) 125.
    """

    name = "foam"
    parameter_names = (
        "mu_tension_MPa",
        "alpha_tension",
        "mu_compression_MPa",
        "alpha_compression",
        "lambda_MPa",
        "gamma",
    )
    example = (0.4, 3.0, 0.25, 12.0, 0.3, 2.0)
    energy, stress, tangent = map(
        staticmethod, of_stretches(foam_energy, foam_stress, foam_slope, foam_difference)
    )

    @staticmethod
    def parameters(modulus_MPa: Any, poisson: Any, alpha_tension: Any, alpha_compression: Any) -> Array:
        """Parameters (k, 6) of one small-strain Young's modulus in MPa, Poisson's ratio and two exponents.

        Each is a number or (k,); tension and compression get the same mu. gamma = alpha_compression nu/(1 - 2
        nu), as in hyperfoam with one term, and 1 for a nu of 0. The values are not checked here: `valid` does
        that.
        """
        values = np.broadcast_arrays(*np.atleast_1d(modulus_MPa, poisson, alpha_tension, alpha_compression))
        modulus, nu, tension, compression = (np.array(v, float) for v in values)
        mu = modulus / (2 * (1 + nu))
        beta = nu / (1 - 2 * nu)
        # Where lambda is nothing beside mu, gamma does not count, and a tiny one would be lost in rounding.
        gamma = np.where(np.abs(beta) < 1e-12, 1.0, compression * beta)
        return np.stack([mu, tension, mu, compression, 2 * mu * beta, gamma], axis=1)

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa of parameters (k, 6).

        mu, the mean of tension and compression, and lambda + 2/3 mu.
        """
        mu = (parameters[:, 0] + parameters[:, 2]) / 2
        return np.stack([mu, parameters[:, 4] + 2 / 3 * mu], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless mu > 0, lambda >= 0 in MPa and no exponent, gamma among them, is 0.

        parameters: (k, 6); both mu must be finite too.
        """
        require_positive(Foam, parameters, "mu_tension_MPa", "mu_compression_MPa")
        for name in ("alpha_tension", "alpha_compression", "gamma"):
            values = parameters[:, Foam.parameter_names.index(name)]
            require(values != 0, Foam, name, values, "other than 0", "give a small number for its limit")
        lame = parameters[:, 4]
        require(lame >= 0, Foam, "lambda_MPa", lame, "0 or more", "auxetic foams are not covered")
