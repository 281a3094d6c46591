"""A law for the analysis mesh: foam with struts along the diagonals that follows a lattice's cell."""

from __future__ import annotations

import itertools
from typing import Any

import attrs
import numpy as np
from scipy.optimize import least_squares

from ..arrays import Array
from ..design.quantity import in_kPa
from ..errors import InputError
from ..fem.lattice_law import LatticeLaw
from ..fem.laws import CubicShear, DiagonalStretch, Foam
from .foam_response import ellipticity, small_strain, uniaxial
from .stress_strain_curve import Curve

NAME = "foam + cubic shear + diagonal stretch"
# A lateral misfit of this part of the largest lateral strain weighs as much as a misfit of stress of 0.3 of
# it. Equal weights would give up the stress for sides that no foam law follows: struts of constant length
# keep the sum of squared stretches, so that the volume shrinks under tension too.
LATERAL_WEIGHT = 0.3
# Exponents; a curve leaves gamma undetermined where the volume grows, and beyond -12 the law would answer a
# growth by a third with more stress than the struts' own stretch makes of it.
LARGEST_EXPONENT = 20.0
LARGEST_GAMMA = 12.0
_LEAST_EXPONENT = 0.01
# Moduli of tension and compression apart make the tangent jump at rest: only for a misfit this much smaller,
# where that with one is above what a fit is good for.
_WORTH_A_JUMP = 0.5
_GOOD_ENOUGH = 0.02
# Four orders of magnitude below and above what the tensor has.
_WIDEST = np.log(1e4)
_STARTS = tuple(itertools.product((-2.0, 5.0), (3.0, 12.0), (-4.0, 3.0)))
# How far the limits of stability are looked for, and in how many steps.
_FARTHEST = 0.6
_STEPS = 121
_BESIDE = 2e-3
_STRUTS = (CubicShear, DiagonalStretch)


@attrs.frozen
class Misfit:
    """Root mean squares of a fit's residuals, as parts of the largest value on that side.

    tension, compression: of the nominal stress; lateral: of the lateral strain.
    """

    tension: float
    compression: float
    lateral: float


@attrs.frozen(eq=False)
class FoamFit:
    """A foam, a cubic shear and a diagonal stretch in parallel, and how well they fit a cell.

    parameters (6,): as Foam names them; shear_MPa and diagonal_MPa: G and C of the others. stretch: the range
    of the curve; E_MPa, poisson and C44_MPa: the law's own at small strain along an axis, and cell_E_MPa,
    cell_poisson and cell_C44_MPa the cell's; stable_shear and stable_pressed: the simple shear between two
    axes, and the strain on all sides (compression positive), up to which no band of localised strain can
    form.
    """

    parameters: Array
    shear_MPa: float
    diagonal_MPa: float
    stretch: tuple[float, float]
    misfit: Misfit
    E_MPa: float
    poisson: float
    C44_MPa: float
    cell_E_MPa: float
    cell_poisson: float
    cell_C44_MPa: float
    stable_shear: float
    stable_pressed: float

    @property
    def law(self) -> LatticeLaw:
        """The law for the analysis mesh, valid in the range `stretch`."""
        return lattice_law(self.parameters, self.shear_MPa, self.diagonal_MPa, self.stretch)

    def uniaxial(self, stretch: Array) -> tuple[Array, Array]:
        """Nominal stress (k,) in MPa and lateral stretch (k,) under uniaxial stress along an axis.

        stretch (k,): along the load.
        """
        return uniaxial(self.parameters, stretch, self.diagonal_MPa)


def lattice_law(
    parameters: Array, shear_MPa: float, diagonal_MPa: float, stretch: tuple[float, float]
) -> LatticeLaw:
    """Law of foam with parameters (6,) as `Foam` names them, cubic shear and diagonal stretch in MPa.

    Shear or diagonal of 0 are left out. stretch: smallest and largest of the fit. Raises InputError for
    parameters that are not admissible.
    """
    layers: list[tuple[Any, Array]] = [(Foam, np.asarray(parameters, float))]
    layers += [
        (law, np.array([value]))
        for law, value in zip(_STRUTS, (shear_MPa, diagonal_MPa), strict=True)
        if value
    ]
    return LatticeLaw(NAME, tuple(layers), stretch)


def fit_foam(curve: Curve, C11_MPa: float, C12_MPa: float, C44_MPa: float) -> FoamFit:
    """Foam with cubic shear that follows a cell's curve along an axis, of free sides, and its tensor.

    C11_MPa, C12_MPa, C44_MPa: of the cell at small strain. Least squares of stress, scaled by its largest
    value in tension and in compression, and of lateral strain, from several starts. The axes are coupled
    either by the cell's C12 as diagonal stretch, without coupling in the foam, or by the foam's own fitted
    volumetric part: the one with the smaller residual. The cubic shear adds the C44 that the foam lacks; if
    the foam's C44 is larger, C44 is not matched. Raises InputError for a curve that leaves a side of 1
    undetermined, and where the law found is not stable.
    """
    _sides(curve)
    fits = {
        (diagonal, tied): _Form(curve, C11_MPa, C12_MPa, diagonal, tied).best()
        for diagonal in (True, False)
        for tied in (True, False)
    }
    with_one, apart = (min(fits[d, tied][0] for d in (True, False)) for tied in (True, False))
    one_modulus = with_one <= _GOOD_ENOUGH or apart >= _WORTH_A_JUMP * with_one
    diagonal = fits[True, one_modulus][0] <= fits[False, one_modulus][0]
    parameters = fits[diagonal, one_modulus][1]
    axial = C12_MPa if diagonal else 0.0
    shear = max(C44_MPa - (parameters[0] + parameters[2]) / 2, 0.0)
    low, high = float(curve.stretch[0]), float(curve.stretch[-1])
    law = lattice_law(parameters, shear, axial, (low, high))
    require_stable(law)
    E, poisson, C44 = small_strain(parameters, shear, axial)
    return FoamFit(
        parameters,
        shear,
        axial,
        (low, high),
        misfit(curve, parameters, axial),
        E,
        poisson,
        C44,
        (C11_MPa - C12_MPa) * (C11_MPa + 2 * C12_MPa) / (C11_MPa + C12_MPa),
        C12_MPa / (C11_MPa + C12_MPa),
        C44_MPa,
        stable_shear(law),
        stable_pressed(law),
    )


def misfit(curve: Curve, parameters: Array, diagonal_MPa: float = 0.0) -> Misfit:
    """Misfit to a curve of a foam of parameters (6,), with diagonal stretch in MPa.

    Raises InputError for a curve with fewer than 3 points on a side of stretch 1, or with held sides.
    """
    side = _sides(curve)
    stress, lateral = _residuals(curve, parameters, diagonal_MPa)
    tension, compression = (_rms(stress[s]) for s in side)
    return Misfit(tension, compression, _rms(lateral))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _sides(curve: Curve) -> tuple[Array, Array]:
    """Masks (k,) of the points under tension and of those under compression."""
    sides = curve.stretch > 1, curve.stretch < 1
    for name, side in zip(("tension", "compression"), sides, strict=True):
        if side.sum() < 3:
            raise InputError(
                f"a curve with {side.sum()} points under {name} does not determine a foam law",
                "fit of the lattice's law",
                "give at least 3 on each side of stretch 1",
            )
    return sides


def _residuals(curve: Curve, parameters: Array, diagonal_MPa: float) -> tuple[Array, Array]:
    """Residuals of stress and lateral strain (k,), over their largest value on each side of stretch 1."""
    side = curve.stretch > 1, curve.stretch < 1
    stress, lateral = uniaxial(parameters, curve.stretch, diagonal_MPa)
    largest = np.where(side[0], *(np.abs(curve.stress_MPa[s]).max() for s in side))
    measured = curve.lateral.mean(axis=1)
    return (stress - curve.stress_MPa) / largest, (lateral - measured) / np.abs(measured - 1).max()


@attrs.frozen(eq=False)
class _Form:
    """One form of the law to fit: with diagonal stretch or without, both sides of 1 tied or separate."""

    curve: Curve
    C11_MPa: float
    C12_MPa: float
    diagonal: bool
    tied: bool

    def parameters(self, x: Array) -> Array:
        """Foam's (6,) of unknowns: ln mu, two exponents, ln lambda and gamma, ln mu of compression."""
        rest = list(x[3:])
        volume, gamma = (0.0, 1.0) if self.diagonal else (np.exp(rest.pop(0)), rest.pop(0))
        compression = x[0] if self.tied else rest.pop(0)
        return np.array([np.exp(x[0]), x[1], np.exp(compression), x[2], volume, gamma])

    def residuals(self, x: Array) -> Array:
        """Residuals of stress and lateral strain; tension and compression have equal weight."""
        axial = self.C12_MPa if self.diagonal else 0.0
        stress, lateral = _residuals(self.curve, self.parameters(x), axial)
        side = self.curve.stretch > 1, self.curve.stretch < 1
        share = np.select(side, [1 / np.sqrt(s.sum()) for s in side], 0.0)
        return np.concatenate([share * stress, LATERAL_WEIGHT / len(lateral) ** 0.5 * lateral])

    def best(self) -> tuple[float, Array]:
        """Root of the sum of squares, and parameters (6,), of the best of several starts."""
        mu = np.log((self.C11_MPa - self.C12_MPa) / 2)
        centre = np.array([mu, 0.0, 0.0, mu, 0.0, mu])
        width = np.array([_WIDEST, LARGEST_EXPONENT, LARGEST_EXPONENT, _WIDEST, LARGEST_GAMMA, _WIDEST])
        kept = np.array([True, True, True, not self.diagonal, not self.diagonal, not self.tied])
        bounds = (centre - width)[kept], (centre + width)[kept]
        # The lateral strain at large stretch mostly asks for less than the tensor's lambda.
        starts = {tuple(np.array([mu, t, c, mu + 1, gamma, mu])[kept]) for t, c, gamma in _STARTS}
        found = [
            least_squares(self.residuals, start, bounds=bounds, x_scale="jac") for start in sorted(starts)
        ]
        best = min(found, key=lambda one: one.cost)
        parameters = self.parameters(best.x)
        for i in (1, 3, 5):
            if abs(parameters[i]) < _LEAST_EXPONENT:
                parameters[i] = _LEAST_EXPONENT
        return float(np.sqrt(2 * best.cost)), parameters


def require_stable(law: LatticeLaw) -> None:
    """Raise InputError where a law of foam, cubic shear and diagonal stretch is not stable within its range.

    Along an axis with free sides the force must grow with the stretch and the law must be strongly elliptic.
    Near rest it must be strongly elliptic in every direction. It need not be under larger shear or
    compression from all sides, where slender struts buckle: `stable_shear` and `stable_pressed` are the
    limits.
    """
    low, high = law.stretch
    along = np.linspace(low, high, 81)
    struts = [value for kind, (value, *_) in law.layers if kind is DiagonalStretch]
    force, lateral = uniaxial(law.layers[0][1], along, sum(struts))
    remedy = "fit a smaller range of stretch, or check the curve it was fitted to"
    falling = np.flatnonzero(np.diff(force) <= 0)
    if len(falling):
        raise InputError(
            f"the lattice's law is unstable: its force falls from stretch {along[falling[0]]:.3g} on",
            "uniaxial stress along an axis",
            remedy,
        )
    beside = [np.eye(3)[list(p)].sum(axis=0) for n in (1, 2, 3) for p in itertools.combinations(range(3), n)]
    little = 1 + _BESIDE * np.array([sign * d for d in beside for sign in (-1, 1)])
    F = np.concatenate([np.stack([along, lateral, lateral], axis=1)[::4], little])[:, :, None] * np.eye(3)
    least = ellipticity(law, F)
    worst = int(least.argmin())
    if least[worst] <= 0:
        place = " x ".join(f"{s:.3g}" for s in np.diagonal(F[worst]))
        raise InputError(
            f"the lattice's law is unstable: it loses ellipticity, by {in_kPa(-least[worst]):.3g} kPa",
            f"stretches {place} along the axes",
            remedy,
        )


def stable_shear(law: LatticeLaw) -> float:
    """The simple shear between two axes, up to 0.6, up to which a lattice's law stays strongly elliptic.

    In steps of 0.005. Shear puts the struts of one diagonal under compression, where only the foam resists.
    """
    amounts = np.linspace(0, _FARTHEST, _STEPS)
    F = np.tile(np.eye(3), (len(amounts), 1, 1))
    F[:, 0, 1] = amounts
    return _first_lost(law, amounts, F)


def stable_pressed(law: LatticeLaw) -> float:
    """The equal compression on all sides up to which a law stays strongly elliptic.

    A nominal strain, up to 0.6, in steps of 0.005.
    """
    amounts = np.linspace(0, _FARTHEST, _STEPS)
    return _first_lost(law, amounts, (1 - amounts)[:, None, None] * np.eye(3))


def _first_lost(law: LatticeLaw, amounts: Array, F: Array) -> float:
    lost = np.flatnonzero(ellipticity(law, F) <= 0)
    return float(amounts[max(lost[0] - 1, 0)] if len(lost) else amounts[-1])
