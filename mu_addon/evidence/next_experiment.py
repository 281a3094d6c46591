"""Choice of the next experiment: the possible one that best separates the rivals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MuError
from ..measured import Experiment
from .effect import BATCH, GEOMETRY, THICKNESS
from .effects import DECLARED
from .fit import Fit, Fitter
from .found_causes import Selection, effects_in
from .noise import Whitening
from .record import record
from .sensitivity import Sensitivity

# Additional distance of a load cell from the tip.
FURTHER_mm = 2.0


@attrs.frozen
class Proposal:
    """An experiment as text, the effects that it separates, and the expected difference in chi squared.

    expected: least difference between any two of the rival fits (no unit).
    """

    what: str
    separates: tuple[str, ...]
    expected: float


def propose_experiment(fitter: Fitter, found: Selection, seen: Sequence[Sensitivity]) -> Proposal | None:
    """The experiment that best separates the effects still in doubt; None where no cause has a rival.

    Variations of the measured experiments are tried. Best is the largest expected chi squared between the two
    rival fits that are nearest to each other, nuisances held. Below 1 the proposal is taken from the library
    entries of the rival effects.
    """
    rivals = [c for c in found.causes if c.rivals]
    if not rivals:
        return None
    cause = rivals[0]
    names = (cause.effect.name, *cause.rivals)
    fits: dict[str, Fit] = {}
    for name in names:
        for f in (found.chosen, *found.singles):
            if f.names == (name,) or (f is found.chosen and name == cause.effect.name):
                fits.setdefault(name, f)
    made = [e for i, e in enumerate(fitter.record.experiments) if fitter.record.driven(i, "pressure_kPa")]
    best: Proposal | None = None
    for e in _variations(made):
        try:
            expected = _divergence(fitter, e, [fits[n].values for n in names if n in fits])
        except MuError:
            continue
        if expected > 0.0 and (best is None or expected > best.expected):
            best = Proposal(f"{e.name}; or {cause.effect.reveals}", names, expected)
    if best is None or best.expected < 1.0:
        own = {s.effect.name: s.effect.reveals for s in seen}
        plain = effects_in(names)
        # Another specimen separates a scale of one specimen from any other cause; of struts drawn unlike, it
        # would be as far off.
        drawn = {e.strut_mm for e in fitter.record.experiments}
        specimens = BATCH, GEOMETRY
        tied = [n for n in ((THICKNESS, *specimens) if len(drawn) > 1 else specimens) if n in plain]
        asked = tied[:1] or plain
        words = "; or ".join(dict.fromkeys(own.get(n, DECLARED[n].reveals) for n in asked))
        return Proposal(words, names, best.expected if best else 0.0)
    return best


def _divergence(fitter: Fitter, e: Experiment, models: Sequence[Any]) -> float:
    """Least difference in chi squared between two of the models in one experiment, nuisances held."""
    planned = record([e], fitter.simulator)
    if any(g not in fitter.sources for g in planned.groups):
        return 0.0
    whitening = Whitening(planned, fitter.sources)
    white = [whitening(planned.predict(fitter.simulator, m)) for m in models]
    apart = [float(np.sum((a - b) ** 2)) for i, a in enumerate(white) for b in white[i + 1 :]]
    return min(apart, default=0.0)


def _variations(made: Sequence[Experiment]) -> list[Experiment]:
    """Variations of earlier experiments: faster, slower, to higher pressure, under vacuum, or turned."""
    found = []
    for e in made:
        if "time_s" not in e.columns or "pressure_kPa" not in e.columns:
            continue
        t, p = e["time_s"], e["pressure_kPa"]
        found += [
            _driven(e, f"{e.name!r} again, three times as fast", t[0] + (t - t[0]) / 3.0, p),
            _driven(e, f"{e.name!r} again, at a fifth of the rate", t[0] + (t - t[0]) * 5.0, p),
            _driven(e, f"{e.name!r} again, to 1.3 times the pressure", t, 1.3 * p),
            _driven(e, f"{e.name!r} again, with vacuum for pressure", t, -0.5 * p),
        ]
        found += [
            attrs.evolve(e, name=f"{e.name!r} again, at {phi:g} deg", orientation_deg=phi)
            for phi in (0.0, 90.0, 180.0)
            if phi != e.orientation_deg
        ]
        if e.kind == "blocked_force":
            found.append(
                attrs.evolve(
                    e,
                    name=f"{e.name!r} again, with the tip free to {FURTHER_mm:g} mm more",
                    gap_mm=e.gap_mm + FURTHER_mm,
                )
            )
    return found


def _driven(e: Experiment, name: str, t: Array, p: Array) -> Experiment:
    columns = {k: np.zeros(len(p)) for k in e.columns} | {"time_s": t, "pressure_kPa": p}
    return attrs.evolve(e, name=name, columns=columns)
