"""From measured data to a verdict on the model: read, predict, judge and write, in one folder."""

from __future__ import annotations

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design.parameters import Unit, load_preset, to_toml
from ...errors import InputError
from ...evidence.drive import reading_noise
from ...evidence.effect import Parameter
from ...evidence.extended import ExtendedModel, extended_model
from ...evidence.prediction import lattice
from ...evidence.prediction import unit as unit_pressure
from ...evidence.prediction.bench import bench_simulators
from ...evidence.selection import Cause
from ...evidence.sensitivity import best_seen
from ...evidence.simulator import Composite, Simulator
from ...evidence.verdict import Verdict, diagnose
from ...files import write_csv, write_json
from ...measured import Experiment, Measured, read_folder
from ...measured.folder import FILE
from ...reading import file_bytes, file_text, parse_json
from ...run.context import RunContext
from ...run.folder import begin
from ...run.progress import Progress

if TYPE_CHECKING:
    from ...evidence.unit_fem import UnitSettings

Array = np.ndarray[Any, Any]

HEADER = "# The inputs of this diagnosis; the measured data are named by the SHA-256 of their files."
RESULTS = ("verdict.json", "model.toml", "residuals.csv", "report.html")
UNIT = "unit.toml"
# Of the table of dependences: the size of what is left against the data's own spread.
SPREAD = "spread"
PRESET = "mu-1.0x"


@attrs.frozen(eq=False)
class Diagnosis:
    """A verdict and what it was found with; remarks: of the reader, in words."""

    measured: Measured
    simulator: Composite
    verdict: Verdict
    model: ExtendedModel
    unit: Unit | None
    remarks: tuple[str, ...]

    @property
    def before(self) -> Mapping[str, float]:
        """Values of the base model."""
        return self.verdict.selection.base.values

    @property
    def after(self) -> Mapping[str, float]:
        """Values of the extended model, or of the best attempt where nothing was named."""
        return self.verdict.selection.chosen.values

    @property
    def extends(self) -> bool:
        """Whether any effect was added to the base model, named or not."""
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


def diagnose_folder(
    folder: Path,
    out: Path,
    unit: Unit | None = None,
    *,
    progress: Progress,
    context: RunContext,
    settings: UnitSettings | None = None,
) -> Diagnosis | None:
    """Judge the model by a folder of measured data; results in `out`.

    unit: what unit_pressure experiments and blocks of counted cells are of, whatever its scale; the preset
    `PRESET` without one; settings: how it is simulated. Writes verdict.json, model.toml, residuals.csv,
    report.html. Where `out` holds this program's verdict on these inputs, nothing is done again, and None is
    returned. Raises InputError, OutputError.
    """
    from .report import write_report

    measured = read_folder(Path(folder))
    if not any(e.role == "fit" for e in measured.experiments):
        raise InputError(
            "every experiment is held out", str(measured.folder / FILE), 'give role = "fit" to some'
        )
    unit = unit_behind(measured.experiments, unit)
    more = [f"program_sha256 = {json.dumps(_program())}"]
    more += [] if settings is None else [f"settings = {json.dumps(repr(settings))}"]
    inputs = folder_inputs("diagnose.toml", HEADER, measured, unit, more)
    kept = _kept(out, inputs)
    begin(context, out, HEADER, inputs, RESULTS, optional=(UNIT,))
    for remark in measured.remarks:
        progress.warning(remark.what, remark.where, remark.remedy)
    if kept:
        with progress.stage("verdict of the same data, from the cache"):
            context.summary |= kept
        return None
    simulators, told = simulators_of(measured.experiments, unit, out / "cache", progress, settings)
    simulator = Composite(simulators)
    with _stages(progress, simulator) as tell:
        verdict = diagnose(measured.experiments, simulator, tell)
    model, block = _extended_model(verdict, simulator), simulators.get(lattice.KIND)
    if isinstance(block, lattice.LatticeStress) and block.computed:
        model = attrs.evolve(model, lattice=block.computed)
        told += _resin(model, unit)
    told += _bounds_met(verdict, simulator)
    told += _noisy_gauges(measured, verdict)
    remarks = [*(f"{r.what} ({_place(r.where)})" for r in measured.remarks), *told]
    unknown = dict.fromkeys(e.kind for e in measured.experiments if not simulator.knows(e))
    remarks += [f"there is no model for {kind}: its experiments were left out" for kind in unknown]
    found = Diagnosis(measured, simulator, verdict, model, unit, tuple(remarks))
    write_json(out / "verdict.json", verdict.as_json())
    found.model.save(out / "model.toml")
    _write_residuals(found, out / "residuals.csv")
    context.summary |= summary(found)
    with progress.stage("report", expected_s=5.0):
        write_report(found, out, context)
    return found


@cache
def _program() -> str:
    """SHA-256 of the code that a verdict comes from."""
    package = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).as_posix()
        if not name.startswith("blender/"):
            digest.update(name.encode() + path.read_bytes())
    return digest.hexdigest()


def _kept(out: Path, inputs: Mapping[str, str]) -> dict[str, Any]:
    """The summary of a verdict on the same inputs that a folder holds whole; empty where it does not."""
    try:
        same = all(file_text(out / name) == text for name, text in inputs.items())
        found = parse_json(file_bytes(out / "summary.json"), "summary.json")
    except (OSError, UnicodeDecodeError, InputError):
        return {}
    if not (
        same
        and isinstance(found, dict)
        and found.get("status") == "complete"
        and all((out / n).is_file() for n in RESULTS)
    ):
        return {}
    return {k: v for k, v in found.items() if k != "status"}


def unit_behind(experiments: Sequence[Experiment], unit: Unit | None = None) -> Unit | None:
    """The unit that experiments are of, the preset where none is given; None where none of them is of one.

    A block of lattice is a unit's where its cells are counted.
    """
    if any(e.kind == unit_pressure.KIND or e.cells for e in experiments):
        return unit or load_preset(PRESET)
    return None


def simulators_of(
    experiments: Sequence[Experiment],
    unit: Unit | None,
    cache: Path,
    progress: Progress,
    settings: UnitSettings | None = None,
) -> tuple[dict[str, Simulator], list[str]]:
    """Simulators of every kind among the experiments, by kind; and what could not be simulated, in words.

    The unit is followed by finite elements, and so are blocks of its lattice; the runs are kept in the
    folder `cache`. What was taken for granted is among the words.
    """
    told: list[str] = []
    scalings: Mapping[str, lattice.Scaling] = {}
    if any(e.cells for e in experiments):
        assert unit is not None
        from ...evidence.lattice_fem import scalings as computed

        with progress.stage("lattice"):
            scalings, told = computed(experiments, unit, cache, lambda _, share: progress.update(share))
    found = bench_simulators(experiments, scalings)
    bent = [e for e in experiments if e.kind == unit_pressure.KIND]
    if bent:
        assert unit is not None
        from ...evidence.unit_fem import unit_responses

        with warnings.catch_warnings(record=True) as heard, progress.stage("unit"):
            warnings.simplefilter("always")
            responses = unit_responses(unit, bent, settings, cache, lambda _, share: progress.update(share))
        # Where and what to do, on further lines, is of a simulation that nobody asked for.
        left_out = [str(warning.message).partition("\n")[0] for warning in heard]
        for words in left_out:
            progress.warning(words, "unit")
        told += left_out
        found[unit_pressure.KIND] = unit_pressure.UnitPressure(responses, experiments)
    return found, told


def _extended_model(verdict: Verdict, simulator: Composite) -> ExtendedModel:
    """The extended model, without nuisances that these data say nothing of."""
    model = extended_model(verdict, {p.name: p.unit for p in simulator.nuisances})
    fit = verdict.selection.chosen if verdict.names else verdict.selection.base
    seen = {k for k, column in zip(fit.keys, fit.jacobian.T, strict=True) if column.any()}
    return attrs.evolve(model, nuisances={k: f for k, f in model.nuisances.items() if k in seen})


def _resin(model: ExtendedModel, unit: Unit | None) -> list[str]:
    """What resin the fitted modulus of a computed block asks for, in words."""
    fitted = model.nuisances.get(lattice.MODULUS.name)
    if fitted is None or model.lattice is None or unit is None:
        return []
    drawn = float(model.lattice.modulus_MPa(1.0, 0.0, 1.0))
    return [
        f"the lattice's modulus as drawn, {fitted.value:.3g} kPa, corresponds to a resin of "
        f"{fitted.value / 1e3 / drawn:.3g} MPa, but the modulus of the unit's walls is "
        f"{unit.material.membrane_modulus_MPa:.3g} MPa"
    ]


def _noisy_gauges(measured: Measured, verdict: Verdict) -> list[str]:
    """Which readings drove the model with less noise than they have, in words."""
    noise: dict[str, float] = {}
    for e, judged in zip(measured.experiments, verdict.experiments, strict=True):
        for column, values in judged.columns.items():
            if not np.array_equal(values, e.columns[column], equal_nan=True):
                noise[column] = max(noise.get(column, 0.0), reading_noise(e.columns[column]))
    return [
        f"{column} was read with white noise of up to {sd:.2g}; this noise was removed by averaging "
        "over straight stretches, and no effect is named for its remainder"
        for column, sd in noise.items()
    ]


def _bounds_met(verdict: Verdict, simulator: Composite) -> list[str]:
    """Which fitted values of the base model ended at a bound, in words."""
    values = verdict.selection.base.values
    return [
        f"in the fit without effects, {readable(p.name)} is at its bound, {values[p.name]:.3g} ({p.source})"
        for p in simulator.nuisances
        if any(math.isclose(values.get(p.name, p.null), end, rel_tol=1e-6) for end in (p.low, p.high))
    ]


@contextmanager
def _stages(progress: Progress, simulator: Composite) -> Iterator[Callable[[str], None]]:
    """What the engine says of its work, as stages."""
    many = max(len(simulator.effects), 1)
    with ExitStack() as stack:
        now, done = "", 0

        def tell(what: str) -> None:
            nonlocal now, done
            stage = what
            if what not in ("noise", "sensitivities", "gain"):
                stage = ("single", "pairs of", "triples of")[min(what.count(" and "), 2)] + " effects"
            if stage != now:
                stack.close()
                stack.enter_context(progress.stage(stage))
            now, done = stage, done + 1 if stage == now else 0
            # Later steps try up to four models with each effect.
            progress.update(done / (many if stage == "single effects" else 4 * many))

        yield tell


def folder_inputs(
    name: str, header: str, measured: Measured, unit: Unit | None, more: Sequence[str] = ()
) -> dict[str, str]:
    """Text of a run's files of inputs, by name; the first has this name and header, and more lines."""
    described = (measured.folder / FILE).read_bytes()
    lines = [header, f'experiments_sha256 = "{hashlib.sha256(described).hexdigest()}"', *more]
    lines += ["", "[data]"]
    for e in measured.experiments:
        lines.append(f"{json.dumps(e.name, ensure_ascii=False)} = {json.dumps([e.kind, e.role, e.sha256])}")
    found = {name: "\n".join(lines) + "\n"}
    return found if unit is None else found | {UNIT: to_toml(unit)}


def _place(where: str) -> str:
    """A place in a file without the folders above it."""
    path, comma, rest = where.partition(", ")
    return Path(path).name + comma + rest


def curves(found: Diagnosis) -> list[Curve]:
    """Every predicted channel of every experiment, in the order of the folder."""
    simulator = found.simulator
    listed = []
    for e, judged in zip(found.measured.experiments, found.verdict.experiments, strict=True):
        if not simulator.knows(e):
            continue
        before = simulator.predict(judged, found.before)
        after = simulator.predict(judged, found.after)
        for row, channel in enumerate(simulator.channels(e)):
            listed.append(Curve(e, channel, e[channel], before[row], after[row]))
    return listed


def _write_residuals(found: Diagnosis, path: Path) -> None:
    rows = [
        (c.experiment.name, c.experiment.role, c.channel, int(row), m, b, a)
        for c in curves(found)
        for row, m, b, a in zip(
            c.experiment.rows, c.measured.tolist(), c.before.tolist(), c.after.tolist(), strict=True
        )
    ]
    head = ["experiment", "role", "channel", "row", "measured", "base_model", "extended_model"]
    write_csv(path, head, rows)


def readable(name: str) -> str:
    """An effect's or quantity's name as it is said."""
    return name.replace("_", " ")


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: "a, b and c"."""
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + f" {last} " + names[-1]


def bare(p: Parameter) -> str:
    """A parameter's name as it is said, without the unit that stands behind its value."""
    unit = p.unit.replace("1/", "per_").replace("/", "_")
    return readable(p.name.removesuffix(f"_{unit}") if unit else p.name)


def between(low: float, high: float) -> str:
    """An interval in as few figures as tell its ends apart, three at least."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "not known"
    for digits in range(3, 7):
        ends = f"{low:.{digits}g}", f"{high:.{digits}g}"
        if ends[0] != ends[1]:
            break
    return f"{ends[0]} to {ends[1]}"


def sized(verdict: Verdict, cause: Cause) -> str:
    """Parameters of a cause with their intervals in words."""
    said = []
    for key, p in zip(cause.effect.keys, cause.effect.parameters, strict=True):
        low, high = verdict.intervals.get(key, (math.nan, math.nan))
        unit = f" {p.unit}" if p.unit else ""
        value = verdict.selection.chosen.values[key]
        said.append(f"{bare(p)} {value:.3g}{unit} (95 %: {between(low, high)})")
        if (cause.effect.name, p.name) == ("overcure", "offset_mm"):
            said.append(f"of every surface, so that struts and walls are {2 * value:.2g} mm thicker")
    return ", ".join(said)


def sentence(verdict: Verdict) -> tuple[str, str]:
    """The verdict in words: its headline, and one plain sentence."""
    found = verdict.selection
    if verdict.kind == "named":
        said = [f"{_upper(c.effect.mechanism)}; {sized(verdict, c)}." for c in found.causes]
        return listed([readable(n) for n in verdict.names]), " ".join(said)
    if verdict.kind == "ambiguous":
        choices = [listed([readable(n) for n in (c.effect.name, *c.rivals)], "or") for c in found.causes]
        said = [f"{readable(c.effect.name)} has {sized(verdict, c)}" for c in found.causes]
        return (
            " and ".join(choices),
            "The model is wrong. Each of these effects explains the data, and these data do not "
            f"distinguish them. Fitted values: {'; '.join(said)}.",
        )
    if verdict.kind == "none":
        return (
            "no model error detected",
            "The residual is consistent with instrument noise. An effect larger than its limit in the "
            "table below would have been detected.",
        )
    if verdict.kind == "unidentifiable":
        return (
            "not identifiable",
            "The model fits the data only with a parameter far from its known value. More data of "
            "this kind cannot identify the cause.",
        )
    where = [readable(n) for n in found.left if n != SPREAD]
    tried = (
        "The residual exceeds the standard deviation given with the data. " if SPREAD in found.left else ""
    )
    tried += f"The residual depends on {listed(where)}. " if where else ""
    if found.doubted:
        tried += f"{_upper(readable(found.doubted))}. "
    if found.chosen.effects:
        names = listed([readable(n) for n in found.chosen.names])
        tried += f"The best fit, {names}, is not named because its residual has structure."
    return (
        "unexplained by any known effect",
        f"The model is wrong, and no effect of the library explains it. {tried}".strip(),
    )


def advice(verdict: Verdict) -> str:
    """What to measure next, in words."""
    if verdict.proposal is not None:
        told = listed([readable(n) for n in verdict.proposal.separates])
        return f"{_upper(verdict.proposal.what)}. It distinguishes {told}."
    found = verdict.selection
    if verdict.kind == "named":
        return f"To confirm it on new data: {'; '.join(c.effect.reveals for c in found.causes)}."
    if verdict.kind == "unexplained":
        places = [d for d in found.table if d.against in found.left and d.where and d.against != SPREAD]
        places.sort(key=lambda d: d.p_value)
        at = f" The deviation is largest at: {places[0].where}." if places else ""
        return f"Repeat an experiment unchanged: what does not recur is not a model error.{at}"
    hidden = [s for s in best_seen(verdict.seen).values() if not s.identifiable]
    if not hidden:
        return ""
    shown = dict.fromkeys(s.effect.reveals for s in hidden)
    some = list(shown)[:3]
    return (
        f"These data cannot identify {listed([readable(s.effect.name) for s in hidden])}. To identify "
        f"more: {'; or '.join(some)}."
    )


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def summary(found: Diagnosis) -> dict[str, Any]:
    """Every figure of a diagnosis in plain data."""
    verdict = found.verdict
    headline, words = sentence(verdict)
    return {
        "verdict": verdict.kind,
        "headline": headline,
        "sentence": words,
        "next": advice(verdict),
        "causes": verdict.as_json()["causes"],
        "gain": verdict.gain.as_json(),
        "experiments": {e.name: [e.kind, e.role] for e in found.measured.experiments},
        "noise": {group: attrs.asdict(source) for group, source in verdict.sources.items()},
        "predictions": found.simulator.calls,
        "remarks": list(found.remarks),
    }


def console_summary(summary: Mapping[str, Any]) -> list[str]:
    """What a diagnosis found, in a few lines of text, of its `summary`."""
    lines = [f"verdict: {summary['verdict']}: {summary['headline']}", summary["sentence"]]
    for name, words in (("fit", "fitted data"), ("held_out", "held-out data")):
        errors = summary["gain"][name]
        if errors and summary["causes"]:
            before, after = errors["rmse_before"], errors["rmse_after"]
            lines.append(f"error on {words}: {before:.3g} -> {after:.3g} {errors['unit']}")
    return [*lines, f"next: {summary['next']}"] if summary["next"] else lines
