"""Effects that may belong to one specimen or experiment: one leaks, slips or drifts and the others do not."""

from __future__ import annotations

from collections.abc import Sequence

import attrs

from ..measured import Experiment
from .effect import FORCE_SCALE, Effect
from .effects import DECLARED
from .effects.declaration import ALL, BENCH, EITHER, MACHINE
from .ownership import by_session, by_specimen


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
    return tuple(
        Effect(name, e.differs.parameters, own)
        for name, e in DECLARED.items()
        if e.differs and not e.groups and (own := e.differs.kinds or kinds) and {*own} & {*kinds}
    )


def coincident_effects(experiments: Sequence[Experiment]) -> dict[Effect, frozenset[str]]:
    """Effects that scale the force of some experiments in a testing machine together, and their names.

    The height typed for one specimen, a lasting change between two tests, and a factor common to all tests
    above a rate. A cause in the same experiments cannot be distinguished from them.
    """
    own = [e for e in experiments if e.kind in MACHINE and "strain" in e.columns]
    kinds = tuple(dict.fromkeys(e.kind for e in own))
    return {
        Effect(name, e.differs.parameters, kinds, whose=whose): frozenset(members)
        for name, e in DECLARED.items()
        if e.groups and e.differs
        for whose, members in e.groups(own).items()
        if len(set(members)) < len(own)
    }


def owners(name: str, experiments: Sequence[Experiment]) -> dict[str, list[str]]:
    """Names of experiments by owner: "specimen B", "session 2" or "experiment hold 2"."""
    found: dict[str, list[str]] = {}
    of = DECLARED[name].of
    if of != BENCH:
        found |= by_specimen(experiments)
    if of in (BENCH, EITHER):
        if of == BENCH:
            found |= by_session(experiments)
        alone = {members[0] for members in found.values() if len(members) == 1}
        found |= {f"experiment {e.name}": [e.name] for e in experiments if e.name not in alone}
    return found
