"""The verdict on a folder of measured data: cause, confidence, gain, and next measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import attrs

from ..measured import Experiment
from .effect import Effect, Parameter
from .fit import Fit, Fitter
from .fitted_zeros import FittedZeros
from .found_causes import BEYOND, TOGETHER, Cause, Selection, effects_in
from .gain_on_unseen import Gain
from .hypotheses import ranked
from .main_causes import share_taken
from .next_experiment import Proposal
from .noise import Source
from .plausibility import at_a_bound
from .record import Record
from .sensitivity import ABSORBED, SEEN, Sensitivity, best_seen

KINDS = ("none", "named", "ambiguous", "unidentifiable", "unexplained")
# Of what the best effect takes, what another must take for the verdict to turn on it, and at a bound.
NEAR, SOME = 0.75, 0.5
# A nuisance this many spreads from its prior value is no longer only a nuisance.
UNLIKELY = 3.0


@attrs.frozen(eq=False)
class Verdict:
    """Verdict of the data on the model: the causes named, their rivals, the gain, the next experiment.

    kind: one of `KINDS`. experiments: all of them, their drives freed of gauge noise
    (`drive.denoised_drives`). sources: noise by group of series. intervals: 95 % bounds by key, in the
    parameters' units. identifiability: effects that these data cannot show, with the reason. set_aside: texts
    on readings left out (`readings.wrong_readings`). refused: why tried models have no prediction, by the
    titles of their effects. share_taken: of the base model's misfit by the chosen one; a verdict `named` or
    `ambiguous` may leave structure (`main_causes.mainly`). nearest: title of the best single explanation,
    named or not, and its share of the misfit. far: nuisances far from prior knowledge, the farthest first.
    zeros: of a load cell, if they hide an error. `as_json` is the content of verdict.json.
    """

    kind: str
    selection: Selection
    seen: tuple[Sensitivity, ...]
    sources: dict[str, Source]
    record: Record
    gain: Gain
    proposal: Proposal | None
    identifiability: dict[str, str]
    intervals: dict[str, tuple[float, float]]
    experiments: tuple[Experiment, ...]
    set_aside: tuple[str, ...] = ()
    refused: Mapping[str, str] = MappingProxyType({})
    share_taken: float = 0.0
    nearest: tuple[str, float] | None = None
    far: tuple[Parameter, ...] = ()
    zeros: FittedZeros | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Effects named, the most needed first; none unless the verdict is `named` or `ambiguous`."""
        return (
            tuple(c.effect.name for c in self.selection.causes) if self.kind in ("named", "ambiguous") else ()
        )

    @property
    def ambiguity(self) -> frozenset[str]:
        """Names of the effects named and their rivals; empty unless the verdict is `named` or `ambiguous`."""
        if self.kind not in ("named", "ambiguous"):
            return frozenset()
        titles = (title.removesuffix(BEYOND) for c in self.selection.causes for title in c.rivals)
        return frozenset(self.names).union(*(title.split(TOGETHER) for title in titles))

    @property
    def in_question(self) -> frozenset[str]:
        """Names of effects that decide the verdict; empty if it is `none`.

        The chosen ones, their rivals, and those that alone take `NEAR` of the best one's gain, or `SOME` of
        it within their trusted range.
        """
        if self.kind == "none":
            return frozenset()
        found, names = self.selection, set(self.selection.chosen.names)
        taken = [(f, found.base.chi2 - f.chi2) for f in (*found.singles, *found.wider)]
        most = max((gain for _, gain in taken), default=0.0)
        names |= {
            f.names[0] for f, gain in taken if gain > NEAR * most or (gain > SOME * most and at_a_bound(f))
        }
        return frozenset(names.union(*(effects_in(c.rivals) for c in found.causes)))

    def _share(self, cause: Cause) -> float:
        """Share of the base model's misfit that returns where one of several causes is taken away."""
        gained = self.selection.base.chi2 - self.selection.chosen.chi2
        return self.share_taken * min(cause.loss / gained, 1.0) if gained > 0 else 0.0

    def _value(self, key: str) -> dict[str, float]:
        low, high = self.intervals[key]
        return {"value": self.selection.chosen.values[key], "low95": low, "high95": high}

    def as_json(self) -> dict[str, Any]:
        """The content of verdict.json.

        partly_explained_by: effects of the chosen model if the verdict names none; they are not the cause.
        """
        causes = [
            {
                "effect": c.effect.name,
                "of": c.effect.whose or None,
                "among": _among(c.effect),
                "mechanism": c.effect.mechanism,
                "parameters": {
                    p.name: self._value(k) for k, p in zip(c.effect.keys, c.effect.parameters, strict=True)
                },
                "p_value": c.p_value,
                "share": self.share_taken if len(self.selection.causes) == 1 else self._share(c),
                "rivals": list(c.rivals),
            }
            for c in self.selection.causes
        ]
        left = self.selection.left
        next_ = self.proposal
        return {
            "verdict": self.kind,
            "causes": causes if self.names else [],
            "partly_explained_by": [] if self.names else causes,
            "remaining_structure": {
                "detected": bool(left),
                "where": list(left),
                "size": self.gain.fit.after,
                "unit": self.gain.fit.unit,
            },
            "gain": self.gain.as_json(),
            "residual_table": [
                {
                    "against": d.against,
                    "statistic": d.statistic,
                    "degrees_of_freedom": d.dof,
                    "p_value": d.p_value,
                    "where": d.where,
                }
                for d in self.selection.table_base
            ],
            "nearest": {"effect": self.nearest[0], "share": self.nearest[1]} if self.nearest else None,
            "next_experiment": {"what": next_.what, "separates": list(next_.separates)} if next_ else None,
            "identifiability": dict(self.identifiability),
        }


def verdict_kind(found: Selection, nuisances: Sequence[Parameter], graded: bool) -> str:
    """Decide which of `KINDS` a search ends in.

    graded: the causes are named although structure is left (`main_causes.mainly`).
    """
    if (found.left and not graded) or found.doubted:
        return "unexplained"
    if found.causes:
        return "ambiguous" if any(c.rivals for c in found.causes) else "named"
    return "unidentifiable" if unlikely(nuisances, found.base) else "none"


def unlikely(nuisances: Sequence[Parameter], base: Fit) -> list[Parameter]:
    """Nuisances with values far from prior knowledge, the farthest first."""
    away = {p: abs(base.values[p.name] - p.null) / p.spread for p in nuisances if math.isfinite(p.spread)}
    return sorted((p for p in away if away[p] > UNLIKELY), key=lambda p: -away[p])


def nearest(fitter: Fitter, found: Selection) -> tuple[str, float] | None:
    """Title and share of the misfit of the single explanation that takes most of it; None without any."""
    pool = [f for f in ranked([*found.singles, *found.wider]) if not at_a_bound(f)]
    return (pool[0].effects[0].title, share_taken(fitter, found.base, pool[0])) if pool else None


def _among(effect: Effect) -> dict[str, Any] | None:
    """Owners among which an effect differs, and its standard deviation with an interval."""
    if not effect.among:
        return None
    value, low, high = effect.spread
    unit = effect.parameters[0].unit
    return {"what": effect.among, "spread": {"value": value, "low95": low, "high95": high, "unit": unit}}


def identifiability(seen: Sequence[Sensitivity], chosen: Selection) -> dict[str, str]:
    """Effects that these data cannot show, with the reason and a way to show them."""
    found = {}
    shown = {f.names[0] for f in chosen.singles if chosen.base.chi2 - f.chi2 >= SEEN**2}
    for name, s in best_seen(seen).items():
        if s.identifiable or name in shown:
            continue
        p = s.effect.parameters[0]
        if s.unabsorbed > ABSORBED and math.isfinite(s.limit):
            most = max((p.low, p.high), key=lambda bound: abs(bound - p.null))
            size, unit = p.name.replace("_", " "), f" {p.unit}" * bool(p.unit)
            found[name] = (
                f"its bound, {size} {most:g}{unit}, is too small to be detected here, where "
                f"{s.limit:.2g}{unit} would be; experiment that shows it: {s.effect.reveals}"
            )
        elif s.absorbed_by and s.unabsorbed > 0:
            by = " and ".join(n.replace("_", " ") for n in s.absorbed_by)
            found[name] = f"absorbed by {by}; experiment that shows it: {s.effect.reveals}"
        else:
            found[name] = f"no measured quantity depends on it; experiment that shows it: {s.effect.reveals}"
    return found
