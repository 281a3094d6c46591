"""Hashin and Shtrikman's upper bounds on the moduli of an isotropic arrangement of given phases."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError


@attrs.frozen
class Moduli:
    """Bulk and shear modulus in MPa of an isotropic material."""

    bulk: float
    shear: float


def hashin_shtrikman(shares: ArrayLike, bulk: ArrayLike, shear: ArrayLike) -> tuple[Moduli, Moduli]:
    """Lower and upper bound of an isotropic mixture of isotropic phases.

    shares (k,) of the volume, summing to 1; bulk and shear moduli (k,) in MPa, both 0 for a void. The means
    over all directions (Voigt's) of an anisotropic mixture obey the upper bound too. Raises InputError for
    shares that do not sum to 1 or negative moduli.

    >>> low, high = hashin_shtrikman([0.5, 0.5], bulk=[2.0, 0.0], shear=[1.0, 0.0])
    >>> low.bulk, round(high.bulk, 3)
    (0.0, 0.571)

    Sources: Hashin and Shtrikman, J. Mech. Phys. Solids 11 (1963) 127, as written for several phases by
    Walpole, ibid. 14 (1966) 151; for anisotropic mixtures Willis, ibid. 25 (1977) 185.
    """
    f, K, G = _phases(shares, bulk, shear)
    return _bound(f, K, G, K.min(), G.min()), _bound(f, K, G, K.max(), G.max())


def _bound(f: Array, K: Array, G: Array, bulk: float, shear: float) -> Moduli:
    """The bound of a reference medium no softer, or no stiffer, than every phase."""
    if shear == 0.0:
        return Moduli(_harmonic(f, K, 0.0), 0.0)
    constraint = shear * (9 * bulk + 8 * shear) / (6 * (bulk + 2 * shear))
    return Moduli(_harmonic(f, K, 4 / 3 * shear), _harmonic(f, G, constraint))


def _harmonic(f: Array, moduli: Array, constraint: float) -> float:
    present = f > 0
    stiff = moduli[present] + constraint
    if (stiff == 0).any():
        return 0.0
    return float(1.0 / (f[present] / stiff).sum() - constraint)


def _phases(shares: ArrayLike, bulk: ArrayLike, shear: ArrayLike) -> tuple[Array, Array, Array]:
    f, K, G = (np.atleast_1d(np.asarray(a, float)) for a in (shares, bulk, shear))
    if abs(f.sum() - 1) > 1e-9 or (f < -1e-12).any():
        raise InputError(f"shares of phases sum to {f.sum():.6g}", "bounds", "give shares that sum to 1")
    if (K < 0).any() or (G < 0).any():
        raise InputError("a phase has a negative modulus", "bounds", "give moduli of stable phases")
    return f, K, G
