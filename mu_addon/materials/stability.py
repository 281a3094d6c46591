"""Drucker stability of a law: every further increment of strain must need positive work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.law_at_points import evaluate
from .coupon import MODES, equivalent_stretch, principal_stretches, stretch_of_equivalent

POINTS = 101
_PAIRS = ((0, 1), (1, 2), (2, 0))
_EQUAL = 1e-6


@attrs.frozen
class Stability:
    """Least incremental stiffness in MPa of a law at stretches low .. high of a mode, and where it is.

    unstable_at: the stretch nearest to 1 at which it is not positive, or None.
    """

    mode: str
    low: float
    high: float
    least_MPa: float
    least_at: float
    unstable_at: float | None

    @property
    def stable(self) -> bool:
        """True if the incremental stiffness is positive over the whole range."""
        return self.unstable_at is None

    def where(self) -> str:
        """Mode and stretch at which the law is unstable, as text."""
        if self.unstable_at is None:
            return "nowhere"
        side = "at" if self.unstable_at == 1 else "above" if self.unstable_at > 1 else "below"
        return f"in {self.mode.replace('_', ' ')} {side} a stretch of {self.unstable_at:.3g}"


def whole_ranges(reached: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Lowest and highest stretch of every mode, from those of the modes in `reached`.

    Another mode gets a range from 1 to the largest equivalent logarithmic strain of the tested modes.
    """
    far = max(equivalent_stretch(mode, x) for mode, span in reached.items() for x in span)
    return {mode: reached.get(mode, (1.0, float(stretch_of_equivalent(mode, far)))) for mode in MODES}


def check_stability(law: Any, parameters: Array, mode: str, low: float, high: float) -> Stability:
    """Check a law with one row of parameters (count,) along a mode, from stretch `low` to `high`.

    Drucker's postulate in Hill's form: d(tau):d(e) > 0 for every increment de of the logarithmic strain, tau
    the Kirchhoff stress. In principal stretches: the Hessian of the energy by logarithmic strains is positive
    definite, and (tau_a - tau_b)/(e_a - e_b) > 0 for every pair. A law with a separate volumetric part is
    checked at constant volume, for isochoric increments; any other along its own path without lateral stress.
    Sources: Drucker, J. Appl. Mech. 26 (1959) 101; Hill, Proc. R. Soc. A 314 (1970) 457. Raises InputError
    for low and high that are not a range, and as `principal_stretches` does.
    """
    if not 0 < low < high:
        raise InputError(f"stretches from {low:g} to {high:g}", mode, "give 0 < low < high")
    stretch = np.unique(np.append(np.geomspace(low, high, POINTS), 1.0 if low <= 1 <= high else low))
    least = least_stiffness(law, parameters, mode, stretch)
    bad = stretch[~(least > 0)]
    nearest = float(bad[np.argmin(np.abs(np.log(bad)))]) if len(bad) else None
    worst = int(np.argmin(np.where(np.isfinite(least), least, -np.inf)))
    return Stability(mode, low, high, float(least[worst]), float(stretch[worst]), nearest)


def least_stiffness(law: Any, parameters: Array, mode: str, stretch: Array) -> Array:
    """Least of d(tau):d(e)/|de|^2 over all increments, (n,) in MPa, at stretches (n,) along axis 1 of a mode.

    parameters: the law's row (count,). Raises InputError and ConvergenceError as `principal_stretches` does.
    """
    lengths = principal_stretches(law, parameters, mode, stretch)
    n = len(lengths)
    F = np.zeros((n, 3, 3))
    F[:, range(3), range(3)] = lengths
    point = evaluate(law, F, parameters)
    tau = lengths * np.diagonal(point.stress, axis1=1, axis2=2)
    # d tau_a/d e_b = delta_ab tau_a + a b dP_a/db, with P the nominal stress.
    G = point.tangent[:, 0::4, 0::4] * lengths[:, :, None] * lengths[:, None, :]
    G[:, range(3), range(3)] += tau
    e = np.log(lengths)
    values = []
    for a, b in _PAIRS:
        apart = e[:, a] - e[:, b]
        equal = np.abs(apart) < _EQUAL
        quotient = (tau[:, a] - tau[:, b]) / np.where(equal, 1.0, apart)
        values.append(np.where(equal, G[:, a, a] - G[:, a, b], quotient))
    kept = _ISOCHORIC if law.split_volume else np.eye(3)
    H = kept.T @ ((G + G.transpose(0, 2, 1)) / 2) @ kept
    values.append(np.linalg.eigvalsh(H)[:, 0])
    return np.asarray(np.min(values, axis=0))


# Two orthonormal strain increments without change of volume.
_ISOCHORIC = np.array([[1, -1, 0], [1, 1, -2]]).T / np.sqrt([2, 6])
