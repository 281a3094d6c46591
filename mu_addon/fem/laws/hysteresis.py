"""Rate-independent hysteresis: an elastic branch that slides at a yield stress."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...arrays import Array
from .green import green_strain, of_green_strain, symmetric_identity
from .isochoric import split
from .law import Law
from .tensors import THIRD, add_dyad, f64, isochoric, mat33, mat99, put_symmetric, symmetric_at

# A uniaxial stress s has a deviator of length sqrt(2/3) s.
_DEVIATOR = wp.constant(f64(np.sqrt(2 / 3)))

_history = wp.types.vector(length=6, dtype=wp.float64)


@wp.func
def _elastic(E: mat33, m: Any) -> mat33:
    """Deviator of the elastic strain: the strain less the plastic one."""
    return E - (THIRD * wp.trace(E)) * wp.identity(3, dtype=f64) - symmetric_at(m, 2)


@wp.func
def _size(e: mat33) -> wp.float64:
    return wp.sqrt(wp.ddot(e, e))


@wp.func
def friction_energy(E: mat33, m: Any) -> wp.float64:
    t = _size(_elastic(E, m))
    limit = _DEVIATOR * m[1]
    if f64(2.0) * m[0] * t <= limit:
        return m[0] * t * t
    return limit * t - limit * limit / (f64(4.0) * m[0])


@wp.func
def friction_stress(E: mat33, m: Any) -> mat33:
    e = _elastic(E, m)
    limit = _DEVIATOR * m[1]
    factor = f64(2.0) * m[0]
    if factor * _size(e) > limit:
        factor = limit / _size(e)
    return factor * e


@wp.func
def friction_stiffness(E: mat33, m: Any) -> mat99:
    e = _elastic(E, m)
    limit = _DEVIATOR * m[1]
    factor = f64(2.0) * m[0]
    slides = factor * _size(e) > limit
    if slides:
        factor = limit / _size(e)
    one = wp.identity(3, dtype=f64)
    D = add_dyad(symmetric_identity(factor), -factor * THIRD, one, one)
    if slides:
        D = add_dyad(D, -factor / wp.ddot(e, e), e, e)
    return D


@wp.func
def friction_advance(F: mat33, m: Any) -> _history:
    e = _elastic(green_strain(isochoric(F)), m)
    stress = f64(2.0) * m[0] * _size(e)
    slid = symmetric_at(m, 2)
    if stress > _DEVIATOR * m[1]:
        slid += (f64(1.0) - _DEVIATOR * m[1] / stress) * e
    return put_symmetric(_history(), 0, slid)


class Friction(Law):
    """Elastic, perfectly plastic branch in the deviator of the isochoric Green strain (J^(-2/3) C - 1)/2.

    It has no volumetric stiffness. As a layer in parallel with an elastic law it adds rate-independent
    hysteresis; several layers with rising yield stresses make a Prandtl-Ishlinskii model. The step's energy
    is that of elastic strain plus the dissipation by sliding, and therefore has a minimum. Stress is
    continuous, the tangent jumps where sliding begins. Meant for strains up to about 0.2, as the yield stress
    holds for the second Piola-Kirchhoff stress.
    """

    name = "friction"
    parameter_names = ("mu_MPa", "yield_MPa")
    positive = parameter_names
    example = (0.4, 0.1)
    whole = False
    history = 6
    split_volume = True
    energy, stress, tangent = map(
        staticmethod,
        split(*of_green_strain(friction_energy, friction_stress, friction_stiffness), None),
    )
    advance = staticmethod(friction_advance)

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear modulus before sliding, and bulk modulus 0, (k, 2) in MPa, of parameters (k, 2)."""
        return np.stack([parameters[:, 0], np.zeros(len(parameters))], axis=1)
