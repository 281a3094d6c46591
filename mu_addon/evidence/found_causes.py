"""Result of a search for causes: the base model, the chosen one, its causes and their rivals."""

from __future__ import annotations

from collections.abc import Iterable

import attrs

from .effect import Effect
from .fit import Fit
from .residual_tests.dependence import Dependence
from .residual_tests.table import structure

# False-positive probability of naming any effect of the library.
FALSE_ALARM_RATE = 5e-4
# Rivals within this delta chi squared (99 % for two parameters) cannot be distinguished.
RIVAL_DELTA_CHI2 = 9.2
# Share of an effect's amplitude by which another valid law of its mechanism may differ from the library's: an
# effect with a smaller gain beside it is not named.
LAW = 0.05
# Share of what a model leaves beyond noise by which a rival's fit may differ from it.
UNKNOWN = 0.1
# Between the titles of two effects that are one rival together.
TOGETHER = " with "
# At the end of a rival's title that a bound of its own alone excludes.
BEYOND = " beyond its bound"


def not_distinguished(chi2: float, values: int) -> float:
    """Rise of chi squared up to which a rival is not excluded, beside a fit of chi squared to so many values.

    A misfit that no law explains may as well be another law's: a leak was excluded by 33 of 1450 on 982.
    """
    return max(RIVAL_DELTA_CHI2, UNKNOWN * (chi2 - values))


def effects_in(titles: Iterable[str]) -> tuple[str, ...]:
    """Names of the effects in rivals' titles, each once."""
    return tuple(dict.fromkeys(t.partition(" ")[0] for title in titles for t in title.split(TOGETHER)))


@attrs.frozen(eq=False)
class Cause:
    """One effect of the chosen model.

    p_value: probability that by noise alone any effect of the library gains as much. loss: rise of chi
    squared when the effect is removed and the rest fitted again. rivals: titles of effects whose fit in its
    place is indistinguishable, best first; with `BEYOND` where that is so with another bound.
    """

    effect: Effect
    p_value: float
    loss: float
    rivals: tuple[str, ...]


@attrs.frozen(eq=False)
class Selection:
    """The base model, the chosen one, its causes, and the residuals of both.

    singles: the fit of every single effect, best first. p_best: p-value (a probability) of the best single
    effect. doubted: why a model was not accepted, else empty. table: `strict_table` of the chosen model's
    residual. table_base: `dependence_table` of the base model; by the strict tests if no cause was found.
    wider: fits of effects of one owner, or that differ among owners. excused: reason why remaining structure
    does not count.
    """

    base: Fit
    chosen: Fit
    causes: tuple[Cause, ...]
    singles: tuple[Fit, ...]
    table_base: tuple[Dependence, ...]
    table: tuple[Dependence, ...]
    p_best: float
    doubted: str = ""
    wider: tuple[Fit, ...] = ()
    excused: str = ""

    @property
    def left(self) -> tuple[str, ...]:
        """Names of quantities that the residual of the chosen model still depends on (`structure`)."""
        return () if self.excused else structure(self.table)
