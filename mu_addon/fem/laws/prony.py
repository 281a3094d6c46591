"""Finite linear viscoelasticity: a Yeoh law with three relaxing branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import warp as wp

from ...arrays import Array
from .isochoric import split
from .law import Law
from .tensors import THIRD, add_left, f64, isochoric, mat33, mat99, put_symmetric, symmetric_at
from .yeoh import Yeoh, yeoh_parts, yeoh_slope

_BRANCHES = 3
_COUNT = 4 + 2 * _BRANCHES
_HISTORY = 6 * (_BRANCHES + 1)
_FIRST = wp.constant(_COUNT)
_DT = wp.constant(_COUNT + _HISTORY)

_history = wp.types.vector(length=_HISTORY, dtype=wp.float64)


_yeoh_energy, _yeoh_stress, _yeoh_tangent = yeoh_parts


@wp.func
def _decay(branch: int, m: Any) -> wp.float64:
    return wp.exp(-m[_DT] / m[5 + 2 * branch])


@wp.func
def _gain(branch: int, m: Any) -> wp.float64:
    """Share of a stress increment, uniform in a step, that a branch keeps: beta (1 - e^-x)/x, x = dt/tau."""
    x = m[_DT] / m[5 + 2 * branch]
    share = f64(1.0)
    if x > f64(1.0):
        share = (f64(1.0) - wp.exp(-x)) / x
    elif x > f64(0.0):
        # The same, without its cancellation for short steps.
        share = wp.exp(-f64(0.5) * x) * wp.sinh(f64(0.5) * x) / (f64(0.5) * x)
    return m[4 + 2 * branch] * share


@wp.func
def _instant(m: Any) -> wp.float64:
    """Stiffness of the step over the long-term stiffness."""
    total = f64(1.0)
    for i in range(wp.static(_BRANCHES)):
        total += _gain(i, m)
    return total


@wp.func
def _remembered(m: Any) -> mat33:
    """Second Piola-Kirchhoff stress of the branches if the elastic stress returned to 0 in this step."""
    H = mat33()
    for i in range(wp.static(_BRANCHES)):
        H += _decay(i, m) * symmetric_at(m, _FIRST + 6 + 6 * i) - _gain(i, m) * symmetric_at(m, _FIRST)
    return H


@wp.func
def prony_energy(F: mat33, m: Any) -> wp.float64:
    strain = f64(0.5) * (wp.transpose(F) * F - wp.identity(3, dtype=f64))
    return _instant(m) * _yeoh_energy(F, m) + wp.ddot(_remembered(m), strain)


@wp.func
def prony_stress(F: mat33, m: Any) -> mat33:
    return _instant(m) * _yeoh_stress(F, m) + F * _remembered(m)


@wp.func
def prony_tangent(F: mat33, m: Any) -> mat99:
    return add_left(_instant(m) * _yeoh_tangent(F, m), _remembered(m))


@wp.func
def prony_advance(F: mat33, m: Any) -> _history:
    C = wp.transpose(isochoric(F)) * isochoric(F)
    slope = yeoh_slope(wp.trace(C), f64(0.0), m)
    S = (f64(2.0) * slope[0]) * (wp.identity(3, dtype=f64) - (THIRD * wp.trace(C)) * wp.inverse(C))
    out = put_symmetric(_history(), 0, S)
    for i in range(wp.static(_BRANCHES)):
        Q = _decay(i, m) * symmetric_at(m, _FIRST + 6 + 6 * i)
        out = put_symmetric(out, 6 + 6 * i, Q + _gain(i, m) * (S - symmetric_at(m, _FIRST)))
    return out


class Prony(Law):
    """Viscoelastic law: a Yeoh law for slow loading, and branches that relax with times tau_i in s.

    Each branch carries an isochoric second Piola-Kirchhoff stress Q with dQ/dt + Q/tau = beta dS/dt, S of the
    Yeoh law. The instantaneous stiffness is 1 + sum of beta_i times the long-term one; beta is g/(1 - sum of
    g) of relative moduli g. Stress taken as linear in time within a step, which makes any step stable. A
    branch that is not wanted has beta 0. Branches are linear in stress: valid for stretches where the shape
    of the Yeoh law does not depend on the rate. Volume change is elastic. Source: Simo, Comput. Methods Appl.
    Mech. Eng. 60 (1987) 153.
    """

    name = "Prony"
    parameter_names = (*Yeoh.parameter_names, "beta1", "tau1_s", "beta2", "tau2_s", "beta3", "tau3_s")
    positive, from_zero = ("tau1_s", "tau2_s", "tau3_s"), ("beta1", "beta2", "beta3")
    example = (*Yeoh.example, 0.5, 1.0, 0.3, 10.0, 0.0, 1.0)
    builds_on = "Yeoh"
    wall = """
    prony_g1 | 0 | | 0 to 0.95 | share of the shear modulus at once that relaxes in branch 1 \
        | assumed: none unless a relaxation test says otherwise
    prony_tau1_s | 1 | s | 1e-4 to 1e7 | relaxation time of branch 1 \
        | assumed: decades around a grasp of some seconds
    prony_g2 | 0 | | 0 to 0.95 | share of the shear modulus at once that relaxes in branch 2 \
        | assumed: none unless a relaxation test says otherwise
    prony_tau2_s | 10 | s | 1e-4 to 1e7 | relaxation time of branch 2 \
        | assumed: decades around a grasp of some seconds
    prony_g3 | 0 | | 0 to 0.95 | share of the shear modulus at once that relaxes in branch 3 \
        | assumed: none unless a relaxation test says otherwise
    prony_tau3_s | 100 | s | 1e-4 to 1e7 | relaxation time of branch 3 \
        | assumed: decades around a grasp of some seconds
    """
    wall_text = "relaxes with time"
    # The long-term modulus is what the shares leave: with all of it relaxing there is none.
    wall_total = ("prony_g1", "prony_g2", "prony_g3", 0.95)
    history = _HISTORY
    split_volume = True
    bulk = 3
    energy, stress, tangent = map(staticmethod, split(prony_energy, prony_stress, prony_tangent, bulk))
    advance = staticmethod(prony_advance)

    @classmethod
    def row_of_wall(cls, wall: Any, mu_MPa: float, kappa_MPa: float) -> Sequence[float]:
        """Parameters for long-term shear and bulk modulus in MPa: beta = g/(1 - sum of g)."""
        shares = [getattr(wall, f"prony_g{i}") for i in range(1, _BRANCHES + 1)]
        rest = 1 - sum(shares)
        row = list(Yeoh.row_of_wall(wall, mu_MPa, kappa_MPa))
        for i, g in enumerate(shares, 1):
            row += [g / rest, getattr(wall, f"prony_tau{i}_s")]
        return row

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Long-term shear modulus 2 c1 and kappa, (k, 2) in MPa, of parameters (k, 10)."""
        return Yeoh.small_strain(parameters)

    @classmethod
    def valid(cls, parameters: Array) -> None:
        """Raise InputError unless the Yeoh law is valid, all tau > 0 in s and all beta >= 0.

        parameters: (k, 10), in the order of `parameter_names`.
        """
        Yeoh.valid(parameters[:, :4])
        super().valid(parameters)
