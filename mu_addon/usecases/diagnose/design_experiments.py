"""Design of experiments: which effects planned experiments can detect, and the smallest detectable sizes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit, read_unit, to_toml
from ...errors import InputError
from ...evidence.fit import Fitter
from ...evidence.noise import Source
from ...evidence.record import KNOWN, Record, record
from ...evidence.sensitivity import Sensitivity, sensitivities, similarity
from ...evidence.simulator import Composite
from ...evidence.unit_fem import UnitSettings
from ...files import write_csv, write_text
from ...measured import Experiment, Measured, read_folder
from ...measured.folder import described, experiments_digest, require_same_data
from ...measured.kinds import NOISE
from ...meshing.settings import SELF_CONTACT
from ...report.html import facts_table, note, page, table
from ...run.context import RunContext
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, named_path, read_inputs
from ...run.usecase import UseCase
from ...run.versions import package_versions
from ...toml_writer import toml_text
from .job import UNIT, self_contact_in, self_contact_of, unit_behind, unit_settings_of
from .simulators import simulations_plan, simulators_of
from .words import bare, listed, readable

Array = np.ndarray[Any, Any]

LAYOUT = FolderLayout(
    "protocols.toml",
    "# The inputs of this design of experiments; its protocols are named by the SHA-256 of their files.",
    results=("limits.csv", "report.html"),
    optional=(UNIT,),
)
SENSITIVITIES_S = 1.5
# Half of the variance wanders, as slowly as a tenth of the longest record.
SLOW = 0.1
# Effects that look as much alike as this cannot be distinguished.
ALIKE = 0.95


@attrs.frozen(eq=False)
class Plan:
    """Results of planned experiments: every effect, visible ones first; alike: pairs with their cosine."""

    experiments: tuple[Experiment, ...]
    seen: tuple[Sensitivity, ...]
    alike: tuple[tuple[str, str, float], ...]
    noise: Mapping[str, float]


def noise_of(words: Sequence[str]) -> dict[str, float]:
    """Noise by quantity, from text like "angle=0.5", the rest as in `NOISE`. Raises InputError."""
    found = dict(NOISE)
    for word in words:
        name, _, text = word.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if name not in NOISE or not (math.isfinite(value) and value > 0):
            raise InputError(
                f"{word!r} is not a noise level", "--noise", f"write QUANTITY=VALUE, of {', '.join(NOISE)}"
            )
        found[name] = value
    return found


@attrs.frozen(eq=False)
class Job:
    """Inputs of a design of experiments.

    measured: laid out as for `diagnose`; columns to be measured may hold any numbers. unit: by default the
    preset. noise: standard deviation of a reading, by quantity. self_contact: of the unit's walls and struts.
    settings: of its simulation, in place of the printed body's.
    """

    measured: Measured
    unit: Unit | None = None
    noise: Mapping[str, float] = attrs.field(factory=lambda: dict(NOISE))
    self_contact: bool = SELF_CONTACT.field()
    settings: UnitSettings | None = None

    @property
    def unit_settings(self) -> UnitSettings:
        """Settings of the unit's simulation: of every effect at its first sizes alone."""
        return attrs.evolve(unit_settings_of(self), whole=None)

    @property
    def subject(self) -> Unit | None:
        """Unit that the experiments are made with."""
        return unit_behind(self.measured.experiments, self.unit)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; protocols.toml is the first."""
        values = {
            "format": FORMAT,
            "experiments_sha256": experiments_digest(self.measured),
            **self.noise,
            **self_contact_of(self),
            "data": described(self.measured),
            "run": {"data": str(self.measured.folder.resolve())},
        }
        texts = {LAYOUT.inputs: toml_text(values, LAYOUT.header)}
        return texts if self.subject is None else texts | {UNIT: to_toml(self.subject)}


def read_job(folder: Path) -> Job:
    """The job that a folder of `design-experiments` describes, its protocols in place; InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    measured = read_folder(named_path(path, run, "data", "folder of measured data"))
    require_same_data(measured, values.get("data"), described(measured))
    unit = folder / UNIT
    noise = noise_of([f"{name}={values[name]}" for name in NOISE if name in values])
    return Job(
        measured,
        read_unit(unit) if unit.is_file() else None,
        noise,
        **self_contact_in(values),
    )


def design_experiments(job: Job, folder: Path, context: RunContext) -> Plan:
    """Find detection limits of planned experiments with noisy instruments; writes limits.csv and report.html.

    Raises InputError, OutputError.
    """
    measured, progress = job.measured, context.progress
    settings = job.unit_settings
    simulators, remarks = simulators_of(
        measured.experiments, job.subject, folder / "cache", progress, settings
    )
    simulator = Composite(simulators)
    with progress.stage("sensitivities", expected_s=SENSITIVITIES_S):
        found = plan(measured.experiments, simulator, job.noise)
    _write(found, folder / "limits.csv")
    context.summary |= summary(found)
    name = measured.folder.resolve().name
    context.report = lambda stopped: write_text(
        folder / "report.html", _report(found, name, remarks, package_versions(), stopped)
    )
    return found


def plan(experiments: Sequence[Experiment], simulator: Composite, noise: Mapping[str, float] = NOISE) -> Plan:
    """Plan of experiments, whatever they measured so far."""
    expected = tuple(_expected(e, simulator) for e in experiments if simulator.knows(e))
    planned = record(expected, simulator)
    fitter = Fitter(planned, simulator, _sources(planned, noise))
    values = {p.name: p.null for p in fitter.curved}
    # Of each effect the shape that is seen soonest.
    least: dict[str, Sensitivity] = {}
    for s in sensitivities(fitter, values):
        if s.effect.name not in least or s.limit < least[s.effect.name].limit:
            least[s.effect.name] = s
    seen = sorted(least.values(), key=lambda s: (not s.identifiable, s.limit))
    shown = [s for s in seen if s.identifiable]
    alike = []
    if len(shown) > 1:
        cosines = similarity(shown)
        for i, a in enumerate(shown):
            for j in range(i + 1, len(shown)):
                if abs(cosines[i, j]) > ALIKE:
                    alike.append((a.effect.name, shown[j].effect.name, float(cosines[i, j])))
    return Plan(expected, tuple(seen), tuple(sorted(alike, key=lambda p: -abs(p[2]))), noise)


def _expected(e: Experiment, simulator: Composite) -> Experiment:
    """The experiment with the base model's prediction as its data."""
    columns = dict(zip(simulator.channels(e), simulator.predict(e, {}), strict=True))
    # Channels that are alike to the last digit would be taken for one.
    columns = {c: y + 1e-9 * k for k, (c, y) in enumerate(columns.items())}
    return attrs.evolve(e, columns={**e.columns, **columns})


def _sources(planned: Record, noise: Mapping[str, float]) -> dict[str, Source]:
    found = {}
    for group in planned.groups:
        if group == KNOWN:
            continue
        members = [s for s in planned.series if s.group == group]
        head = members[0].channel.rpartition("_")[0]
        quantity = "marker" if head.startswith("marker") else head
        if quantity not in noise:
            raise InputError(
                f"no noise level of {quantity} is given", "--noise", f"known: {', '.join(noise)}"
            )
        size = noise[quantity] * math.sqrt(0.5)
        times = [s.time_s for s in members if not math.isnan(s.sample_s)]
        longest = max((float(t[-1] - t[0]) for t in times), default=1.0)
        found[group] = Source(size if times else noise[quantity], size if times else 0.0, SLOW * longest)
    return found


def _limit(s: Sensitivity) -> str:
    p = s.effect.parameters[0]
    return f"{bare(p)} {s.limit:.3g} {p.unit}".strip() if s.identifiable else "not detectable"


def _write(found: Plan, path: Path) -> None:
    rows = []
    for s in found.seen:
        p = s.effect.parameters[0]
        alike = [b if a == s.effect.name else a for a, b, _ in found.alike if s.effect.name in (a, b)]
        rows.append(
            (s.effect.name, p.name, p.unit, s.limit, s.unabsorbed, int(s.identifiable), " ".join(alike))
        )
    head = ["effect", "parameter", "unit", "visible_from", "not_absorbed", "visible", "looks_like"]
    write_csv(path, head, rows)


def _report(found: Plan, name: str, remarks: Sequence[str], versions: Mapping[str, str], stopped: str) -> str:
    rows = []
    for s in found.seen:
        alike = [b if a == s.effect.name else a for a, b, _ in found.alike if s.effect.name in (a, b)]
        by = listed([readable(n) for n in s.absorbed_by]) if s.absorbed_by else ""
        cells = [
            readable(s.effect.name),
            _limit(s),
            f"{s.unabsorbed:.1%}" if s.unabsorbed else "–",
            ""
            if s.identifiable
            else (f"absorbed by {by}" if by and s.unabsorbed else "no measured quantity depends on it"),
            listed([readable(a) for a in alike]) if alike else "",
            s.effect.reveals,
        ]
        rows.append((cells, s.identifiable))
    head = [
        ("effect", ""),
        ("detectable from", "line"),
        ("not absorbed", "n"),
        ("reason if not", "text"),
        ("similar to", "text"),
        ("best experiment to detect it", "text"),
    ]
    html = (
        "<p>An effect of the given size is detected in nearly every set of such data (χ² of 16). "
        "“Not absorbed” is the share of its signature that fitted moduli and zeros cannot reproduce. "
        f"Effects whose signatures have a similarity above {ALIKE:g} (cosine) can be distinguished "
        "only by another experiment.</p>" + table("", head, rows)
    )
    noise = {readable(k): v for k, v in found.noise.items()}
    sections = [
        ("limits", "Detectable effects", html),
        (
            "noise",
            "Noise of a reading",
            facts_table("quantity", "in the unit of its column", noise),
        ),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    count = len(found.experiments)
    subtitle = f"{count} experiment{'s' if count != 1 else ''}, planned"
    shown = sum(s.identifiable for s in found.seen)
    share = f"<strong>{shown} of {len(found.seen)}</strong>"
    lead = f'<p class="answer">These experiments can detect {share} effects.</p>'
    return page(f"Experiments planned in {name}", subtitle, note(remarks, stopped), lead, sections)


def summary(found: Plan) -> dict[str, Any]:
    """Every figure of a plan in plain data."""
    return {
        "visible": {s.effect.name: [_limit(s), s.limit] for s in found.seen if s.identifiable},
        "hidden": {s.effect.name: s.effect.reveals for s in found.seen if not s.identifiable},
        "alike": [list(pair) for pair in found.alike],
        "noise": dict(found.noise),
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a plan's `summary`."""
    lines = [f"{readable(name)}: detectable from {limit}" for name, (limit, _) in summary["visible"].items()]
    if summary["hidden"]:
        lines.append(f"not detectable: {listed([readable(n) for n in summary['hidden']])}")
    lines += [
        f"similar signatures: {readable(a)} and {readable(b)} ({c:.3f})" for a, b, c in summary["alike"][:5]
    ]
    return lines


USE_CASE = UseCase(
    "design-experiments",
    LAYOUT,
    read_job,
    design_experiments,
    console_summary,
    plan=lambda job: [
        *simulations_plan(job.measured.experiments, job.subject, job.unit_settings),
        ("sensitivities", SENSITIVITIES_S),
    ],
)
