"""`optimize`: units that meet the targets of a design, searched, checked on a finer mesh and shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any, TypeAlias

import attrs

from .. import design as designs
from .. import evidence, optimization
from ..design.quantity import described
from ..errors import InputError
from ..graph.definition import Setting
from ..optimization.settings import BODY, DESIGN, RESIN, UNIT, WORKERS
from ..run.parts import Beside, Chart, Fact, File, Part, Sentence, Table, Warn, csv, echo, recorded
from ..run.study import (
    Dropped,
    Node,
    Over,
    Study,
    derived,
    given,
    grown,
    section,
    stage,
)
from .inputs import MODEL, FileInput, ModelInput, SchedulerInput, once

FRONT = "front.png"
SEARCH, CHECK = "search", "check of what is proposed"
MOST_CHECKED = 6
"""Most units of a front that are simulated again on a finer mesh: its ends and some evenly between."""
_A_STATE_S, _BY_REFINEMENT = 76.0, 1.8
"""Seconds of a state with its slopes at a refinement of 1, and the exponent of the refinement."""
_CHECKED, _APART = 1.2, 3.0
"""Factors on that of a unit that is checked, and of walls and struts that are kept apart."""
PROPOSED = described("proposed", 1, "which of the proposed units", low=1, high=MOST_CHECKED)
NO_UNIT = "breaks a rule of units"

Units = Mapping[Any, "optimization.Evaluated"]
"""Simulated units by values of the freedoms, refinement and whether slopes were asked for."""
Results: TypeAlias = "optimization.Found"
Checked = Mapping[int, "optimization.Verified"]
"""Proposed units on the finer mesh, by their place."""


def expected_s(
    units: int, refine: float, check_refine: float, self_contact: bool, objectives: int = 2, states: int = 2
) -> dict[str, float]:
    """Expected seconds of each stage of a search among so many units, on two cores.

    refine: of the search's mesh; check_refine: of the check of its proposals, a single one with fewer than
    two objectives; states: of a unit, under the targets' pressures.
    """

    def seconds(refine: float) -> float:
        return max(states, 1) * _A_STATE_S * refine**_BY_REFINEMENT * (_APART if self_contact else 1.0)

    checked = min(MOST_CHECKED, units) if objectives > 1 else 1
    return {SEARCH: seconds(refine) * units, CHECK: _CHECKED * seconds(check_refine) * checked}


def _seconds(study: Optimize, title: str) -> float:
    d = study.design
    conditions = {c for t in d.targets if t.quantity is not None for c in t.quantity.conditions}
    states = sum(condition.pressure_kPa != 0.0 for condition in conditions)
    settings = d.settings.refine, d.check_refine, d.self_contact
    return expected_s(d.search.evaluations, *settings, study.objectives, states)[title]


@attrs.frozen
class DesignInput(FileInput):
    """Targets and freedoms."""

    kind: str = "design"
    file: str = DESIGN
    load: Callable[[Path], Any] = lambda path: optimization.read_design(path)
    descriptions: tuple[Any, ...] = (
        described("file", "", "targets and freedoms, a design.toml: see docs/guide/search.md"),
    )
    argument: str = "FILE"

    def texts(self, name: str, value: optimization.Design) -> dict[str, str]:
        """Texts of it and those beside it."""
        return value.texts()

    def file_names(self, name: str) -> tuple[str, ...]:
        """Its files."""
        return (DESIGN, UNIT, RESIN, "resin-*.toml", BODY)


def _of_node(done: Any, call: Any) -> dict[str, Any]:
    """The unit that a node gives of a finished search, and a remark on it; raises InputError."""
    rows, number = done.summary["proposed"], call.settings[PROPOSED.name]
    if number > len(rows):
        raise InputError(
            f"{len(rows)} units are proposed: there is no number {number}",
            PROPOSED.name,
            f"choose 1 to {len(rows)}" if rows else f"see the outcome: {done.summary['outcome']}",
        )
    row, design = rows[number - 1], call.inputs["unit"]
    unit = attrs.evolve(designs.read_unit(done.folder / row["file"]), name=design.unit.name)
    missed = [target["name"] for target in row["targets"] if not target["met"]]
    remark = f"misses {', '.join(missed)}" if missed else "meets every target"
    return {"unit": attrs.evolve(design, unit=unit, path=row.get("path", design.path)), "remark": remark}


@attrs.frozen(kw_only=True, eq=False)
class Optimize(Study):
    """Find units that meet targets: bending angles, stiffness, stretch, mass, printability and more."""

    name = "optimize"
    example = "optimize assets/examples/stronger-finger/design.toml --out out/finger"
    node = Node(
        "Optimize",
        "a unit that meets the targets of a design.toml, found from the linked one",
        (("unit", "unit", "the proposed unit"),),
        lambda summary: "",
        read=_of_node,
        hidden=("scheduler",),
        settings=(Setting(PROPOSED),),
        passes=("unit", "the unit is passed on unchanged"),
    )
    files = {
        "designs.csv": "every unit that was computed: its freedoms, and the targets' values",
        "proposed-*.toml": "the proposed units",
        "proposed-*.png": "their half sections",
        FRONT: "all units by two of the targets",
    }

    design: optimization.Design = given(DesignInput())
    model: evidence.ExtendedModel | None = given(ModelInput(), default=None)
    workers: int = once(WORKERS, metavar="N")
    scheduler: str = given(SchedulerInput(), default="")

    @property
    def objectives(self) -> int:
        """Number of objectives."""
        return sum(t.goal is not None for t in self.design.targets)

    @derived
    def simulated(self, design: optimization.Design) -> optimization.Design:
        """What decides a unit's values."""
        return design.simulated

    @derived
    def bare(self, design: optimization.Design) -> optimization.Design:
        """The design, however it is written."""
        return design.bare

    @stage(
        SEARCH,
        lambda study: _seconds(study, SEARCH),
        over=Over(
            ("values", "refine", "slopes"),
            lambda study: (),
            grows=lambda study: optimization.unit_search(study.design, study.workers),
            most=lambda study: study.design.search.evaluations,
        ),
        parallel=True,
    )
    def units(
        self,
        values: tuple[Any, ...],
        refine: float,
        slopes: bool,
        simulated: optimization.Design,
        model: evidence.ExtendedModel | None,
    ) -> optimization.Evaluated:
        """A unit's values and slopes; one that breaks a rule of units has none."""
        import numpy as np

        try:
            unit = simulated.unit_of(values)
        except InputError:
            count = len(simulated.targets)
            slopes_of = np.full((count, sum(not f.discrete for f in simulated.freedoms)), np.nan)
            return optimization.Evaluated(np.full(count, np.nan), slopes_of, NO_UNIT, 0)
        chosen = simulated.chosen(simulated.choice(values))
        mechanics, _ = mechanics_of(chosen, model, refine)
        scatter = simulated.uncertainty if simulated.robust and slopes else None
        freedoms = simulated.freedoms if slopes else ()
        return optimization.evaluate(unit, chosen.targets, freedoms, mechanics, uncertainty=scatter)

    @stage(SEARCH)
    def found(self, units: Units, bare: optimization.Design, workers: int) -> optimization.Found:
        """What the search found, by its course once more."""
        found: optimization.Found = grown(optimization.unit_search(bare, workers), units)
        return found

    @stage(
        CHECK,
        lambda study: _seconds(study, CHECK),
        over=Over(("place",), lambda study: range(1, 1 + (MOST_CHECKED if study.objectives > 1 else 1))),
        parallel=True,
    )
    def checked(
        self,
        place: int,
        found: optimization.Found,
        units: Units,
        bare: optimization.Design,
        model: evidence.ExtendedModel | None,
    ) -> optimization.Verified:
        """A proposed unit on a finer mesh, with its uncertainty, and printable or not."""
        proposed = found.some(MOST_CHECKED)
        if place > len(proposed):
            raise Dropped
        values = found.observed[proposed[place - 1]].design
        chosen = bare.chosen(bare.choice(values))
        finer, _ = mechanics_of(chosen, model, bare.check_refine)
        prints = any(t.kind == "printable" for t in bare.targets)
        return optimization.verified(
            bare.unit_of(values),
            units[values, bare.settings.refine, True].values,
            chosen.targets,
            finer,
            bare.uncertainty,
            designs.load_printer(bare.printer) if prints else None,
        )

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the numbers of targets and freedoms."""
        return (
            f"Optimisation of {self.design.unit.name}",
            f"{len(self.design.targets)} targets, {len(self.design.freedoms)} freedoms",
        )

    @section()
    def answer(self, found: Results, units: Units, checked: Checked | None = None) -> Iterator[Part]:
        """The outcome, and the proposed units in a line each."""
        from ..optimization.words import changes, outcome, reasons, verdict

        design = self.design
        verified = checked or {}
        words = f"{outcome(found, design.targets)} {verdict([*verified.values()])}".strip()
        yield Sentence(words, terminal=True)
        yield recorded("outcome", words)
        yield recorded("feasible", found.feasible)
        yield recorded("in_the_way", list(found.in_the_way))
        yield recorded("front", len(found.proposed))
        names, rows = [t.name for t in design.targets], []
        solved = sum(one.model_a for (*_, slopes), one in units.items() if slopes)
        yield from echo(f"{len(found.observed)} units computed, {solved} Model A's")
        for place, c in verified.items():
            o = found.observed[found.some(MOST_CHECKED)[place - 1]]
            values = dict(zip(names, map(float, c.values), strict=True))
            shown = ", ".join(f"{n} {v:.4g}" for n, v in values.items() if not isnan(v))
            printable, robust = c.print_worst or "not asked", "robust" if c.is_robust else "not robust"
            line = f"proposed-{place}.toml: {robust}; print check: {printable}; {shown}"
            yield from echo(line)
            rows.append(
                {
                    "file": f"proposed-{place}.toml",
                    **design.choice(o.design),
                    "robust": c.is_robust,
                    "printable": printable,
                    "values": values,
                    "standard_error": dict(zip(names, map(float, c.error), strict=True)),
                    "changes": changes(design.freedoms, design.start, o.design),
                    "reasons": reasons(design.freedoms, design.targets, o, design.start),
                    "targets": _judged(design, c),
                }
            )
        yield recorded("proposed", rows)
        yield Fact("units computed", len(found.observed), str(len(found.observed)), key="designs")
        yield Fact("Model A's", solved, str(solved), key="model_a")
        yield Fact("proposed", len(verified), str(len(verified)))
        robust_ones = sum(c.is_robust for c in verified.values())
        yield Fact("robust", robust_ones, str(robust_ones))

    @section()
    def of_the_model(self, model: evidence.ExtendedModel | None) -> Iterator[Part]:
        """What of an extended model is left out."""
        for words in mechanics_of(self.design, model)[1] if model is not None else ():
            yield Warn(f"the model's {words}", MODEL, repeated=False)
            yield Sentence(f"Of the extended model: {words}.", note=True)

    @section()
    def table(
        self, units: Units, found: Results | None = None, checked: Checked | None = None
    ) -> Iterator[Part]:
        """designs.csv: a row for every unit, failed ones included."""
        design = self.design
        judged = [(i, t) for i, t in enumerate(design.targets) if t.quantity is not None]
        head = ["design", *(f.name for f in design.freedoms)]
        head += [f"{t.name} [{t.unit}]" if t.unit else t.name for _, t in judged]
        proposed = found.some(MOST_CHECKED)[: len(checked)] if found and checked else []
        chosen = [found.observed[n].design for n in proposed] if found else []
        rows: list[list[Any]] = []
        for (values, _, slopes), one in units.items():
            if slopes:
                cells = ["" if isnan(one.values[i]) else f"{one.values[i]:.7g}" for i, _ in judged]
                good = one.sound and all(t.met(one.values[i]) for i, t in judged)
                shown = [f"{v:.9g}" if isinstance(v, float) else v for v in values]
                marks = "yes" if good else "no", "yes" if values in chosen else "no"
                rows.append([len(rows) + 1, *shown, *cells, *marks, one.why])
        yield csv("designs.csv", [*head, "meets_all", "proposed", "what"], rows)

    @section("front", "Front")
    def front(self, found: Results, checked: Checked | None = None) -> Iterator[Part]:
        """Units by two targets, and the course of the search."""
        from ..report import design_charts as charts

        design = self.design
        if not any(o.sound for o in found.observed):
            return
        proposed = found.some(MOST_CHECKED)[: len(checked or ())]
        shown = charts.compared(design, found)
        columns: list[Part] = []
        if shown is not None:
            first, second = (design.judged[i].name for i in shown)
            yield File(FRONT, lambda path: charts.front_picture(design, found, proposed, *shown))
            columns.append(
                Chart(
                    lambda: charts.front(design, found, proposed, *shown),
                    "All units computed; squares are proposed. Dashed lines are the targets.",
                    f"{second} against {first} of all units computed.",
                )
            )
        words = "Largest misfit of any target, in its tolerances: below 1 all are met."
        alt = "Misfit by the number of units computed."
        yield Beside([*columns, Chart(lambda: charts.course(design, found), words, alt)])

    @section("units", "Proposed units")
    def proposals(self, found: Results, checked: Checked) -> Iterator[Part]:
        """Files, pictures and freedoms of the proposed units."""
        from ..optimization.words import shown
        from ..report import design_charts as charts

        design = self.design
        observed = _proposed(found, checked)
        body = design.body
        own = {p: attrs.evolve(design.unit_of(o.design), name=f"proposed-{p}") for p, o in observed.items()}
        for place, unit in own.items():
            yield File(f"proposed-{place}.toml", designs.to_toml(unit))
            yield File(f"proposed-{place}.png", lambda path, unit=unit: charts.picture(unit, body))  # type: ignore[misc]
        titles = {f"{place}: {_state(checked[place])}": unit for place, unit in own.items()}
        size = charts.sizes([design.unit, *own.values()], body)
        yield Beside(
            [
                Chart(partial(charts.thumbnail, unit, *size, body), title, f"Half section of unit {title}.")
                for title, unit in {"start": design.unit, **titles}.items()
            ],
            across=3,
        )
        head = ["freedom", ("start", "n"), *Table.numbers(*(str(place) for place in observed))]
        rows = [
            [f.name, shown(design.start[n]), *(shown(o.design[n]) for o in observed.values())]
            for n, f in enumerate(design.freedoms)
        ]
        yield Table("Each is saved as proposed-N.toml.", head, rows)

    @section("targets", "Targets and errors")
    def targets(self, found: Results, checked: Checked, units: Units) -> Iterator[Part]:
        """Every target of the proposed units, with its errors."""
        design = self.design
        yield Sentence(
            "Standard errors: the mesh's is the difference to a mesh of refinement "
            f"{design.check_refine:g}; a print's surfaces are off by {design.print_tolerance_mm:g} mm, the "
            f"resin's modulus by {design.modulus_tolerance:.0%}. Robust: met for all values within two "
            "standard errors of the three together."
        )
        head = [
            "target", "asked", *Table.numbers("found", "on a finer mesh", "± mesh", "± print", "± resin"),
            "verdict",
        ]  # fmt: skip
        for place, o in _proposed(found, checked).items():
            c, coarse = checked[place], units[o.design, design.settings.refine, True].values
            rows: list[list[Any]] = []
            for i, t in enumerate(design.targets):
                verdict = "robust" if c.robust[i] else "met" if c.met[i] else "missed"
                if t.quantity is None:
                    rows.append([t.name, t.words, c.print_worst, "", "", "", "", verdict])
                    continue
                values = [float(f"{v:.5g}") for v in (coarse[i], c.values[i])]
                errors = [f"{v:.3g}" for v in (c.by_mesh[i], c.by_print[i], c.by_resin[i])]
                name = f"{t.name} [{t.unit}]" if t.unit else t.name
                rows.append([name, t.words, *values, *errors, verdict if t.goal is None else "objective"])
            yield Table(f"Unit {place}" + (f": {c.why}" if c.why else ""), head, rows)
            for words in c.print_findings:
                yield Sentence(words)

    @section("why", "Changes and reasons")
    def why(self, found: Results, checked: Checked) -> Iterator[Part]:
        """What changed from the start, and what moved each target; slopes of the first unit."""
        from ..optimization.words import changes, reasons, sensitivities

        design = self.design
        rows = []
        for place, o in _proposed(found, checked).items():
            changed = changes(design.freedoms, design.start, o.design)
            moved = reasons(design.freedoms, design.targets, o, design.start)
            rows.append([place, "; ".join(changed) or "nothing", "; ".join(moved)])
        head = [
            ("unit", "n"),
            ("changes", "text"),
            ("influences on each target, by its slopes there", "text"),
        ]
        yield Table("", head, rows)
        continuous = [f for f in design.freedoms if not f.discrete]
        if continuous:
            slopes = sensitivities(design.freedoms, _proposed(found, checked)[min(checked)])
            yield Table(
                "Effect of a tenth of each freedom's range at the first unit, in each target's unit; by "
                "adjoint gradients.",
                ["target", *Table.numbers(*(f.name for f in continuous))],
                [
                    [t.name, *("-" if isnan(v) else f"{v:+.3g}" for v in row)]
                    for t, row in zip(design.judged, slopes, strict=True)
                ],
            )

    @section("inputs", "Inputs")
    def inputs_shown(self, model: evidence.ExtendedModel | None) -> Iterator[Part]:
        """Targets, freedoms and settings."""
        d = self.design
        yield Table("", ["target", "asked"], [[t.name, t.words] for t in d.targets])
        ranges = [
            [f.name, ", ".join(map(str, f.values)) if f.discrete else f"{f.low:g} to {f.high:g} {f.unit}"]
            for f in d.freedoms
        ]
        yield Table("", ["freedom", "range"], ranges)
        facts = {
            "body": "the lattice's box" if d.body is None else d.body.name,
            "refinement of the search's mesh": d.settings.refine,
            "refinement of the check's mesh": d.check_refine,
            "walls and struts kept apart": d.self_contact,
            "most units": d.search.evaluations,
            "seed": d.search.seed,
            "resin": d.resin,
            "printer": d.printer,
            "extended model": model is not None,
        }
        yield Table("", ["setting", ""], list(facts.items()))


def _proposed(
    found: optimization.Found, checked: Mapping[int, optimization.Verified]
) -> dict[int, optimization.Observed]:
    """Results of the search by place of the proposed units that were checked."""
    numbers = found.some(MOST_CHECKED)
    return {place: found.observed[numbers[place - 1]] for place in checked}


def _state(checked: optimization.Verified) -> str:
    if checked.why:
        return "fails on a finer mesh"
    words = "robust" if checked.is_robust else "not robust"
    return f"{words}, print check: {checked.print_worst}" if checked.print_worst else words


def _judged(design: optimization.Design, checked: optimization.Verified) -> list[dict[str, Any]]:
    """Every target with a proposed unit's value on the finer mesh, and True if it is met."""
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
        for i, t in enumerate(design.targets)
    ]


def mechanics_of(
    design: optimization.Design, model: evidence.ExtendedModel | None, refine: float | None = None
) -> tuple[optimization.Mechanics, Sequence[str]]:
    """Mechanics of the design's units, and the effects of the model left out, as text.

    refine: of the mesh, by default the search's. Raises InputError where the unit cannot have the model.
    """
    from ..fem.unit_materials import materials_of
    from ..simulate_and_place.extended_unit import extend
    from ..simulate_and_place.named_effects import NamedEffects

    settings = design.settings if refine is None else attrs.evolve(design.settings, refine=refine)
    first = None if model is None else extend(design.unit, model)
    effects = NamedEffects() if first is None else first.effects
    left_out = [] if first is None else [*filter(None, [first.doubt]), *first.left_out]
    if design.orientation_deg is not None:
        values = {name: dict(given) for name, given in effects.values.items()}
        values.setdefault("gravity", {"density_kg_m3": 1000.0 * design.material.density_g_per_ml})
        effects = NamedEffects(values, design.orientation_deg, effects.where)
    if model is None and not effects:
        return optimization.Mechanics(settings, body=design.body, self_contact=design.self_contact), []
    if effects.in_time:
        left_out.append(
            "effects in time (viscoelasticity, lag, leak, softening): targets apply to the unit at rest "
            "under its pressure"
        )
    return optimization.Mechanics(
        settings,
        as_printed=lambda unit: unit if model is None else extend(unit, model).unit,
        materials=lambda unit, mesh: effects.materials(materials_of(unit, mesh), mesh),
        model=lambda unit, mesh: effects.model(unit, mesh, threads=1),
        load=effects.load,
        body=design.body,
        self_contact=design.self_contact,
    ), left_out
