"""Ogden law."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .isochoric import split
from .law import Law
from .principal import of_stretches, power_difference
from .tensors import f64, mat33, vec3
from .valid import require, require_positive

_TERMS = wp.constant(3)


@wp.func
def ogden_energy(stretch: vec3, m: Any) -> wp.float64:
    total = f64(0.0)
    for p in range(_TERMS):
        mu, alpha = m[2 * p], m[2 * p + 1]
        powers = wp.pow(stretch[0], alpha) + wp.pow(stretch[1], alpha) + wp.pow(stretch[2], alpha)
        total += mu / alpha * (powers - f64(3.0))
    return total


@wp.func
def ogden_stress(stretch: vec3, m: Any) -> vec3:
    s = vec3()
    for p in range(_TERMS):
        for a in range(3):
            s[a] += m[2 * p] * wp.pow(stretch[a], m[2 * p + 1] - f64(2.0))
    return s


@wp.func
def ogden_slope(stretch: vec3, m: Any) -> mat33:
    ds = mat33()
    for p in range(_TERMS):
        r = f64(0.5) * m[2 * p + 1] - f64(1.0)
        for a in range(3):
            ds[a, a] += m[2 * p] * r * wp.pow(stretch[a], f64(2.0) * r - f64(2.0))
    return ds


@wp.func
def ogden_difference(stretch: vec3, m: Any) -> vec3:
    g = vec3()
    for p in range(_TERMS):
        for a in range(3):
            r = f64(0.5) * m[2 * p + 1] - f64(1.0)
            g[a] += m[2 * p] * power_difference(stretch[a], stretch[(a + 1) % 3], r)
    return g


class Ogden(Law):
    """Ogden law, W = sum of mu_p/alpha_p (a^alpha_p + b^alpha_p + c^alpha_p - 3) + kappa/2 (J - 1)^2.

    p = 1..3; a, b, c are the principal stretches at constant volume; 2 mu = sum of mu_p alpha_p. A term that
    is not wanted has mu_p = 0. Rubber follows it in the range of the fit, up to stretches of 7. Every mu_p
    alpha_p > 0 is sufficient for stability, but is not required: many good fits violate it. Source: Ogden,
    Proc. R. Soc. A 326 (1972) 565.
    """

    name = "Ogden"
    parameter_names = ("mu1_MPa", "alpha1", "mu2_MPa", "alpha2", "mu3_MPa", "alpha3", "kappa_MPa")
    example = (0.6, 1.3, 0.02, 5.0, -0.1, -2.0, 7.0)
    terms = 3
    split_volume = True
    bulk = 6
    energy, stress, tangent = map(
        staticmethod, split(*of_stretches(ogden_energy, ogden_stress, ogden_slope, ogden_difference), bulk)
    )

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus, half of the sum of mu_p alpha_p, and kappa, (k, 2) in MPa, of parameters (k, 7)."""
        mu = (parameters[:, 0:6:2] * parameters[:, 1:6:2]).sum(axis=1) / 2
        return np.stack([mu, parameters[:, 6]], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless every row (k, 7) has kappa > 0, a shear modulus > 0 and no exponent 0.

        kappa and the shear modulus, the sum of mu_p alpha_p / 2, are in MPa.
        """
        require_positive(Ogden, parameters, "kappa_MPa")
        for p in (1, 3, 5):
            name, alpha = Ogden.parameter_names[p], parameters[:, p]
            require(alpha != 0, Ogden, name, alpha, "other than 0", "switch a term off by its mu_p = 0")
        mu = Ogden.small_strain(parameters)[:, 0]
        require(mu > 0, Ogden, "sum of mu_p alpha_p / 2", mu, "positive", "it is the shear modulus")
