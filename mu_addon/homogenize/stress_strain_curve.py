"""Curve of a virtual test, and moduli by procedures that differ because the curve is not straight."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array, float64
from ..errors import InputError


@attrs.frozen(eq=False)
class Curve:
    """Uniaxial response (k,) in ascending stretch, the undeformed state (1, 0) among it.

    stretch: length over initial length along z; stress_MPa: force over initial area, tension positive;
    lateral (k, 2): stretches along x and y, 1 where they were held. Raises InputError where shapes differ or
    stretches do not ascend.
    """

    stretch: Array = attrs.field(converter=float64)
    stress_MPa: Array = attrs.field(converter=float64)
    lateral: Array = attrs.field(converter=float64)

    def __attrs_post_init__(self) -> None:
        k = len(self.stretch)
        if self.stress_MPa.shape != (k,) or self.lateral.shape != (k, 2):
            raise InputError(f"a curve of {k} stretches has {self.stress_MPa.shape} stresses")
        if not (np.diff(self.stretch) > 0).all():
            raise InputError("the stretches of a curve do not ascend", "virtual test", "sort its points")

    @property
    def strain(self) -> Array:
        """Nominal strain (k,), compression negative."""
        return self.stretch - 1.0


# The paper says no more than "compression to 40 % strain". A slope over 0 to 10 % is near what small-strain
# analysis takes for a modulus, and a test's seating and noise hardly touch it.
DEFAULT = "slope 0-10 %"
PROCEDURES = ("initial tangent", DEFAULT, "slope 0-40 %", "secant at 40 %")

# Points of an even ramp that a least-squares line is laid through.
_RAMP = 401


def modulus(curve: Curve, procedure: str = DEFAULT) -> float:
    """Modulus in MPa of the compressed side of a curve, by one of PROCEDURES.

    "initial tangent": slope at rest of the polynomial through it and the next three points. "slope a-b %": of
    the least-squares line with an intercept, through the curve sampled evenly in strain as in a test at
    constant rate; the curve is a piecewise cubic without overshoot. "secant at b %": stress over strain.
    Raises InputError for an unknown procedure or too short a curve.
    """
    if procedure not in PROCEDURES:
        raise InputError(
            f"no procedure {procedure!r} for a modulus", "compression test", f"choose {', '.join(PROCEDURES)}"
        )
    strain, stress = _compressed(curve)
    if procedure == "initial tangent":
        return _tangent(strain[:4], stress[:4])
    reach = 0.1 if procedure == DEFAULT else 0.4
    if strain[-1] < reach - 1e-9:
        raise InputError(
            f"the curve ends at {100 * strain[-1]:.4g} % compression, before {100 * reach:g} %",
            f"modulus by {procedure!r}",
            "compress further or choose another procedure",
        )
    if "secant" in procedure:
        return float(_sampled(strain, stress, np.array([reach]))[0] / reach)
    return _slope(strain, stress, reach)


def moduli(curve: Curve) -> dict[str, float]:
    """Compression moduli in MPa by every procedure of `PROCEDURES` that the curve is long enough for.

    Raises InputError for a curve without a compressed side that starts from rest.
    """
    _, reach = _compressed(curve)[0][[0, -1]]
    needed = dict(zip(PROCEDURES, (0.0, 0.1, 0.4, 0.4), strict=True))
    return {p: modulus(curve, p) for p in PROCEDURES if reach >= needed[p] - 1e-9}


def _compressed(curve: Curve) -> tuple[Array, Array]:
    """Strain and stress, compression positive, from rest on, (k,) ascending."""
    side = curve.stretch <= 1.0
    strain, stress = -curve.strain[side][::-1], -curve.stress_MPa[side][::-1]
    if len(strain) < 2 or strain[0] != 0.0:
        raise InputError("a curve has no compressed side that starts from rest", "modulus")
    return strain, stress


def _tangent(strain: Array, stress: Array) -> float:
    fit = np.polynomial.Polynomial.fit(strain / strain[-1], stress, len(strain) - 1, domain=[-1, 1])
    return float(fit.deriv()(0.0) / strain[-1])


def _sampled(strain: Array, stress: Array, at: Array) -> Array:
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(strain, stress)(np.minimum(at, strain[-1])))


def _slope(strain: Array, stress: Array, reach: float) -> float:
    at = np.linspace(0.0, reach, _RAMP)
    values = _sampled(strain, stress, at)
    return float(((at - at.mean()) * values).sum() / ((at - at.mean()) ** 2).sum())
