"""Coupons: response of a law to the homogeneous deformations of a tension test.

Modes, with axis 1 pulled: "uniaxial" (2 and 3 free), "equibiaxial" (1 and 2 pulled equally, 3 free) and
"pure_shear" (1 pulled, 2 held, 3 free: a wide, short strip). Free axes bear no stress.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..arrays import Array, float64
from ..design.quantity import in_MPa
from ..errors import ConvergenceError, InputError
from ..fem.law_at_points import evaluate
from ..fem.law_at_points import stress as point_stress
from ..measured import Experiment
from ..measured.kinds import MODES as MODES

_FREE = {"uniaxial": (1, 2), "equibiaxial": (2,), "pure_shear": (2,)}
# Lateral stress taken as zero, as a share of the shear and bulk modulus together.
TOLERANCE = 1e-12
_DIAGONAL = np.array([0, 4, 8])


@attrs.frozen(eq=False)
class Response:
    """Nominal stress (n,) in MPa along axis 1, and the stretches (n, 3) along the three axes."""

    stress_MPa: Array
    stretches: Array


@attrs.frozen(eq=False)
class Coupon:
    """One tensile test in a mode: nominal stress (n,) in MPa at stretches (n,) along axis 1.

    Raises InputError for arrays of different lengths, a stretch that is not positive, or a missing stress,
    and ValueError for an unknown mode.
    """

    name: str
    mode: str = attrs.field(validator=attrs.validators.in_(MODES))
    stretch: Array = attrs.field(converter=float64)
    stress_MPa: Array = attrs.field(converter=float64)

    def __attrs_post_init__(self) -> None:
        if self.stretch.shape != self.stress_MPa.shape or self.stretch.ndim != 1:
            raise InputError(
                f"{len(self.stretch)} stretches and {len(self.stress_MPa)} stresses", f"coupon {self.name!r}"
            )
        if not (np.isfinite(self.stress_MPa).all() and (self.stretch > 0).all()):
            raise InputError("a stretch is not positive or a stress is missing", f"coupon {self.name!r}")

    @classmethod
    def of(cls, experiment: Experiment) -> Coupon:
        """The coupon of an experiment of kind `coupon`: stretch is 1 + strain, kPa become MPa.

        Raises InputError as `Coupon` does.
        """
        return cls(
            experiment.name, str(experiment.mode), 1 + experiment["strain"], in_MPa(experiment["stress_kPa"])
        )


def binned(coupon: Coupon, most: int = 128) -> tuple[Coupon, Array]:
    """A coupon with means of stretch and stress (MPa) in `most` equal bins of stretch, and the counts (k,).

    The counts are of rows in each bin; empty bins are left out. A coupon of up to 2 `most` rows is returned
    unchanged, with counts of 1.
    """
    n = len(coupon.stretch)
    if n <= 2 * most:
        return coupon, np.ones(n)
    edges = np.linspace(coupon.stretch.min(), coupon.stretch.max(), most + 1)
    bins = np.clip(np.searchsorted(edges, coupon.stretch, side="right") - 1, 0, most - 1)
    count = np.bincount(bins, minlength=most)
    kept = count > 0
    means = [np.bincount(bins, x, most)[kept] / count[kept] for x in (coupon.stretch, coupon.stress_MPa)]
    return Coupon(coupon.name, coupon.mode, *means), count[kept].astype(float)


def response(law: Any, parameters: Array, mode: str, stretch: Array) -> Response:
    """Response of a law with one row of parameters (count,) to stretches (n,) along axis 1 of a mode.

    The free stretches make the lateral stress vanish, by Newton's method with the law's own tangent. Raises
    InputError for an unknown mode, a stretch that is not positive, a law with history or with axes oblique to
    the coupon's; ConvergenceError where no such stretches are found.
    """
    stretch = _checked(law, mode, stretch)
    row = np.asarray(parameters, float)
    mu, kappa = law.small_strain(row[None])[0]
    poisson = (3 * kappa - 2 * mu) / (6 * kappa + 2 * mu)
    free = list(_FREE[mode])
    stretches = isochoric_stretches(mode, stretch)
    # A compressible body starts from Hooke's lateral stretch, which the isochoric one is for 1/2.
    stretches[:, free] **= 2 * max(poisson, 0.0)
    limit = TOLERANCE * (mu + kappa)
    for _ in range(100):
        point = evaluate(law, _diagonal(stretches), row)
        lateral = np.diagonal(point.stress, axis1=1, axis2=2)[:, free]
        if not np.isfinite(lateral).all():
            break
        slope = point.tangent[:, _DIAGONAL[free][:, None], _DIAGONAL[free]]
        step = np.linalg.solve(slope, -lateral[:, :, None])[:, :, 0] / stretches[:, free]
        # In logarithms, so that no stretch turns negative, and never more than a fifth at once.
        step *= np.minimum(1.0, 0.2 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        stretches[:, free] *= np.exp(step)
        if (np.abs(lateral) < limit).all() or np.abs(step).max() < 1e-15:
            point = evaluate(law, _diagonal(stretches), row)
            _check_axes(law, point.stress, mu + kappa)
            return Response(point.stress[:, 0, 0].copy(), stretches)
    worst = stretch[np.argmax(np.nan_to_num(np.abs(lateral).max(axis=1), nan=np.inf))]
    raise ConvergenceError(
        f"{law.name}: no lateral stretch without lateral stress was found",
        f"{mode}, stretch {worst:.4g}",
        "keep to the range the law was fitted in, or check its parameters",
    )


def incompressible(law: Any, parameters: Array, mode: str, stretch: Array) -> Array:
    """Nominal stress (n,) in MPa along axis 1 at stretches (n,) along it, at constant volume.

    parameters: one row (count,) of a law that splits the volume off; its bulk modulus has no effect. Raises
    InputError for a law without that split, an unknown mode, or a stretch that is not positive.
    """
    stretches = isochoric_stretches(mode, _checked(law, mode, stretch))
    return isochoric_stress(law, parameters, stretches)


def isochoric_stress(law: Any, parameters: Array, stretches: Array) -> Array:
    """Nominal stress (n,) in MPa along axis 1 at principal stretches (n, 3) of constant volume, axis 3 free.

    parameters: (count,), or (n, count) for each point its own. The pressure follows from the free axis:
    P1 - P3 a3/a1. Raises InputError for a law that does not split the volume off.
    """
    if not law.split_volume:
        raise InputError(f"{law.name} does not split the volume off", "coupon", "use `response`")
    P = point_stress(law, _diagonal(stretches), parameters)
    return np.asarray(P[:, 0, 0] - P[:, 2, 2] * stretches[:, 2] / stretches[:, 0])


def principal_stretches(law: Any, parameters: Array, mode: str, stretch: Array) -> Array:
    """Stretches (n, 3) of a coupon with stretches (n,) along axis 1; parameters: the law's row (count,).

    At constant volume for a law that splits it off, else without lateral stress as in `response`. Raises
    InputError and ConvergenceError as `response` does.
    """
    if law.split_volume:
        return isochoric_stretches(mode, _checked(law, mode, stretch))
    return response(law, parameters, mode, stretch).stretches


def equivalent_stretch(mode: str, stretch: Any) -> Any:
    """The uniaxial stretch with the same equivalent logarithmic strain, sqrt(2/3 e:e), at constant volume.

    stretch: along axis 1 in this mode, a number or an array of any shape.
    """
    return np.exp(_STRAIN[mode] * np.abs(np.log(stretch)))


def stretch_of_equivalent(mode: str, stretch: Any) -> Any:
    """The stretch along axis 1 in this mode with the equivalent logarithmic strain of a uniaxial stretch.

    stretch: at least 1, a number or an array of any shape; the inverse of `equivalent_stretch` in tension.
    """
    return np.exp(np.log(stretch) / _STRAIN[mode])


# sqrt(2/3 e:e) of a logarithmic strain 1 along axis 1.
_STRAIN = {"uniaxial": 1.0, "equibiaxial": 2.0, "pure_shear": 2 / np.sqrt(3)}


def _checked(law: Any, mode: str, stretch: Array) -> Array:
    if mode not in MODES:
        raise InputError(f"unknown mode {mode!r}", "coupon", f"choose one of {', '.join(MODES)}")
    if law.history:
        raise InputError(f"{law.name} depends on its history", mode, "its stress needs a path in time")
    stretch = np.atleast_1d(np.asarray(stretch, float))
    if not (np.isfinite(stretch) & (stretch > 0)).all():
        raise InputError("a stretch is not positive", mode, "stretch is length over initial length")
    return stretch


def isochoric_stretches(mode: str, stretch: Array) -> Array:
    """Principal stretches (n, 3) of a mode at constant volume, at stretches (n,) along axis 1."""
    one = np.ones_like(stretch)
    rest = {
        "uniaxial": (stretch**-0.5, stretch**-0.5),
        "equibiaxial": (stretch, stretch**-2.0),
        "pure_shear": (one, 1 / stretch),
    }[mode]
    return np.stack([stretch, *rest], axis=1)


def _diagonal(stretches: Array) -> Array:
    F = np.zeros((len(stretches), 3, 3))
    F[:, range(3), range(3)] = stretches
    return F


def _check_axes(law: Any, stress: Array, modulus: float) -> None:
    """Raise InputError unless the law's axes are the coupon's, so that it stays a brick."""
    shear = np.abs(stress - stress * np.eye(3)).max()
    if shear > 1e-9 * modulus:
        raise InputError(
            f"{law.name}: stretching along the coupon's axes makes a shear stress of {shear:.3g} MPa",
            "coupon",
            "rotate the law's axes to the coupon's",
        )
