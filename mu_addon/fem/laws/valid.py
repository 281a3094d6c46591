"""Checks and conversions of a law's parameters: errors name the parameter, its value and the remedy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import InputError


def require(good: Array, law: Any, name: str, values: Array, wanted: str, remedy: str) -> None:
    """Raise InputError unless `good` (k,) holds for all values (k,) of a law's parameter `name`.

    wanted, remedy: what the value must be and what to do, for the message, which names the first bad row.
    """
    bad = np.flatnonzero(~np.asarray(good))
    if len(bad):
        raise InputError(
            f"{law.name}: {name} = {values[bad[0]]:.6g} must be {wanted}",
            f"{len(bad)} of {len(good)} elements, the first in row {bad[0]} of the layer",
            remedy,
        )


def require_positive(law: Any, parameters: Array, *names: str, or_zero: bool = False) -> None:
    """Raise InputError unless the named columns of parameters (k, count) are finite and positive, or zero."""
    wanted, remedy = ("0 or more", "from 0") if or_zero else ("positive", "above 0")
    for name in names:
        values = parameters[:, law.parameter_names.index(name)]
        good = np.isfinite(values) & ((values > 0) | (or_zero & (values == 0)))
        require(good, law, name, values, f"{wanted} and finite", f"give a {name} {remedy}")


def shear_and_bulk(law: Any, modulus_MPa: Any, poisson: Any) -> tuple[Array, Array]:
    """Shear and bulk modulus (k,) in MPa of Young's modulus and Poisson's ratio, numbers or (k,).

    Raises InputError where the modulus is not positive or the ratio not between -1 and 0.5.
    """
    modulus, ratio = (np.array(a, float) for a in np.broadcast_arrays(*np.atleast_1d(modulus_MPa, poisson)))
    good = np.isfinite(modulus) & (modulus > 0)
    require(good, law, "Young's modulus", modulus, "positive and finite", "give a modulus above 0")
    remedy = "for a nearly incompressible body give 0.499 and a model with mean_dilatation"
    require((ratio > -1) & (ratio < 0.5), law, "Poisson's ratio", ratio, "above -1 and below 0.5", remedy)
    return modulus / (2 * (1 + ratio)), modulus / (3 * (1 - 2 * ratio))


def unit(directions: Array) -> Array:
    """Directions (3,) or (k, 3) of any length but 0 as unit vectors (k, 3)."""
    directions = np.atleast_2d(np.asarray(directions, float))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def require_unit(law: Any, parameters: Array, first: int) -> None:
    """Raise InputError unless parameters `first` to `first` + 2 of every row (k, count) are a unit vector.

    Its length may differ from 1 by 1e-9. law: named in the error.
    """
    length = np.linalg.norm(parameters[:, first : first + 3], axis=1)
    name = f"length of ({', '.join(law.parameter_names[first : first + 3])})"
    require(np.abs(length - 1) < 1e-9, law, name, length, "1", f"let {law.__name__}.parameters make the row")
