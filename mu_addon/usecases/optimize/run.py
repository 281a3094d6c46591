"""An optimisation in its folder: each unit computed once, a table kept up to date, proposals checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit, write_unit
from ...design.printing.printer import load_printer
from ...errors import InputError, OutputError
from ...files import write_csv
from ...materials.library import material_text
from ...optimization.design_file import Design
from ...optimization.evaluation import Candidate, Evaluated, Evaluator, evaluate
from ...optimization.robustness import Verified, verified
from ...optimization.search import Found, Observed, Values, search_units
from ...optimization.uncertainty import SURE
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from . import charts
from .expected import MOST_CHECKED, search_plan
from .files import FRONT, LAYOUT, MODEL, REPORT, TABLE
from .job import Job, mechanics_of, read_job
from .report import write_report
from .words import changes, outcome, reasons, verdict
from .worker import asked_of, several


@attrs.frozen(eq=False)
class Proposal:
    """A proposed unit: its rank from 1, its design's number, and its results.

    values (q,): on the search's mesh; checked: on a finer one; changes, reasons: as text. choice: path and
    resin, if they were free, by the freedom's name.
    """

    place: int
    number: int
    unit: Unit
    observed: Observed
    values: Array
    checked: Verified
    changes: tuple[str, ...]
    reasons: tuple[str, ...]
    choice: Mapping[str, str] = attrs.field(factory=dict)


@attrs.frozen(eq=False)
class Optimised:
    """Result of an optimisation: the search, its proposals, a text on the outcome, and its cost.

    computed: units simulated by this run; model_a: Model A's, those of earlier runs in the folder included.
    """

    design: Design
    search: Found
    proposals: tuple[Proposal, ...]
    words: str
    computed: int
    model_a: int
    has_model: bool = False
    left_out: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the targets."""
        return [t.name for t in self.design.targets]


Array = np.ndarray[Any, Any]

FIRST_PART = 0.6
"""Share of a robust search's evaluations before the finer mesh's change at its best unit is computed."""
LARGEST_CHANGE = 0.5
"""Largest share by which a finer mesh is assumed to change a value."""


def optimise(job: Job, folder: Path, context: RunContext) -> Optimised:
    """Search for a job's units, check the proposals, and write table, units and report.

    Units computed by an earlier run in the folder are not computed again. Raises InputError, OutputError and
    MuError where a worker or the scheduler is lost.
    """
    design, progress = job.design, context.progress
    mechanics, left_out = mechanics_of(design, job.model)
    for words in left_out:
        progress.warning(f"the model's {words}", MODEL)
    run = _Run(job, folder, context, mechanics.settings.refine)
    texts = job.texts()
    origin = "\n".join(texts.get(name, "") for name in (MODEL,)) + run.asked
    evaluator = Evaluator(
        design.targets,
        design.freedoms,
        mechanics,
        Cache(folder / "cache"),
        origin,
        several(job, progress.warning),
        uncertainty=design.uncertainty if design.robust else None,
        of_choice=lambda choice: asked_of(job, choice),
    )
    run.evaluator = evaluator
    start = Observed(design.start, np.empty(0), np.empty((0, 0)), False)
    try:
        with progress.stage("search"):
            found = run.robust_search() if design.robust else run.search()
    finally:
        with suppress(OutputError):
            run.write(())
    proposals = run.proposals(found, start)
    result = Optimised(
        design,
        found,
        tuple(proposals),
        f"{outcome(found, design.targets)} {verdict([p.checked for p in proposals])}".strip(),
        evaluator.computed,
        evaluator.model_a,
        job.model is not None,
        tuple(left_out),
    )
    run.write(tuple(p.number for p in proposals))
    pair = charts.compared(result)
    if pair is not None:
        charts.front_picture(result, *pair, folder / FRONT)
    else:
        (folder / FRONT).unlink(missing_ok=True)
    context.summary |= summary(result)
    context.report = lambda stopped: write_report(result, folder / REPORT, progress, stopped)
    return result


@attrs.define
class _Run:
    """State of an optimisation."""

    job: Job
    folder: Path
    context: RunContext
    refine: float
    evaluator: Evaluator = attrs.field(init=False)
    rows: list[tuple[Values, Evaluated | None]] = attrs.field(factory=list)
    mesh_change: Array | None = None

    @property
    def settings(self) -> Any:
        """Settings of the search, with as many designs at a time as there are workers."""
        search = self.job.design.search
        batch = max(search.batch, self.job.workers if self.job.scheduler is None else search.batch)
        return attrs.evolve(search, batch=batch)

    @property
    def asked(self) -> str:
        """All inputs besides the unit that decide its values and slopes, as text."""
        design = self.job.design
        return repr(
            (
                [(t.kind, t.quantity) for t in design.targets],
                [(f.name, f.low, f.high, tuple(f.also.items())) for f in design.freedoms if not f.discrete],
                design.settings,
                (design.orientation_deg, design.material.density_g_per_ml),
                {name: material_text(m) for name, m in design.materials.items()},
                (design.body.hash if design.body else "", design.self_contact),
                design.uncertainty if design.robust else None,
            )
        )

    def search(self, share: float = 1.0, known: Sequence[Observed] = ()) -> Found:
        """Search with a share of the evaluations, from known designs where there are any."""
        design, settings = self.job.design, self.settings
        settings = attrs.evolve(settings, evaluations=max(1, round(share * settings.evaluations)))
        return search_units(
            design.freedoms, design.targets, self.observe, design.start, settings, self.step, known
        )

    def robust_search(self) -> Found:
        """Search by values expected on the finer mesh: by the start's change, then by the best unit's."""
        design = self.job.design
        self.mesh_change = self.change_by_mesh(self.candidate(design.start, design.unit))
        found = self.search(FIRST_PART)
        best = found.observed[found.proposed[len(found.proposed) // 2]]
        if not best.sound:
            return self.search(1.0, self._known())
        self.mesh_change = self.change_by_mesh(self.candidate(best.design))
        return self.search(1.0, self._known())

    def _known(self) -> list[Observed]:
        return [self._observed(values, found) for values, found in self.rows]

    def candidate(self, values: Values, unit: Unit | None = None) -> Candidate:
        """A design's unit, by default of its values, with the path and the resin that it chose."""
        design = self.job.design
        choice = tuple(design.choice(values).items())
        return Candidate(design.unit_of(values) if unit is None else unit, choice)

    def change_by_mesh(self, candidate: Candidate) -> Array:
        """Share (q,) by which each value of a unit changes from the search's mesh to the finer one.

        0 where it fails on either.
        """
        design = self.job.design
        unit, own = candidate.unit, candidate.choice or ""
        name = key("change by mesh 1", unit.hash(), self.asked, design.check_refine, self._model_text, own)
        cache = self.evaluator.cache
        kept = None if cache is None else cache.get("mesh", name)
        if kept is not None:
            return np.asarray(kept["change"])
        targets, finer = asked_of(self.job, dict(candidate.choice), design.check_refine)
        [coarse] = self.evaluator.of([candidate])
        fine = evaluate(unit, targets, (), finer).values - coarse.values
        share = np.divide(fine, coarse.values, out=np.zeros_like(fine), where=coarse.values != 0)
        change = np.clip(np.nan_to_num(share), -LARGEST_CHANGE, LARGEST_CHANGE)
        if cache is not None:
            cache.put("mesh", name, {"change": change})
        return change

    @property
    def _model_text(self) -> str:
        return "" if self.job.model is None else self.job.model.text()

    def _observed(self, values: Values, found: Evaluated | None) -> Observed:
        """A computed unit as input of the search; if it shall be robust, as expected on the finer mesh.

        None: one that breaks a rule of units.
        """
        if found is None:
            design = self.job.design
            none = len(design.targets), sum(not f.discrete for f in design.freedoms)
            return Observed(values, np.full(none[0], np.nan), np.full(none, np.nan), False)
        if self.mesh_change is None:
            return Observed(values, found.values, found.gradient, found.sound)
        by_mesh, factor = self.mesh_change * found.values, 1.0 + self.mesh_change
        error = np.sqrt(by_mesh**2 + found.by_print**2 + found.by_resin**2)
        slopes = factor[:, None] * found.gradient
        return Observed(values, factor * found.values, slopes, found.sound, SURE * np.nan_to_num(error))

    def observe(self, designs: Sequence[Values]) -> list[Observed]:
        """Designs as input of the search; one that breaks a rule of units is not computed."""
        units: list[Candidate | None] = []
        for values in designs:
            try:
                units.append(self.candidate(values))
            except InputError:
                units.append(None)
        found = iter(self.evaluator.of([u for u in units if u is not None]))
        observed = []
        for values, unit in zip(designs, units, strict=True):
            result = None if unit is None else next(found)
            self.rows.append((values, result))
            observed.append(self._observed(values, result))
        self.write(())
        return observed

    def step(self, done: int, words: str) -> None:
        """Report progress of the search."""
        self.context.progress.update(min(done / self.settings.evaluations, 1.0), f"{done} units, {words}")

    def proposals(self, found: Found, start: Observed) -> list[Proposal]:
        """Proposals simulated on a finer mesh and checked for print, each written as a unit's file."""
        design, progress = self.job.design, self.context.progress
        chosen = _spread(found.proposed, MOST_CHECKED)
        sound = [n for n in chosen if found.observed[n].sound]
        printer = load_printer(design.printer) if any(t.kind == "printable" for t in design.targets) else None
        proposals = []
        with progress.stage("check of what is proposed"):
            for place, number in enumerate(sound, 1):
                observed = found.observed[number]
                unit = attrs.evolve(design.unit_of(observed.design), name=f"proposed-{place}")
                choice = design.choice(observed.design)
                targets, finer = asked_of(self.job, choice, design.check_refine)
                result = self.rows[number][1]
                assert result is not None
                name = key(
                    "verified 3", attrs.evolve(unit, name="unit").hash(), self.asked, design.check_refine,
                    design.print_tolerance_mm, design.modulus_tolerance, design.printer if printer else "",
                    self._model_text,
                    [(t.value, t.tolerance, t.low, t.high, t.goal) for t in design.targets], choice,
                )  # fmt: skip
                checked = self._kept(name)
                if checked is None:
                    checked = verified(unit, result.values, targets, finer, design.uncertainty, printer)
                    self._keep(name, checked)
                write_unit(unit, self.folder / f"proposed-{place}.toml")
                charts.picture(unit, self.folder / f"proposed-{place}.png", design.body)
                proposals.append(
                    Proposal(
                        place,
                        number,
                        unit,
                        observed,
                        result.values,
                        checked,
                        tuple(changes(design.freedoms, design.start, observed.design)),
                        tuple(reasons(design.freedoms, design.targets, observed, design.start)),
                        choice,
                    )
                )
                progress.update(place / len(sound))
        return proposals

    def _keep(self, name: str, found: Verified) -> None:
        arrays = attrs.asdict(found, recurse=False)
        arrays["print_findings"] = np.array(found.print_findings, dtype=np.str_)
        self.evaluator.cache.put("verified", name, arrays) if self.evaluator.cache else None

    def _kept(self, name: str) -> Verified | None:
        found = None if self.evaluator.cache is None else self.evaluator.cache.get("verified", name)
        if found is None:
            return None
        why, worst = (str(found.pop(k)) for k in ("why", "print_worst"))
        findings = tuple(map(str, found.pop("print_findings")))
        return Verified(**found, why=why, print_worst=worst, print_findings=findings)

    def write(self, proposed: Sequence[int]) -> None:
        """Write designs.csv: a row for every design, failed ones included."""
        design = self.job.design
        judged = [(i, t) for i, t in enumerate(design.targets) if t.quantity is not None]
        head = ["design", *(f.name for f in design.freedoms)]
        head += [f"{t.name} [{t.unit}]" if t.unit else t.name for _, t in judged]
        head += ["meets_all", "proposed", "what"]
        rows = []
        for number, (values, result) in enumerate(self.rows):
            if result is None:
                cells, meets, why = [""] * len(judged), "no", "breaks a rule of units"
            else:
                cells = ["" if np.isnan(result.values[i]) else f"{result.values[i]:.7g}" for i, _ in judged]
                good = result.sound and all(t.met(result.values[i]) for i, t in judged)
                meets, why = "yes" if good else "no", result.why
            shown = [f"{v:.9g}" if isinstance(v, float) else v for v in values]
            rows.append([number + 1, *shown, *cells, meets, "yes" if number in proposed else "no", why])
        write_csv(self.folder / TABLE, head, rows)


def _spread(numbers: Sequence[int], most: int) -> list[int]:
    """At most so many of some numbers in order, the first and the last among them."""
    if len(numbers) <= most:
        return list(numbers)
    return [numbers[i] for i in np.unique(np.linspace(0, len(numbers) - 1, most).round().astype(int))]


def summary(found: Optimised) -> dict[str, Any]:
    """Figures of an optimisation for summary.json."""
    return {
        "outcome": found.words,
        "feasible": found.search.feasible,
        "in_the_way": list(found.search.in_the_way),
        "designs": len(found.search.observed),
        "simulated_now": found.computed,
        "model_a": found.model_a,
        "front": len(found.search.proposed),
        "proposed": [
            {
                "file": f"proposed-{p.place}.toml",
                **p.choice,
                "robust": p.checked.is_robust,
                "printable": p.checked.print_worst or "not asked",
                "values": dict(zip(found.names, map(float, p.checked.values), strict=True)),
                "standard_error": dict(zip(found.names, map(float, p.checked.error), strict=True)),
                "changes": list(p.changes),
                "reasons": list(p.reasons),
                "targets": _judged(found, p),
            }
            for p in found.proposals
        ],
    }


def _judged(found: Optimised, proposal: Proposal) -> list[dict[str, Any]]:
    """Every target with a proposed unit's value on the finer mesh, and True if it is met."""
    checked = proposal.checked
    return [
        {
            "name": t.name,
            "asked": t.words,
            "unit": t.unit,
            "value": float(checked.values[i]),
            "standard_error": float(checked.error[i]),
            "objective": t.goal is not None,
            "met": bool(checked.met[i]),
            "robust": bool(checked.robust[i]),
        }
        for i, t in enumerate(found.design.targets)
    ]


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on an optimisation's `summary`."""
    if "outcome" not in summary:
        return []
    lines = [summary["outcome"], f"{summary['designs']} units computed, {summary['model_a']} Model A's"]
    for p in summary["proposed"]:
        values = ", ".join(f"{n} {v:.4g}" for n, v in p["values"].items() if v == v)
        robust = "robust" if p["robust"] else "not robust"
        lines.append(f"{p['file']}: {robust}; print check: {p['printable']}; {values}")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of an optimisation with the expected seconds of each on two cores."""
    design = job.design
    objectives = sum(t.goal is not None for t in design.targets)
    conditions = {c for t in design.targets if t.quantity is not None for c in t.quantity.conditions}
    states = sum(condition.pressure_kPa != 0.0 for condition in conditions)
    return search_plan(
        design.search.evaluations,
        design.settings.refine,
        design.check_refine,
        design.self_contact,
        objectives,
        states,
    )


KEPT = ("search", "check of what is proposed")
USE_CASE = UseCase("optimize", LAYOUT, read_job, optimise, console_summary, plan=plan_of, kept=KEPT)
