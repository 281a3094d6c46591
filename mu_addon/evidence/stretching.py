"""An incompressible solid stretched in one of the modes of a tensile machine, in closed form."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError

# What the stretch is brought to beside itself in the neo-Hookean stress x - x^-m.
_ACROSS = {"uniaxial": 2.0, "equibiaxial": 5.0, "pure_shear": 3.0}


def yeoh(c1: float, ratio: float, mode: str, stretch: Array) -> Array:
    """Nominal stress (n,) of an incompressible solid W = c1 (I1 - 3 + ratio (I1 - 3)^2), in its unit.

    stretch (n,): length over undeformed length. mode: "uniaxial", "equibiaxial" or "pure_shear". P = 2 W' (x
    - x^-m), where m = 2, 5, 3 in the three modes. In closed form: fits evaluate it thousands of times, and a
    test compares it with the finite elements' law. Raises InputError for a stretch that is not positive.
    """
    if not (stretch > 0).all():
        raise InputError("a stretch is not positive", mode, "stretch is length over initial length")
    stiffness = 2 * (c1 + 2 * c1 * ratio * (first_invariant(mode, stretch) - 3)) if ratio else 2 * c1
    return np.asarray(stiffness * (stretch - stretch ** -_ACROSS[mode]))


def ogden(modulus: float, power: float, mode: str, stretch: Array) -> Array:
    """Nominal stress (n,) of an incompressible solid of one term of Ogden's, in the unit of its modulus E.

    stretch (n,), mode: as of `yeoh`. P = 2 E/(3 a) (x^(a - 1) - x^(-m a - 1)) of power a, where x^-m
    is the stretch of the free side: m = 1/2, 2, 1 in the three modes.
    """
    across = 0.5 * (_ACROSS[mode] - 1.0)
    return np.asarray(2 * modulus / (3 * power) * (stretch ** (power - 1) - stretch ** (-across * power - 1)))


def first_invariant(mode: str, stretch: Array) -> Array:
    """First invariant (n,) of an incompressible solid at stretches (n,)."""
    square = stretch**2
    if mode == "uniaxial":
        return np.asarray(square + 2 / stretch)
    if mode == "equibiaxial":
        return np.asarray(2 * square + square**-2)
    return np.asarray(square + 1 + 1 / square)
