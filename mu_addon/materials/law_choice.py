"""Choice of a law among those that were fitted, and the laws tied with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .coupon import Coupon
from .fit import Fit, ranges
from .stability import whole_ranges

# Laws within this of the best Akaike criterion are as good, as is customary (Burnham and Anderson, 2002).
AIC_TIE = 2.0
# Laws that miss what was held out by up to this factor more than the best are as good.
HELD_OUT_TIE = 1.1


@attrs.frozen(eq=False)
class Choice:
    """The chosen law, the laws tied with it, and the scores by name of the law, smaller is better.

    by: "held out", the relative error on data that were not fitted, or "AICc".
    """

    chosen: Fit
    tied: tuple[Fit, ...]
    by: str
    scores: Mapping[str, float]


def choose(fits: Sequence[Fit]) -> Choice:
    """The stable law with the smallest error on held-out coupons or, without any, with the smallest AICc.

    Laws that miss their own fitted data are considered only if all laws do: a straight line may pass near a
    held-out curve by chance. Of tied laws the one with the fewest parameters is chosen. AICc takes the number
    of independent values from the law that fits best, whose residuals are noise if any are. Raises InputError
    where no law is stable. Sources: Hurvich and Tsai, Biometrika 76 (1989) 297; Burnham and Anderson, 2002,
    for ties.
    """
    stable = [f for f in fits if f.stable]
    if not stable:
        why = "; ".join(f"{f.form.title}: {f.instability()}" for f in fits)
        raise InputError("no fitted law is stable", why, "fit a narrower range, or Ogden laws, which are")
    by = "held out" if np.isfinite(stable[0].held_out()) else "AICc"
    n = min(stable, key=lambda f: f.rss).n_effective
    scores = {f.form.name: f.held_out() if by == "held out" else f.aicc(n) for f in stable}
    sound = [f for f in stable if f.follows] or stable
    best = min(scores[f.form.name] for f in sound)
    limit = HELD_OUT_TIE * best if by == "held out" else best + AIC_TIE
    near = [f for f in sound if scores[f.form.name] <= limit]
    chosen = min(near, key=lambda f: (f.form.count, scores[f.form.name]))
    return Choice(chosen, tuple(f for f in near if f is not chosen), by, scores)


def disagreement(fits: Sequence[Fit], coupons: Sequence[Coupon]) -> dict[str, tuple[Array, Array]]:
    """For each mode without a coupon: stretches (5,), and the laws' largest over smallest stress there (5,).

    Compared are the stable laws that miss no fitted coupon, at stretches up to the largest logarithmic strain
    of the coupons. Empty where fewer than two such laws are left.
    """
    good = [f for f in fits if f.stable and f.follows]
    have = ranges(coupons)
    found = {}
    for mode, (_, high) in whole_ranges(have).items() if len(good) > 1 else ():
        if mode not in have:
            stretch = np.geomspace(1, high, 6)[1:]
            stress = np.array([f.stress(mode, stretch) for f in good])
            found[mode] = (stretch, stress.max(axis=0) / stress.min(axis=0))
    return found
