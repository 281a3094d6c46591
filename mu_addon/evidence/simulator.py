"""Simulators of experiments: one a kind, and one that holds them all."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit, load_preset
from ..design.settings import PRESET
from ..errors import InputError
from ..measured import Experiment
from ..measured.kinds import OF_A_UNIT
from .effect import OF, Effect, Parameter
from .effects import MODULI, Acting, laws_of
from .effects.declaration import Setting

# Part of the name of every modulus among the nuisances.
MODULUS = "modulus"


def bends(experiments: Sequence[Experiment]) -> bool:
    """Return True if a unit is simulated for some experiment."""
    return any(e.kind in OF_A_UNIT for e in experiments)


def unit_behind(experiments: Sequence[Experiment], unit: Unit | None = None) -> Unit | None:
    """Unit of the experiments, the preset where none is given; None where no experiment needs one.

    A block of lattice is a unit's where its cells are counted.
    """
    if bends(experiments) or any(e.cells for e in experiments):
        return unit or load_preset(PRESET)
    return None


class Simulator(Protocol):
    """Predicts the instruments' readings of an experiment; one class for each kind of experiment.

    nuisances: parameters that are fitted whatever the cause; effects: mechanisms that the base model may
    lack.
    """

    @property
    def nuisances(self) -> tuple[Parameter, ...]:
        """Parameters free in every model."""
        ...

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Mechanisms that may be added to the base model."""
        ...

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """Names of the experiment's columns that are predicted; their last part is the unit."""
        ...

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Prediction (channels, n) in the channels' units, at the experiment's n samples.

        values: by "effect.parameter" or name of a nuisance, in the parameter's unit; the null where one is
        missing.
        """
        ...


class Composite:
    """Simulators of several kinds of experiment as one; they share parameters by name, and cache predictions.

    simulators: by kind. An effect whose parameters differ between kinds counts as several effects of one
    name; refinements of a law are in `refinements`. known: values, by "effect.parameter", of effects that an
    earlier diagnosis named: they are in every prediction and are not offered again; unseen: those that no
    kind here has. remembered: largest number of cached predictions; calls: number of computed predictions;
    refused: why a requested model has no prediction, by the titles of its effects. Raises InputError where
    two simulators give a parameter another unit, null or disjoint bounds.
    """

    def __init__(
        self,
        simulators: Mapping[str, Simulator],
        remembered: int = 1024,
        known: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self._simulators = dict(simulators)
        self._remembered = remembered
        self._known = dict(known)
        self._kept: OrderedDict[Any, tuple[Experiment, Array]] = OrderedDict()
        self.calls = 0
        # Common names of experiments other than specimen or session.
        self.groups: dict[str, frozenset[str]] = {}
        self.refused: dict[str, str] = {}
        nuisances: dict[str, Parameter] = {}
        effects: dict[tuple[str, ...], Effect] = {}
        for kind, simulator in self._simulators.items():
            for p in simulator.nuisances:
                nuisances[p.name] = _shared(nuisances.get(p.name, p), p)
            for e in simulator.effects:
                same = effects.get(e.keys)
                if same is None:
                    effects[e.keys] = attrs.evolve(e, kinds=(kind,))
                    continue
                both = [_shared(a, b) for a, b in zip(same.parameters, e.parameters, strict=True)]
                shown = "; or ".join(dict.fromkeys([*same.reveals.split("; or "), *e.reveals.split("; or ")]))
                effects[e.keys] = attrs.evolve(
                    same, parameters=tuple(both), kinds=(*same.kinds, kind), reveals=shown
                )
        self.nuisances = tuple(nuisances.values())
        self._only = {p.name: p.experiment for p in self.nuisances if p.experiment}
        self._knows = {
            kind: {p.name for p in s.nuisances} | {key for e in s.effects for key in e.keys}
            for kind, s in self._simulators.items()
        }
        # Another law of a mechanism already in the model would duplicate it.
        there = {(k.partition(".")[0], kind) for kind, names in self._knows.items() for k in names & {*known}}
        offered = [e for e in effects.values() if not {(e.name, kind) for kind in e.kinds} & there]
        self.effects = tuple(e for e in offered if not e.refines)
        self.refinements = tuple(e for e in offered if e.refines)
        # An effect's values are passed on completely, with entries beside its parameters.
        for kind, names in self._knows.items():
            names |= {k for k in known if (k.partition(".")[0], kind) in there}
        seen = {name for name, _ in there}
        self.unseen = tuple(dict.fromkeys(n for k in known if (n := k.partition(".")[0]) not in seen))

    def knows(self, experiment: Experiment) -> bool:
        """Return True if there is a simulator for that experiment's kind."""
        return experiment.kind in self._simulators

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """Names of the experiment's predicted columns; raises InputError for a kind without a simulator."""
        return self._of(experiment).channels(experiment)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Prediction (channels, n) in the channels' units, read-only, from the cache where possible.

        values: as in `Simulator.predict`; values unknown to the kind or of other specimens (`Effect.whose`)
        are ignored. Raises InputError for a kind without a simulator.
        """
        simulator = self._of(experiment)
        own = self._own(experiment, {**self._known, **values} if self._known else values)
        key = (experiment.name, id(experiment), frozenset(own.items()))
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key][1]
        acting = Acting(experiment.kind, own, Setting(experiment=experiment))
        found = np.asarray(acting.along(simulator.predict(_strained(acting), own), "shown"))
        found.flags.writeable = False
        self.calls += 1
        # Stored with the experiment, whose identity could otherwise be reused.
        self._kept[key] = experiment, found
        if len(self._kept) > self._remembered:
            self._kept.popitem(last=False)
        return found

    def _own(self, experiment: Experiment, values: Mapping[str, float]) -> dict[str, float]:
        """The values that the experiment's simulator uses, with those of its specimen by plain keys."""
        knows, only, name = self._knows[experiment.kind], self._only, experiment.name
        own = {k: v for k, v in values.items() if k in knows and only.get(k, name) == name}
        others = [(k, v) for k, v in values.items() if OF in k and k not in knows]
        if not others:
            return own
        owners = (f"specimen {experiment.specimen}", f"session {experiment.session}", f"experiment {name}")
        for key, value in others:
            plain, _, whose = key.partition(OF)
            if not (whose in owners or name in self.groups.get(whose, ())):
                continue
            effect = plain.partition(".")[0]
            if plain in knows or effect in laws_of(experiment.kind):
                own[plain] = value
            elif effect in MODULI:
                moduli = (p for p in self.nuisances if p.name in knows and MODULUS in p.name)
                own |= {p.name: own.get(p.name, p.null) * (1.0 + value) for p in moduli}
        return own

    def _of(self, experiment: Experiment) -> Simulator:
        if experiment.kind not in self._simulators:
            raise InputError(
                f"there is no model for {experiment.kind}",
                experiment.name,
                f"models exist for {', '.join(self._simulators)}",
            )
        return self._simulators[experiment.kind]


def _strained(acting: Acting) -> Experiment:
    """The experiment with the strain of effects that act on it."""
    experiment = acting.setting.experiment
    if not acting.at("strain"):
        return experiment
    strain = acting.along(experiment["strain"], "strain")
    return attrs.evolve(experiment, columns={**experiment.columns, "strain": strain})


def _shared(known: Parameter, other: Parameter) -> Parameter:
    """One parameter of two simulators, within the bounds of both."""
    apart = max(known.low, other.low) >= min(known.high, other.high)
    if (known.unit, known.null, known.linear) != (other.unit, other.null, other.linear) or apart:
        raise InputError(
            f"two simulators describe {known.name} differently", "simulators", "give it one unit and one null"
        )
    return attrs.evolve(known.narrowed(other.low, other.high), spread=min(known.spread, other.spread))
