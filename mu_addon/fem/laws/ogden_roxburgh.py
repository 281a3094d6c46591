"""Ogden-Roxburgh softening of a Yeoh law: rubber is softer below the largest strain it has reached."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from ...design.quantity import in_MPa
from .isochoric import split
from .law import Law
from .tensors import add_dyad, f64, isochoric, mat33, mat99
from .valid import require
from .yeoh import Yeoh, yeoh_parts

_ROOT_PI = wp.constant(f64(np.sqrt(np.pi)))

_history = wp.types.vector(length=1, dtype=wp.float64)
_yeoh_energy, _yeoh_stress, _yeoh_tangent = yeoh_parts


@wp.func
def _error_integral(x: wp.float64) -> wp.float64:
    return x * wp.erf(x) + wp.exp(-x * x) / _ROOT_PI


@wp.func
def roxburgh_energy(F: mat33, m: Any) -> wp.float64:
    """The integral of eta dW from rest, with eta = 1 beyond the largest energy so far."""
    W = _yeoh_energy(F, m)
    largest = m[7]
    width = m[5] + m[6] * largest
    within = wp.min(W, largest)
    saved = _error_integral(largest / width) - _error_integral((largest - within) / width)
    return W - width / m[4] * saved


@wp.func
def _eta(W: wp.float64, m: Any) -> wp.float64:
    if m[7] <= W:
        return f64(1.0)
    return f64(1.0) - wp.erf((m[7] - W) / (m[5] + m[6] * m[7])) / m[4]


@wp.func
def roxburgh_stress(F: mat33, m: Any) -> mat33:
    return _eta(_yeoh_energy(F, m), m) * _yeoh_stress(F, m)


@wp.func
def roxburgh_tangent(F: mat33, m: Any) -> mat99:
    W = _yeoh_energy(F, m)
    A = _eta(W, m) * _yeoh_tangent(F, m)
    if m[7] > W:
        width = m[5] + m[6] * m[7]
        x = (m[7] - W) / width
        P = _yeoh_stress(F, m)
        A = add_dyad(A, f64(2.0) * wp.exp(-x * x) / (_ROOT_PI * m[4] * width), P, P)
    return A


@wp.func
def roxburgh_advance(F: mat33, m: Any) -> _history:
    return _history(wp.max(m[7], _yeoh_energy(isochoric(F), m)))


class OgdenRoxburgh(Law):
    """Yeoh law whose isochoric stress is scaled by eta below the largest energy W_m so far (Mullins).

    eta = 1 - erf((W_m - W)/(m + beta W_m))/r. Larger r: less softening; m, in MPa, keeps small strains
    as they were; beta widens the return. No set remains at rest and reloading retraces unloading. Stress is
    continuous; the tangent jumps where W passes W_m. Source: Ogden and Roxburgh, Proc. R. Soc. A 455
    (1999) 2861, with beta as commonly added.
    """

    name = "Ogden-Roxburgh"
    parameter_names = (*Yeoh.parameter_names, "r", "m_MPa", "beta")
    positive, from_zero = ("m_MPa",), ("beta",)
    example = (*Yeoh.example, 1.5, 0.05, 0.1)
    builds_on = "Yeoh"
    wall = """
    mullins_r | 2 | | 1 to 1000 | Ogden-Roxburgh's r: the largest loss of stress is 1/r of it \
        | assumed: a filled rubber loses about half
    mullins_m_kPa | 50 | kPa | 0.01 to 100000 \
        | Ogden-Roxburgh's m: differences of strain energy far below it soften nothing \
        | assumed: the energy of the default wall at a stretch of 1.2
    mullins_beta | 0.1 | | 0 to 10 | Ogden-Roxburgh's beta: widens the return to the first loading's stress \
        | assumed: a customary value
    """
    wall_text = "softens below its largest strain (Mullins)"
    history = 1
    split_volume = True
    bulk = 3
    energy, stress, tangent = map(
        staticmethod, split(roxburgh_energy, roxburgh_stress, roxburgh_tangent, bulk)
    )
    advance = staticmethod(roxburgh_advance)

    @classmethod
    def row_of_wall(cls, wall: Any, mu_MPa: float, kappa_MPa: float) -> Sequence[float]:
        """Parameters for shear and bulk modulus in MPa of the virgin material."""
        yeoh = Yeoh.row_of_wall(wall, mu_MPa, kappa_MPa)
        return *yeoh, wall.mullins_r, in_MPa(wall.mullins_m_kPa), wall.mullins_beta

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus 2 c1 of the virgin material and kappa, (k, 2) in MPa, of parameters (k, 7)."""
        return Yeoh.small_strain(parameters)

    @classmethod
    def valid(cls, parameters: Array) -> None:
        """Raise InputError unless the Yeoh law is valid, r >= 1, m > 0 in MPa and beta >= 0.

        parameters: (k, 7), in the order of `parameter_names`.
        """
        Yeoh.valid(parameters[:, :4])
        super().valid(parameters)
        r = parameters[:, 4]
        require(r >= 1, cls, "r", r, "1 or more", "with less, the softened stress turns against the strain")
