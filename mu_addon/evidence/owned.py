"""Effects of one specimen or experiment: one may leak, slip or drift while the others do not."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..measured import Experiment
from .effect import BATCH, FORCE_SCALE, GEOMETRY, HEATING, SLIP, STEP, THICKNESS, Effect, Parameter
from .fit import Fit, Fitter
from .residuals import strict_table, structure
from .selection import (
    CAMERA,
    FALSE_ALARM_RATE,
    RIVAL_DELTA_CHI2,
    Cause,
    Selection,
    at_a_bound,
    beside,
    causes_of,
    cost,
    false_alarm_probability,
    gain_of,
    hypotheses,
    loss,
    promising_rivals,
    size_at_bound,
    sudden,
)
from .sensitivity import Sensitivity, sensitivities

# Instruments and clamps may fail in one experiment, independent of the specimen.
OF_THE_BENCH = CAMERA.union(
    (
        "pressure_offset",
        "pressure_gain",
        "pressure_nonlinearity",
        "pressure_drift",
        FORCE_SCALE,
        "force_nonlinearity",
        "force_drift",
        "force_lag",
        "line_lag",
        "clock_offset",
        "angle_offset",
        "angle_drift",
        "led_drift",
        "ambient_light",
        "contact",
    )
)
# Effects of the specimen or of the way it was clamped once.
OF_EITHER = frozenset(("leak", "seating", "temperature_drift"))
# Numerics and a machine's frame are the same for all, and a marker's slip has its owner by its moment.
OF_NONE = frozenset(("mesh_error", "gravity", "frame_compliance", SLIP))
# Most effects fitted, the most promising first.
MOST_FITS = 12
CHANGE = Parameter("change", "", -0.8, 4.0, 0.0, (0.1,), "batches differ by 5 to 20 %, struts by more")
BATCH_EFFECT = Effect(BATCH, (CHANGE,), ())
THICKER = Parameter(
    "thicker_mm", "mm", -0.4, 0.6, 0.0, (0.05,), "diameter less that drawn; printers are 0.05 to 0.2 mm off"
)
THICKNESS_EFFECT = Effect(THICKNESS, (THICKER,), ("lattice_compression",))
HEIGHT = Parameter("height", "", -0.2, 0.2, 0.0, (0.03,), "true over typed, less 1; misread or mistyped")
# Kinds in a testing machine, whose force depends on specimen, geometry and clamping alike.
MACHINE = ("coupon", "lattice_compression")
# Rates of tests are two where they differ by more than this factor.
FASTER = 1.5


def owned_effects(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Every effect of one specimen or experiment alone, for kinds with several of them.

    Also the usual differences between specimens (`of_specimens`).
    """
    found = [] if not experiments else list(coincident_effects(experiments))
    for effect in (*effects, *of_specimens(experiments)):
        if effect.name in OF_NONE:
            continue
        own = [e for e in experiments if e.kind in effect.kinds]
        for whose, members in _owners(effect.name, own).items():
            if len(members) < len(own):
                others = [e.name for e in own if e.name not in members]
                found.append(scaled_by(attrs.evolve(effect, whose=whose), [members, others], own))
    return tuple(found)


def scaled_by(effect: Effect, owners: Sequence[Sequence[str]], experiments: Sequence[Experiment]) -> Effect:
    """The effect; one of force scale with its possible causes in its mechanism.

    owners: names of the experiments of each. Load cell and clamping differ from test to test; a section as
    typed and the specimen itself do not between tests of one specimen.
    """
    if effect.name != FORCE_SCALE:
        return effect
    of = {e.name: e.specimen or e.name for e in experiments}
    apart = [{of[name] for name in names} for names in owners]
    causes = "load cell or clamping"
    if sum(map(len, apart)) == len(set().union(*apart)):
        causes = "load cell, section as typed, clamping or specimen"
    return attrs.evolve(effect, mechanism=f"the force is scaled: {causes}")


def of_specimens(experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Effects that specimens always differ in: another modulus, and in a lattice other struts."""
    kinds = tuple(dict.fromkeys(e.kind for e in experiments))
    struts = (THICKNESS_EFFECT,) if set(THICKNESS_EFFECT.kinds) & set(kinds) else ()
    return (attrs.evolve(BATCH_EFFECT, kinds=kinds), *struts)


def coincident_effects(experiments: Sequence[Experiment]) -> dict[Effect, frozenset[str]]:
    """Effects that scale the force of some experiments in a testing machine together, and their names.

    The height typed for one specimen, a lasting change between two tests, and a factor common to all tests
    above a rate. A cause in the same experiments cannot be distinguished from them.
    """
    own = [e for e in experiments if e.kind in MACHINE and "strain" in e.columns]
    kinds = tuple(dict.fromkeys(e.kind for e in own))
    groups: dict[tuple[str, str], frozenset[str]] = {}
    for name, members in _owners(GEOMETRY, own).items():
        groups[GEOMETRY, name] = frozenset(members)
    for i in range(1, len(own)):
        groups[STEP, f"tests from {own[i].name} on"] = frozenset(e.name for e in own[i:])
    rates = sorted((rate, e.name) for e in own if (rate := strain_rate(e)) > 0.0)
    for k, (rate, _) in enumerate(rates[1:], 1):
        if rate > FASTER * rates[k - 1][0]:
            label = f"tests at {100 * rate:.2g} %/s or faster"
            groups[HEATING, label] = frozenset(name for _, name in rates[k:])
    return {
        Effect(name, (HEIGHT if name == GEOMETRY else CHANGE,), kinds, whose=whose): members
        for (name, whose), members in groups.items()
        if len(members) < len(own)
    }


def strain_rate(experiment: Experiment) -> float:
    """Median strain rate in 1/s of a specimen while it is strained; 0 without a clock."""
    if "time_s" not in experiment.columns or len(experiment) < 3:
        return 0.0
    strain = experiment["strain"]
    rate = np.abs(np.gradient(strain, experiment["time_s"]))
    moving = rate > 0.1 * rate.max()
    return float(np.median(rate[moving])) if moving.any() else 0.0


def _owners(name: str, experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Names of experiments by owner: "specimen B", "session 2" or "experiment hold 2"."""
    found: dict[str, list[str]] = {}
    if name not in OF_THE_BENCH:
        for e in experiments:
            if e.specimen:
                found.setdefault(f"specimen {e.specimen}", []).append(e.name)
    if name in OF_THE_BENCH or name in OF_EITHER:
        for e in experiments:
            if e.session and name in OF_THE_BENCH:
                found.setdefault(f"session {e.session}", []).append(e.name)
        alone = {members[0] for members in found.values() if len(members) == 1}
        found |= {f"experiment {e.name}": [e.name] for e in experiments if e.name not in alone}
    return found


def select_owned(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    found: Selection,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Selection, list[Sensitivity]]:
    """Add to an insufficient selection the effect of one specimen or experiment that explains the data.

    Unchanged where there is none. The choice of the specimen adds to chance, too: the false-positive rate is
    that of the whole library for every owner. Also returned: sensitivities of all.
    """
    record = fitter.record
    owned = owned_effects(fitter.simulator.effects, record.experiments)
    if not owned:
        return found, list(seen)
    curved = {p.name: found.base.values[p.name] for p in fitter.curved}
    every = [*seen, *sensitivities(fitter, curved, owned)]
    usable = tuple({s.effect.keys: s.effect for s in every if s.effect.whose and s.worth_a_fit}.values())
    seeds = [found.base] if found.chosen is found.base else [found.base, found.chosen]
    singles = found.singles
    wider: list[Fit] = []
    for seed in seeds:
        pool = hypotheses(fitter, [seed], usable, progress, MOST_FITS)
        if seed is found.base:
            wider = pool
            singles = tuple(sorted([*singles, *pool], key=cost))
        if not pool:
            continue
        best = pool[0]
        if cost(best) >= min(cost(found.chosen), *(cost(f) for f in found.singles)):
            # A common effect of all explains more.
            continue
        rivals = [f for f in singles if len(f.effects) == len(best.effects) and f is not best]
        same = [f for f in [*pool[1:], *rivals] if f.names == best.names]
        if any(f.chi2 - best.chi2 < RIVAL_DELTA_CHI2 and _owner(f) != _owner(best) for f in same):
            # The owner cannot be determined.
            continue
        p = false_alarm_probability(fitter, seed, every, gain_of(fitter, seed, best))
        if p >= FALSE_ALARM_RATE or at_a_bound(best) or loss(fitter, seed, best) <= 0.0:
            continue
        table = tuple(strict_table(fitter, best))
        # An effect of the last experiment alone looks like a failure before it.
        margin = 0.0 if best.names[-1] == STEP else RIVAL_DELTA_CHI2
        if sudden(found.table_base, found.base, best, margin):
            continue
        tried = [f.effects[-1] for f in pool[:MOST_FITS]]
        level = [f for f in [*pool, *rivals] if len(f.effects) == 1]
        known = [*(c.p_value for c in found.causes), p]
        causes = causes_of(fitter, tried, found.base, best, known, [level])
        chosen = attrs.evolve(
            found, chosen=best, causes=causes, table=table, singles=singles, doubted="", p_best=p
        )
        if chosen.left:
            # One more specimen may have the same effect; for several see `pooled`.
            chosen = further_owners(fitter, chosen, progress)
            if chosen.left or len(chosen.chosen.effects) > len(best.effects) + 1:
                continue
        return chosen, every
    return attrs.evolve(found, wider=tuple(wider)), list(seen)


def coinciding(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add, as rivals of a selection's causes, effects that scale the same experiments' force equally well.

    If one specimen was tested along x, or all fast tests came last, a cause that acts along x, or by rate,
    may also be that specimen's height as typed, or a change before those tests. Each is fitted in place of
    each cause, and is a rival within `RIVAL_DELTA_CHI2`.
    """
    chosen = found.chosen
    scales = [e for e in fitter.simulator.effects if e.name == FORCE_SCALE]
    # A stated standard deviation includes the spread of specimens.
    single = [e for e in fitter.record.experiments if "stress_sd_kPa" not in e.columns]
    owned = [e for e in owned_effects(scales, single) if set(e.kinds) & set(MACHINE)]
    if not owned or not found.causes or found.left or found.doubted:
        return found
    causes = []
    for c in found.causes:
        scaled = owned if set(c.effect.kinds) & set(MACHINE) else []
        fits = promising_rivals(fitter, chosen, c.effect, scaled, progress)
        near = [f for f in fits if cost(f) - cost(chosen) < RIVAL_DELTA_CHI2]
        if c.effect.among and near and cost(near[0]) < cost(chosen):
            # One size for some replaces a size of each.
            found, near = attrs.evolve(found, chosen=near[0]), near[1:]
            c = Cause(found.chosen.effects[-1], c.p_value, c.loss, (c.effect.title, *c.rivals))
        rivals = dict.fromkeys((*c.rivals, *(f.effects[-1].title for f in near)))
        causes.append(attrs.evolve(c, rivals=tuple(rivals)))
    return attrs.evolve(found, causes=tuple(causes))


def further_owners(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add to a selection whose last effect belongs to one owner the same effect of every other who has it.

    Beside a large leak of one specimen a small one of another passes for slow noise and leaves no structure.
    An owner is added where the gain exceeds chance among all owners, left-out data are predicted better, no
    value is at a bound and no structure is left. Unchanged where no effect belongs to one specimen.
    """
    from scipy.stats import chi2

    chosen = found.chosen
    if not chosen.effects or found.doubted:
        return found
    first = chosen.effects[-1]
    kind, _, _ = first.whose.partition(" ")
    if kind != "specimen" or first.name == BATCH:
        return found
    own = [e for e in fitter.record.experiments if e.kind in first.kinds]
    others = [w for w in _owners(first.name, own) if w.startswith(kind) and w != first.whose]
    causes, tried = list(found.causes), len(others)
    while others:
        progress(first.name)
        pool = []
        for whose in others:
            pool.append(beside(fitter, chosen.effects, attrs.evolve(first, whose=whose), chosen.values))
        best = min(pool, key=cost)
        gain = gain_of(fitter, chosen, best)
        p = min(1.0, tried * float(chi2.sf(max(gain, 0.0), len(first.keys))))
        if p >= FALSE_ALARM_RATE or size_at_bound(best) or loss(fitter, chosen, best) <= 0.0:
            break
        table = tuple(strict_table(fitter, best))
        causes.append(Cause(best.effects[-1], p, chosen.chi2 - best.chi2, ()))
        if not structure(table):
            found = attrs.evolve(found, chosen=best, causes=tuple(causes), table=table)
        elif not found.left:
            break
        chosen = best
        others.remove(_owner(best))
    return found


def _owner(fit: Fit) -> str:
    return fit.effects[-1].whose
