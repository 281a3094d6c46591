"""Mooney-Rivlin law."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .invariants import of_invariants, slopes
from .isochoric import split
from .law import Law
from .tensors import f64
from .valid import require, require_positive


@wp.func
def mooney_rivlin_energy(I1: wp.float64, I2: wp.float64, m: Any) -> wp.float64:
    return m[0] * (I1 - f64(3.0)) + m[1] * (I2 - f64(3.0))


@wp.func
def mooney_rivlin_slope(I1: wp.float64, I2: wp.float64, m: Any) -> slopes:
    return slopes(m[0], m[1], f64(0.0), f64(0.0), f64(0.0))


class MooneyRivlin(Law):
    """Mooney-Rivlin law, W = c1 (I1 - 3) + c2 (I2 - 3) + kappa/2 (J - 1)^2 with I1, I2 at constant volume.

    Rubber follows it to stretches of about 2. With c2 < 0 it loses ellipticity at some stretch, which
    is not looked for here.
    """

    name = "Mooney-Rivlin"
    parameter_names = ("c1_MPa", "c2_MPa", "kappa_MPa")
    example = (0.3, 0.1, 5.0)
    fitted = (("c1_MPa", None), ("c2_MPa", None))
    split_volume = True
    bulk = 2
    energy, stress, tangent = map(
        staticmethod, split(*of_invariants(mooney_rivlin_energy, mooney_rivlin_slope), bulk)
    )

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus 2 (c1 + c2) and kappa, (k, 2) in MPa, of parameters (k, 3)."""
        return np.stack([2 * (parameters[:, 0] + parameters[:, 1]), parameters[:, 2]], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless kappa > 0 and finite and c1 + c2 > 0, in MPa, in every row (k, 3)."""
        require_positive(MooneyRivlin, parameters, "kappa_MPa")
        total = parameters[:, 0] + parameters[:, 1]
        require(
            total > 0, MooneyRivlin, "c1_MPa + c2_MPa", total, "positive", "twice it is the shear modulus"
        )
