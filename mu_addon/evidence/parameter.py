"""Parameters of models that can be fitted."""

from __future__ import annotations

import math

import attrs

from ..errors import InputError

EVERY = (-math.inf, math.inf)
# Between a parameter's key and the specimen or experiment that its effect belongs to.
OF = " of "
# Times as far from the null a bound is set to see whether it alone excludes an effect; the largest share.
FARTHER, MOST = 3.0, 0.99


@attrs.frozen
class Parameter:
    """A parameter of a model that can be fitted: unit, bounds, source, and `null`, where it has no effect.

    low, high, null and starts are in `unit`. starts: values from which a fit begins. linear: the prediction
    is affine in it, with a slope independent of the other values. spread: standard deviation of prior
    knowledge, in `unit`; inf without any. experiment: name of the only experiment whose prediction depends on
    it; empty for any. plausible: range for a real specimen, in `unit`; a value beyond suggests that a
    column's unit or sign is wrong. Raises InputError where low is not below high, or the null or a start is
    out of bounds.
    """

    name: str
    unit: str
    low: float
    high: float
    null: float
    starts: tuple[float, ...] = ()
    source: str = ""
    linear: bool = False
    spread: float = math.inf
    experiment: str = ""
    plausible: tuple[float, float] = EVERY

    def __attrs_post_init__(self) -> None:
        inside = [self.null, *self.starts]
        if not (self.low < self.high and all(self.low <= v <= self.high for v in inside)):
            raise InputError(
                f"{self.name}: null or a start is out of bounds",
                "effect library",
                f"keep them from {self.low:g} to {self.high:g}",
            )

    def narrowed(self, low: float, high: float) -> Parameter:
        """The same parameter within [low, high] and its own bounds, in its unit.

        Starts outside are dropped; if none is left, the middle of the new bounds takes their place. Raises
        InputError where the null is out of the new bounds.
        """
        low, high = max(self.low, low), min(self.high, high)
        starts = tuple(v for v in self.starts if low <= v <= high)
        if self.starts and not starts:
            starts = (0.5 * (low + high),)
        return attrs.evolve(self, low=low, high=high, starts=starts)

    def farther(self, bound: float) -> float:
        """A bound `FARTHER` times as far from the null, in its unit, where the parameter still has a meaning.

        What is positive stays so, and a share stays below 1.
        """
        if bound * self.null > 0.0:
            far = bound * FARTHER if bound > self.null else bound / FARTHER
        else:
            far = self.null + FARTHER * (bound - self.null) if bound else 0.0
        most = math.inf if self.unit or abs(bound) >= 1.0 else max(MOST, abs(bound))
        return min(max(far, -most), most)

    @property
    def step(self) -> float:
        """Step of a finite difference at the null, in the parameter's unit; negative if `high` is near.

        A thousandth of the range or, if smaller, of the distance from the null to the nearest start.
        """
        away = [abs(v - self.null) for v in self.starts if v != self.null]
        size = 1e-3 * min(self.high - self.low, *away) if away else 1e-3 * (self.high - self.low)
        return size if self.null + size <= self.high else -size


def factor(name: str, start: float, source: str, plausible: tuple[float, float] = EVERY) -> Parameter:
    """A factor less 1, from a hundredth to ten times: one range for effects that act alike on data.

    A rival is not excluded by a narrower range of its own. plausible: range in which it may be named a cause;
    beyond it stays a rival, and keeps a verdict open.
    """
    return Parameter(name, "", -0.99, 9.0, 0.0, (start,), source, plausible=plausible)
