"""The verdict on a folder of measured data: what is wrong, how sure, what it gains, what to measure next."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from ..measured import Experiment
from .fit import Fitter
from .gain import Gain, gain
from .next_experiment import Proposal, next_experiment
from .noise import Source, estimate, span
from .record import Record, record
from .selection import Selection, interval, select
from .sensitivity import Sensitivity, best_seen, sensitivities, signatures
from .simulator import Composite

Array = np.ndarray[Any, Any]

KINDS = ("none", "named", "ambiguous", "unidentifiable", "unexplained")
# A nuisance this many spreads from what was known of it is no longer only a nuisance.
UNLIKELY = 3.0


@attrs.frozen(eq=False)
class Verdict:
    """What the data say of the model; kind is one of `KINDS`. See `as_json` for the file."""

    kind: str
    selection: Selection
    seen: tuple[Sensitivity, ...]
    sources: dict[str, Source]
    record: Record
    gain: Gain
    proposal: Proposal | None
    identifiability: dict[str, str]
    intervals: dict[str, tuple[float, float]]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects named, the most needed first; none unless the verdict is `named` or `ambiguous`."""
        return (
            tuple(c.effect.name for c in self.selection.causes) if self.kind in ("named", "ambiguous") else ()
        )

    @property
    def ambiguity(self) -> frozenset[str]:
        """Every effect named, or a rival of one that is."""
        if self.kind not in ("named", "ambiguous"):
            return frozenset()
        return frozenset(self.names) | {r for c in self.selection.causes for r in c.rivals}

    def _value(self, key: str) -> dict[str, float]:
        low, high = self.intervals[key]
        return {"value": self.selection.chosen.values[key], "low95": low, "high95": high}

    def as_json(self) -> dict[str, Any]:
        """verdict.json."""
        causes = [
            {
                "effect": c.effect.name,
                "mechanism": c.effect.mechanism,
                "parameters": {k.partition(".")[2]: self._value(k) for k in c.effect.keys},
                "p_value": c.p_value,
                "rivals": list(c.rivals),
            }
            for c in self.selection.causes
            if self.names
        ]
        left = self.selection.left
        next_ = self.proposal
        return {
            "verdict": self.kind,
            "causes": causes,
            "remaining_structure": {"detected": bool(left), "where": list(left)},
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
            "next_experiment": {"what": next_.what, "separates": list(next_.separates)} if next_ else None,
            "identifiability": dict(self.identifiability),
        }


def noise_of(measured: Record, simulator: Composite) -> dict[str, Source]:
    """Noise of a record, whatever effect of the library it may hold."""
    rough = Fitter(measured, simulator, {g: _rough(measured, g) for g in measured.groups})
    base = rough.fit()
    curved = {p.name: base.values[p.name] for p in rough.curved}
    columns = span(measured, signatures(measured, simulator, curved))
    return estimate(measured, measured.values - rough.predict(base.values), columns)


def _rough(measured: Record, group: str) -> Source:
    """Sizes only: white noise of a hundredth of the group's range."""
    values = np.concatenate([measured.values[s.at] for s in measured.series if s.group == group])
    return Source(max(float(np.ptp(values)), 1e-9) / 100.0, 1e-6, 1.0)


def diagnose(
    experiments: Sequence[Experiment], simulator: Composite, progress: Callable[[str], None] = lambda _: None
) -> Verdict:
    """Judge the simulator by experiments; those held out are used for the gain alone.

    progress: called with what is being done. Raises InputError where no experiment can be predicted.
    """
    measured = record([e for e in experiments if e.role == "fit"], simulator)
    progress("noise")
    sources = noise_of(measured, simulator)
    fitter = Fitter(measured, simulator, sources)
    base = fitter.fit()
    progress("sensitivities")
    curved = {p.name: base.values[p.name] for p in fitter.curved}
    seen = sensitivities(fitter, curved)
    chosen = select(fitter, seen, progress)
    kind = _kind(fitter, chosen)
    progress("gain")
    gained = gain(fitter, chosen.base, chosen.chosen, [e for e in experiments if e.role == "held_out"])
    proposal = next_experiment(fitter, chosen, seen)
    known = chosen.chosen if chosen.causes else chosen.base
    bounds = {k: interval(fitter, known, k) for k in known.keys}
    told = _identifiability(seen)
    return Verdict(kind, chosen, tuple(seen), sources, measured, gained, proposal, told, bounds)


def _kind(fitter: Fitter, found: Selection) -> str:
    if found.left or found.doubted:
        return "unexplained"
    if found.causes:
        return "ambiguous" if any(c.rivals for c in found.causes) else "named"
    for p in fitter.curved:
        if abs(found.base.values[p.name] - p.null) > UNLIKELY * p.spread and math.isfinite(p.spread):
            return "unidentifiable"
    return "none"


def _identifiability(seen: Sequence[Sensitivity]) -> dict[str, str]:
    """Effects that these data cannot show, with the reason and what would show them."""
    found = {}
    for name, s in best_seen(seen).items():
        if s.identifiable:
            continue
        if s.absorbed_by and s.limit is not None and s.unabsorbed > 0:
            by = " and ".join(n.replace("_", " ") for n in s.absorbed_by)
            found[name] = f"absorbed by {by}; what would show it: {s.effect.reveals}"
        else:
            found[name] = f"nothing here depends on it; what would show it: {s.effect.reveals}"
    return found
