"""Yeoh law."""

from __future__ import annotations

from collections.abc import Sequence
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
def yeoh_energy(I1: wp.float64, I2: wp.float64, m: Any) -> wp.float64:
    x = I1 - f64(3.0)
    return x * (m[0] + x * (m[1] + x * m[2]))


@wp.func
def yeoh_slope(I1: wp.float64, I2: wp.float64, m: Any) -> slopes:
    x = I1 - f64(3.0)
    first = m[0] + x * (f64(2.0) * m[1] + f64(3.0) * x * m[2])
    return slopes(first, f64(0.0), f64(2.0) * m[1] + f64(6.0) * x * m[2], f64(0.0), f64(0.0))


# Energy, stress and tangent without the split, for laws that build on this one.
yeoh_parts = of_invariants(yeoh_energy, yeoh_slope)


class Yeoh(Law):
    """Yeoh law, W = sum of c_i (I1 - 3)^i, i = 1..3, + kappa/2 (J - 1)^2 with I1 at constant volume.

    Filled rubber follows it as far as it was fitted, up to stretches of 3 to 4. It is stable where dW/dI1
    grows fast enough with I1. A c2 < 0 can prevent this at large stretches; the fit checks it, not this law.
    Source: Yeoh, Rubber Chem. Technol. 66 (1993) 754.
    """

    name = "Yeoh"
    parameter_names = ("c1_MPa", "c2_MPa", "c3_MPa", "kappa_MPa")
    example = (0.3, -0.02, 0.004, 5.0)
    wall = """
    c2_over_c1 | 0 | | -0.05 to 10 | second over first coefficient of Yeoh's law \
        | assumed: none unless a coupon says otherwise
    c3_over_c1 | 0 | | 0 to 10 | third over first coefficient of Yeoh's law \
        | assumed: none unless a coupon says otherwise
    """
    wall_text = "stiffens at large strain"
    fitted = (("c1_MPa", 0.0), ("c2_MPa", None), ("c3_MPa", 0.0))
    split_volume = True
    bulk = 3
    energy, stress, tangent = map(staticmethod, split(*yeoh_parts, bulk))

    @classmethod
    def row_of_wall(cls, wall: Any, mu_MPa: float, kappa_MPa: float) -> Sequence[float]:
        """Parameters for shear and bulk modulus in MPa: c1 = mu/2 alone is neo-Hooke's law."""
        c1 = mu_MPa / 2
        return c1, wall.c2_over_c1 * c1, wall.c3_over_c1 * c1, kappa_MPa

    @classmethod
    def wall_of_row(cls, row: Sequence[float]) -> dict[str, float]:
        """The ratios c2/c1 and c3/c1 of a row (4,)."""
        c1, c2, c3, _ = row
        return {"c2_over_c1": c2 / c1, "c3_over_c1": c3 / c1}

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus 2 c1 and kappa, (k, 2) in MPa, of parameters (k, 4)."""
        return np.stack([2 * parameters[:, 0], parameters[:, 3]], axis=1)

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless c1, kappa > 0 and finite and c3 >= 0, all in MPa, in every row (k, 4)."""
        require_positive(Yeoh, parameters, "c1_MPa", "kappa_MPa")
        c3 = parameters[:, 2]
        require(c3 >= 0, Yeoh, "c3_MPa", c3, "0 or more", "with less, a large stretch has no energy minimum")
