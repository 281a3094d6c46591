"""A diagnosis: simulators judged by data, the model of the verdict, and its curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..evidence.diagnosis import diagnose
from ..evidence.drive import reading_noise
from ..evidence.effect import readable
from ..evidence.effects.mullins_softening import REFERENCE
from ..evidence.extended import ExtendedModel, Fitted, extended_model, stacked
from ..evidence.prediction import lattice_compression, unit_pressure
from ..evidence.prediction.bench import bench_simulators
from ..evidence.readings import STAYS, dwell, quantum
from ..evidence.simulator import Composite, Simulator
from ..evidence.simulators import of_a_unit
from ..evidence.unit_settings import UnitSettings
from ..evidence.verdict import Verdict
from ..files import json_text
from ..measured import Experiment, Remark
from ..measured.kinds import OF_A_UNIT
from ..run.study import Tell
from .words import advice, sentence, to_do, warm

if TYPE_CHECKING:
    from .unknown import Shaped


@attrs.frozen(eq=False)
class JudgedData:
    """A verdict with its simulator and data.

    remarks: of the reader. shape: unknown dimensions that fit, as text; empty without any.
    """

    experiments: tuple[Experiment, ...]
    simulator: Composite
    verdict: Verdict
    model: ExtendedModel
    remarks: tuple[str, ...]
    shape: str = ""

    def verdict_text(self) -> str:
        """The text of verdict.json."""
        return json_text(self.verdict.as_json())

    @property
    def before(self) -> Mapping[str, float]:
        """Values of the base model."""
        return self.verdict.selection.base.values

    @property
    def after(self) -> Mapping[str, float]:
        """Values of the extended model, or of the best attempt if no cause was named."""
        return self.verdict.selection.chosen.values

    @property
    def extends(self) -> bool:
        """True if any effect was added to the base model, named or not."""
        return bool(self.verdict.selection.chosen.effects)


@attrs.frozen(eq=False)
class Curve:
    """One channel of an experiment: measured, and predicted by the base and the extended model, all (n,)."""

    experiment: Experiment
    channel: str
    measured: Array
    before: Array
    after: Array

    @property
    def spread(self) -> Array | None:
        """Standard deviation (n,) of the channel, where the data give it."""
        head, _, unit = self.channel.rpartition("_")
        return self.experiment.columns.get(f"{head}_sd_{unit}")


def curves(found: JudgedData) -> list[Curve]:
    """Every predicted channel of every experiment, in the order of the folder."""
    simulator = found.simulator
    listed = []
    for e, judged in zip(found.experiments, found.verdict.experiments, strict=True):
        if not simulator.knows(e):
            continue
        before = simulator.predict(judged, found.before)
        after = simulator.predict(judged, found.after)
        for row, channel in enumerate(simulator.channels(e)):
            # A long record was judged by means of its rows, and is shown by them.
            shown = e if len(e) == len(judged) else judged
            listed.append(Curve(shown, channel, shown[channel], before[row], after[row]))
    return listed


Simulated = tuple[dict[str, Simulator], list[str]]


@attrs.frozen(eq=False)
class Judging:
    """A verdict with the simulators by kind that it judged, and remarks on these."""

    simulators: dict[str, Simulator]
    simulator: Composite
    verdict: Verdict
    notes: tuple[str, ...]


def judged_by(
    experiments: Sequence[Experiment],
    before: Mapping[str, float],
    lattice: Any,
    of_the_unit: Sequence[Simulated | None],
    tell: Tell,
) -> Judging:
    """The verdict of experiments on the simulators of their kinds.

    before: values of effects in the model from the start. lattice: response of blocks to printing, with
    remarks; of_the_unit: simulators of a unit, with theirs.
    """
    simulators = bench_simulators(experiments, lattice[0] if lattice else {})
    for simulated, _ in filter(None, of_the_unit):
        simulators |= simulated
    simulator = Composite(simulators, known=before)
    # How many models are tried is not known beforehand: the share is estimated by the clock.
    verdict = diagnose(experiments, simulator, lambda what: tell(0.0, what))
    notes = [words for one in (lattice, *of_the_unit) if one for words in one[1]]
    return Judging(simulators, simulator, verdict, tuple(notes))


def first_look(
    experiments: Sequence[Experiment],
    simulators: Mapping[str, Simulator],
    before: Mapping[str, float],
    tell: Tell,
) -> dict[str, str]:
    """Early verdict on a unit without effects of the unit itself, told as it is found."""
    simulator = Composite(simulators, known=before)
    verdict = diagnose(experiments, simulator, lambda what: tell(0.0, what))
    headline, words = sentence(verdict)
    # What nothing explains says so itself.
    kind = "" if headline.startswith(verdict.kind) else f"{verdict.kind}, "
    tell.progress.finding(f"first look, without weight, walls and print: {kind}{headline}")
    return {"verdict": verdict.kind, "headline": headline, "sentence": words}


def with_all_sizes(
    first: Judging,
    experiments: Sequence[Experiment],
    unit: Unit,
    settings: UnitSettings,
    before: Mapping[str, float],
    lattice: Any,
    tell: Tell,
) -> Judging:
    """The verdict with effects in question simulated at every size: a first look tells which those are."""
    found, kinds = first, {e.kind for e in experiments}
    held = [
        h for h in (False, True) if kinds & ({"blocked_force"} if h else {*OF_A_UNIT} - {"blocked_force"})
    ]
    while (further := settings.further(found.verdict.in_question)) is not None:
        settings = further
        simulated = [of_a_unit(experiments, unit, tell.cache, tell, settings, held=h) for h in held]
        found = judged_by(experiments, before, lattice, simulated, tell)
    return found


def judged_data(
    experiments: tuple[Experiment, ...],
    read: Sequence[Remark],
    unit: Unit | None,
    known: ExtendedModel | None,
    judging: Judging,
    shaped: Shaped | None,
) -> JudgedData:
    """A verdict with its model and remarks.

    read: remarks of the reader. known: the result of an earlier diagnosis.
    """
    verdict, simulator, notes = judging.verdict, judging.simulator, [*judging.notes]
    if shaped and verdict.names:
        # Free dimensions take up what speaks against a cause: the paper's ranges were named a batch's.
        notes.append(
            f"{', '.join(verdict.names)} would explain the rest, but no cause is named while dimensions are "
            "unknown: put those that fit into the unit, and diagnose without --unknown"
        )
        verdict = attrs.evolve(verdict, kind="unexplained")
    notes += _known_before(known, simulator)
    model = extended_model(verdict, simulator.nuisances)
    block = judging.simulators.get(lattice_compression.KIND)
    if isinstance(block, lattice_compression.LatticeStress) and block.computed:
        model = attrs.evolve(model, lattice=block.computed)
        notes += _resin(model, unit)
    model = with_reference(model, judging.simulators)
    if known is not None:
        model = stacked(known, model)
    notes += [*_bounds_met(verdict, simulator), *_noisy_gauges(experiments, verdict)]
    notes += [*warm(experiments), *verdict.set_aside]
    notes += [
        f"{titles} could not be computed, and was not compared: {why}"
        for titles, why in verdict.refused.items()
    ]
    shape = shaped.fits.words() if shaped else ""
    remarks = [
        *(f"{r.what} ({_place(r.where)})" for r in read),
        *notes,
        *([shape] if shape else []),
    ]
    unseen = dict.fromkeys(e.kind for e in experiments if not simulator.knows(e))
    remarks += [f"there is no model for {kind}: its experiments were left out" for kind in unseen]
    return JudgedData(experiments, simulator, verdict, model, tuple(remarks), shape)


def with_reference(model: ExtendedModel, simulators: Mapping[str, Simulator]) -> ExtendedModel:
    """The model with the reference pressure of the energy of a unit's Mullins softening."""
    effect = "mullins_softening"
    unit = simulators.get(unit_pressure.KIND)
    if effect not in model.effects or not isinstance(unit, unit_pressure.UnitPressure):
        return model
    stated = Fitted(unit.reference_kPa, 0.0, math.nan, math.nan, "kPa")
    return attrs.evolve(
        model, effects={**model.effects, effect: {**model.effects[effect], REFERENCE: stated}}
    )


def _known_before(known: ExtendedModel | None, simulator: Composite) -> list[str]:
    """Effects in the model from the start, as text, and those that these experiments do not show."""
    if known is None:
        return []
    effects = {
        readable(name): ", ".join(f"{readable(p)} {f.value:.3g} {f.unit}".rstrip() for p, f in values.items())
        for name, values in known.effects.items()
    }
    words = [
        f"known from an earlier diagnosis and in the model from the start: {n} ({v})"
        for n, v in effects.items()
    ]
    unseen = (
        f"these experiments do not show {readable(n)}, known from an earlier diagnosis"
        for n in simulator.unseen
    )
    return [*words, *unseen]


def _resin(model: ExtendedModel, unit: Unit | None) -> list[str]:
    """Resin's modulus that corresponds to the fitted modulus of a computed block, as text."""
    fitted = model.nuisances.get(lattice_compression.MODULUS.name)
    if fitted is None or model.lattice is None or unit is None:
        return []
    drawn = float(model.lattice.modulus_MPa(1.0, 0.0, 1.0))
    return [
        f"the lattice's modulus as drawn, {fitted.value:.3g} kPa, corresponds to a resin of "
        f"{fitted.value / 1e3 / drawn:.3g} MPa, but the modulus of the unit's walls is "
        f"{unit.material.membrane_modulus_MPa:.3g} MPa"
    ]


def _noisy_gauges(experiments: Sequence[Experiment], verdict: Verdict) -> list[str]:
    """Readings that drove the model after smoothing, as text."""
    noise: dict[str, float] = {}
    moved: dict[str, float] = {}
    stepped: dict[str, float] = {}
    for e, judged in zip(experiments, verdict.experiments, strict=True):
        for column, values in judged.columns.items():
            read = e.columns[column]
            drive = np.array_equal(np.isfinite(values), np.isfinite(read))
            if not drive or np.array_equal(values, read, equal_nan=True):
                continue
            if dwell(read) > STAYS:
                stepped[column] = max(stepped.get(column, 0.0), quantum(read))
            else:
                noise[column] = max(noise.get(column, 0.0), reading_noise(e["time_s"], read))
                if len(read) == len(values):
                    far = float(np.nanmax(np.abs(read - values)))
                    moved[column] = max(moved.get(column, 0.0), far)
    return [
        f"the noise of {column}, up to {sd:.2g}, was averaged over straight stretches, by which readings "
        f"moved by up to {moved.get(column, sd):.2g}; no effect is named for the rest"
        for column, sd in noise.items()
    ] + [
        f"{column} was read in steps of {step:.2g}; the model takes straight lines between the changes"
        for column, step in stepped.items()
    ]


def _bounds_met(verdict: Verdict, simulator: Composite) -> list[str]:
    """Fitted values of the base model at a bound, as text."""
    values = verdict.selection.base.values
    return [
        f"in the fit without effects, {readable(p.name)} is at its bound, {values[p.name]:.3g} ({p.source})"
        for p in simulator.nuisances
        if any(math.isclose(values.get(p.name, p.null), end, rel_tol=1e-6) for end in (p.low, p.high))
    ]


def _place(where: str) -> str:
    """Name of a file without its folders."""
    path, comma, rest = where.partition(", ")
    return Path(path).name + comma + rest


def residual_rows(found: JudgedData) -> list[tuple[Any, ...]]:
    """Every measured value with the predictions of both models: rows of residuals.csv."""
    return [
        (c.experiment.name, c.experiment.role, c.channel, int(row), m, b, a)
        for c in curves(found)
        for row, m, b, a in zip(
            c.experiment.rows, c.measured.tolist(), c.before.tolist(), c.after.tolist(), strict=True
        )
    ]


def summary(found: JudgedData) -> dict[str, Any]:
    """Every figure of a diagnosis in plain data."""
    verdict = found.verdict
    headline, words = sentence(verdict)
    return {
        "headline": headline,
        "sentence": words,
        "to_do": to_do(verdict),
        "next": advice(verdict),
        "causes": verdict.as_json()["causes"],
        "gain": verdict.gain.as_json(),
        "experiments": {e.name: [e.kind, e.role] for e in found.experiments},
        "noise": {group: attrs.asdict(source) for group, source in verdict.sources.items()},
        "predictions": found.simulator.calls,
        "remarks": list(found.remarks),
    }
