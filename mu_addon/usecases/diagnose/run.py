"""`diagnose`: from measured data to a verdict on the model; read, predict, judge and write down."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design.parameters import Unit
from ...errors import InputError
from ...evidence.diagnosis import diagnose
from ...evidence.drive import reading_noise
from ...evidence.effect import readable
from ...evidence.effects.mullins_softening import REFERENCE
from ...evidence.extended import ExtendedModel, Fitted, extended_model, stacked
from ...evidence.prediction import lattice_compression, unit_pressure
from ...evidence.readings import STAYS, dwell, quantum
from ...evidence.simulator import Composite, Simulator, bends
from ...evidence.simulators import BASE, DESIGNS, EFFECTS, SHARES, SIZES, simulations_plan, simulators_of
from ...evidence.verdict import Verdict
from ...files import write_csv, write_json
from ...measured import Measured
from ...measured.kinds import OF_A_UNIT
from ...reading import file_bytes, parse_json
from ...run.context import RunContext
from ...run.folder import begin, same_inputs
from ...run.progress import Progress
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .job import LAYOUT, SHAPES, UNKNOWN, Job, read_job
from .judged_data import JudgedData, curves
from .report import write_report
from .unknown import ROUNDS, Shapes, Unknown, leading, shapes
from .words import advice, sentence, to_do, warm

if TYPE_CHECKING:
    from ...evidence.unit_fem import UnitSettings

# Of a unit, but not before its weight, or the place of what holds it, is simulated.
LATER = ("unit_pose", "blocked_force")
SET = 3
"""Records among the data for which the plan's seconds of a verdict hold."""
RECORD = 10
"""Rows from which an experiment is a record, not a few readings."""


def begin_diagnosis(job: Job, folder: Path, context: RunContext) -> None:
    """Prepare a folder for a diagnosis; a complete verdict on the same inputs goes into the summary."""
    inputs = job.texts()
    context.summary = _kept(folder, inputs) | context.summary
    begin(context, folder, LAYOUT, inputs)


def _kept(folder: Path, inputs: Mapping[str, str]) -> dict[str, Any]:
    """Summary of a complete verdict on the same inputs in a folder; empty without one."""
    try:
        found = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    except (OSError, InputError):
        return {}
    whole = all((folder / name).is_file() for name in LAYOUT.results if name != SHAPES or UNKNOWN in inputs)
    if not (
        same_inputs(folder, inputs)
        and whole
        and isinstance(found, dict)
        and found.get("status") == "complete"
    ):
        return {}
    return {k: v for k, v in found.items() if k != "status"}


def diagnose_data(job: Job, folder: Path, context: RunContext) -> JudgedData | None:
    """Judge the model by measured data; writes verdict.json, model.toml, residuals.csv, report.html.

    If the folder holds this program's verdict on these inputs, return None without repeating it. Raises
    InputError, OutputError.
    """
    measured, unit, progress = job.measured, job.subject, context.progress
    for remark in measured.remarks:
        progress.warning(remark.what, remark.where, remark.remedy)
    if "verdict" in context.summary:
        with progress.stage("verdict of the same data, from the cache"):
            return None
    known = job.known.of_effects if job.known else {}
    first = _first_look(job, folder, progress, known)
    if first:
        context.summary["first_look"] = first
    settings: UnitSettings | None = job.unit_settings
    fits = None
    if job.unknown is not None and settings is not None:
        settings, fits = _shapes(job, job.unknown, settings, folder, progress)
        context.summary["unknown"] = fits.as_json()
    stage = EFFECTS
    while settings is not None:
        simulators, notes = simulators_of(
            measured.experiments, unit, folder / "cache", progress, settings, stage
        )
        simulator = Composite(simulators, known=known)
        with _stages(progress) as on_model:
            verdict = diagnose(measured.experiments, simulator, on_model)
        # A first look at each effect tells which ones need all their sizes.
        of_a_unit = bends(measured.experiments)
        settings, stage = settings.further(verdict.in_question) if of_a_unit else None, SIZES
    if job.unknown is not None and verdict.names:
        # Free dimensions take up what speaks against a cause: the paper's ranges were named a batch's.
        notes.append(
            f"{', '.join(verdict.names)} would explain the rest, but no cause is named while dimensions are "
            "unknown: put those that fit into the unit, and diagnose without --unknown"
        )
        verdict = attrs.evolve(verdict, kind="unexplained")
    notes += _known_before(job, simulator)
    model = extended_model(verdict, simulator.nuisances)
    block = simulators.get(lattice_compression.KIND)
    if isinstance(block, lattice_compression.LatticeStress) and block.computed:
        model = attrs.evolve(model, lattice=block.computed)
        notes += _resin(model, unit)
    model = with_reference(model, simulators)
    if job.known is not None:
        model = stacked(job.known, model)
    notes += _bounds_met(verdict, simulator)
    notes += _noisy_gauges(measured, verdict)
    notes += warm(measured.experiments)
    notes += verdict.set_aside
    notes += [
        f"{titles} could not be computed, and was not compared: {why}"
        for titles, why in verdict.refused.items()
    ]
    notes += [fits.words()] if fits else []
    remarks = [*(f"{r.what} ({_place(r.where)})" for r in measured.remarks), *notes]
    unknown = dict.fromkeys(e.kind for e in measured.experiments if not simulator.knows(e))
    remarks += [f"there is no model for {kind}: its experiments were left out" for kind in unknown]
    found = JudgedData(measured, simulator, verdict, model, unit, tuple(remarks), job.body)
    write_json(folder / "verdict.json", verdict.as_json())
    found.model.save(folder / "model.toml")
    _write_residuals(found, folder / "residuals.csv")
    context.summary |= summary(found)
    context.report = lambda stopped: write_report(found, folder, context, stopped)
    return found


def _first_look(
    job: Job, folder: Path, progress: Progress, known: Mapping[str, float]
) -> dict[str, str] | None:
    """Early verdict on a unit by its base simulation alone, reported while others run; None without one.

    It includes instruments and effects in time, but no weight, walls or print: those need further
    simulations, which take most of a verdict's time. It is reported as a stage and kept in summary.json;
    verdict.json holds the full verdict. A resumed run, whose simulations were begun, has had it.
    """
    if any((folder / "cache").glob("unit*")):
        return None
    experiments = [e for e in job.measured.experiments if e.kind in OF_A_UNIT and e.kind not in LATER]
    if not any(e.role == "fit" for e in experiments):
        return None
    settings = attrs.evolve(job.unit_settings, effects=(), designs=None)
    simulators, _ = simulators_of(experiments, job.subject, folder / "cache", progress, settings)
    simulator = Composite(simulators, known=known)
    with _stages(progress) as on_model:
        verdict = diagnose(experiments, simulator, on_model)
    headline, words = sentence(verdict)
    # What nothing explains says so itself.
    kind = "" if headline.startswith(verdict.kind) else f"{verdict.kind}, "
    look = f"first look, without weight, walls and print: {kind}{headline}"
    # With share and seconds a line of at most 100 columns.
    with progress.stage(shorten(look, 76, placeholder=" ...")):
        pass
    return {"verdict": verdict.kind, "headline": headline, "sentence": words}


def _shapes(
    job: Job, unknown: Unknown, settings: UnitSettings, folder: Path, progress: Progress
) -> tuple[UnitSettings, Shapes]:
    """What the data say about unknown parameters without effects, and settings with every design simulated.

    Where the surface between designs fits best, units are simulated and it is laid anew. Writes shapes.csv.
    """
    unit = job.subject
    assert unit is not None
    experiments = [e for e in job.measured.experiments if e.kind in OF_A_UNIT and e.kind not in LATER]
    for round_ in range(ROUNDS + 1):
        assert settings.designs is not None
        alone = attrs.evolve(settings, effects=())
        simulators, _ = simulators_of(experiments, unit, folder / "cache", progress, alone, DESIGNS)
        surfaces = [s for simulator in simulators.values() for s in getattr(simulator, "surfaces", ())]
        found = shapes(unknown, settings.designs, surfaces, Composite(simulators), experiments)
        more = leading(found, unknown, settings.designs, unit)
        if more is None or round_ == ROUNDS:
            break
        settings = attrs.evolve(settings, designs=more)
    found.write(folder / SHAPES)
    return settings, found


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


def _known_before(job: Job, simulator: Composite) -> list[str]:
    """Effects in the model from the start, as text, and those that these experiments do not show."""
    if job.known is None:
        return []
    effects = {
        readable(name): ", ".join(f"{readable(p)} {f.value:.3g} {f.unit}".rstrip() for p, f in values.items())
        for name, values in job.known.effects.items()
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


def _noisy_gauges(measured: Measured, verdict: Verdict) -> list[str]:
    """Readings that drove the model after smoothing, as text."""
    noise: dict[str, float] = {}
    moved: dict[str, float] = {}
    stepped: dict[str, float] = {}
    for e, judged in zip(measured.experiments, verdict.experiments, strict=True):
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


@contextmanager
def _stages(progress: Progress) -> Iterator[Callable[[str], None]]:
    """Stages of the run from the engine's messages.

    All trials of effects are one stage. Their number is unknown beforehand, so its share is estimated by the
    clock.
    """
    with ExitStack() as stack:
        now = ""

        def on_model(what: str) -> None:
            nonlocal now
            stage = what if what in ("noise", "sensitivities", "gain") else "effects"
            if stage != now:
                stack.close()
                stack.enter_context(progress.stage(stage))
            now = stage
            progress.update(0.0, what if stage == "effects" else "")

        yield on_model


def _place(where: str) -> str:
    """Name of a file without its folders."""
    path, comma, rest = where.partition(", ")
    return Path(path).name + comma + rest


def _write_residuals(found: JudgedData, path: Path) -> None:
    rows = [
        (c.experiment.name, c.experiment.role, c.channel, int(row), m, b, a)
        for c in curves(found)
        for row, m, b, a in zip(
            c.experiment.rows, c.measured.tolist(), c.before.tolist(), c.after.tolist(), strict=True
        )
    ]
    head = ["experiment", "role", "channel", "row", "measured", "base_model", "extended_model"]
    write_csv(path, head, rows)


def summary(found: JudgedData) -> dict[str, Any]:
    """Every figure of a diagnosis in plain data."""
    verdict = found.verdict
    headline, words = sentence(verdict)
    return {
        "verdict": verdict.kind,
        "headline": headline,
        "sentence": words,
        "to_do": to_do(verdict),
        "next": advice(verdict),
        "causes": verdict.as_json()["causes"],
        "gain": verdict.gain.as_json(),
        "experiments": {e.name: [e.kind, e.role] for e in found.measured.experiments},
        "noise": {group: attrs.asdict(source) for group, source in verdict.sources.items()},
        "predictions": found.simulator.calls,
        "remarks": list(found.remarks),
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a diagnosis's `summary`."""
    lines = [f"verdict: {summary['verdict']}: {summary['headline']}"]
    lines += [f"what to do: {summary['to_do']}"] if summary.get("to_do") else []
    lines.append(summary["sentence"])
    lines += [f"shape: {summary['unknown']['words']}"] if "unknown" in summary else []
    for name, words in (("fit", "fitted data"), ("held_out", "held-out data")):
        errors = summary["gain"][name]
        if errors and summary["causes"]:
            before, after = errors["rmse_before"], errors["rmse_after"]
            lines.append(f"error on {words}: {before:.3g} -> {after:.3g} {errors['unit']}")
    return [*lines, f"next: {summary['next']}"] if summary["next"] else lines


def plan_of(job: Job) -> Plan:
    """Stages of a diagnosis with the expected seconds of each on two cores."""
    experiments = job.measured.experiments
    # A few readings take next to nothing.
    records = sum(len(e.rows) >= RECORD for e in experiments) / SET
    judged = {"noise": 0.5, "sensitivities": 2.0, "effects": 15.0, "gain": 0.5}
    simulated = dict(simulations_plan(experiments, job.subject, job.unit_settings))
    looks = {name: share * simulated[BASE] for name, share in SHARES.items() if BASE in simulated}
    last = [(SIZES, looks.pop(SIZES))] if looks else []
    return [
        *(simulated | looks).items(),
        *((name, 0.2 + s * records) for name, s in judged.items()),
        *last,
        ("report", 1.5),
    ]


KEPT = ("lattice", BASE, DESIGNS, EFFECTS, SIZES)
USE_CASE = UseCase(
    "diagnose", LAYOUT, read_job, diagnose_data, console_summary, begin_diagnosis, plan=plan_of, kept=KEPT
)
