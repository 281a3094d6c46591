"""Result of a fit of laws, and how its coupons group."""

from __future__ import annotations

import attrs

from ...materials.choice import Choice
from ...materials.coupon import Array, Coupon
from ...materials.fit import Fit
from ...materials.library import Material
from ...measured import Measured


@attrs.frozen(eq=False)
class Fitting:
    """Coupons and the laws fitted to them.

    unseen: share by which each law misses a mode when fitted without it; apart: how far laws differ in modes
    that were not tested, see `disagreement`; compressibility: share by which kappa moves the chosen law's
    stress at the end of its range.
    """

    measured: Measured
    fitted: tuple[Coupon, ...]
    held_out: tuple[Coupon, ...]
    weights: str
    fits: tuple[Fit, ...]
    choice: Choice
    unseen: dict[str, dict[str, float]]
    apart: dict[str, tuple[Array, Array]]
    compressibility: float
    material: Material


def modes(found: Fitting) -> list[str]:
    """Modes that were tested, in the order of the coupons."""
    return list(dict.fromkeys(c.mode for c in (*found.fitted, *found.held_out)))


def tested(found: Fitting, mode: str) -> tuple[list[Coupon], list[Coupon]]:
    """Coupons of a mode, fitted and held out."""
    return [c for c in found.fitted if c.mode == mode], [c for c in found.held_out if c.mode == mode]
