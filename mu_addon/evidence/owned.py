"""Effects that may belong to one specimen or experiment: one leaks, slips or drifts and the others do not."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..measured import Experiment
from .effect import BATCH, FORCE_SCALE, GEOMETRY, HEATING, STEP, THICKNESS, Effect, Parameter, factor
from .effects import DECLARED
from .effects.declaration import ALL, BENCH, EITHER

CHANGE = factor("change", 0.1, "batches differ by 5 to 20 %, struts by more")
# Elastomers soften by some 0.5 % a kelvin, and double their modulus over some decades of rate at most.
WARMED = factor("change", 0.1, "self-heating by some 10 K, stiffening by rate", (-0.3, 1.0))
BATCH_EFFECT = Effect(BATCH, (CHANGE,), ())
THICKER = Parameter(
    "thicker_mm", "mm", -0.4, 0.6, 0.0, (0.05,), "diameter less that drawn; printers are 0.05 to 0.2 mm off"
)
THICKNESS_EFFECT = Effect(THICKNESS, (THICKER,), ("lattice_compression",))
HEIGHT = factor("height", 0.03, "true over typed, less 1; misread or mistyped", (-0.2, 0.2))
CHANGES = {GEOMETRY: HEIGHT, STEP: CHANGE, HEATING: WARMED}
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
        if DECLARED[effect.name].of == ALL:
            continue
        own = [e for e in experiments if e.kind in effect.kinds]
        for whose, members in owners(effect.name, own).items():
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
    # A test may have been of another specimen than was noted.
    several = len(set(of.values())) > 1
    causes = "load cell, clamping or a mix-up of specimens" if several else "load cell or clamping"
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
    for name, members in owners(GEOMETRY, own).items():
        groups[GEOMETRY, name] = frozenset(members)
    for i in range(1, len(own)):
        groups[STEP, f"tests from {own[i].name} on"] = frozenset(e.name for e in own[i:])
    rates = sorted((rate, e.name) for e in own if (rate := strain_rate(e)) > 0.0)
    for k, (rate, _) in enumerate(rates[1:], 1):
        if rate > FASTER * rates[k - 1][0]:
            label = f"tests at {100 * rate:.2g} %/s or faster"
            groups[HEATING, label] = frozenset(name for _, name in rates[k:])
    return {
        Effect(name, (CHANGES[name],), kinds, whose=whose): members
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


def owners(name: str, experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Names of experiments by owner: "specimen B", "session 2" or "experiment hold 2"."""
    found: dict[str, list[str]] = {}
    of = DECLARED[name].of
    if of != BENCH:
        for e in experiments:
            if e.specimen:
                found.setdefault(f"specimen {e.specimen}", []).append(e.name)
    if of in (BENCH, EITHER):
        for e in experiments:
            if e.session and of == BENCH:
                found.setdefault(f"session {e.session}", []).append(e.name)
        alone = {members[0] for members in found.values() if len(members) == 1}
        found |= {f"experiment {e.name}": [e.name] for e in experiments if e.name not in alone}
    return found
