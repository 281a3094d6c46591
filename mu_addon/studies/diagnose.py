"""Diagnose model error from measured data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from .. import design, evidence, measured
from ..design.settings import PRESET
from ..errors import InputError
from ..meshing.settings import SELF_CONTACT
from ..run.parts import Fact, File, Part, Warn, csv, recorded
from ..run.study import (
    Found,
    Input,
    Node,
    Study,
    Tell,
    Written,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from .inputs import FileInput, MeasuredInput, ModelInput, UnitInput, asked

if TYPE_CHECKING:
    from ..diagnose.judged_data import JudgedData, Judging
    from ..diagnose.unknown import Shaped, Unknown

# Stages as `evidence.simulations_plan` names them.
LATTICE, FREE, HELD, DESIGNS = "lattice", "unit", "unit with its tip held", "unit of every design"
LOOK, EFFECTS, SIZES = "first look", "unit with each effect", "unit at every size in question"
SHARES = {FREE: 0.29, EFFECTS: 0.49, SIZES: 0.22}
"""Of the seconds of a unit's simulation; the last stage ends at once where no effect is in question."""
SET, SET_S = 3, 18.0
"""Records among the data for which a verdict takes so many seconds."""
RECORD = 10
"""Rows from which an experiment is a record, not a few readings, which take next to nothing."""
FILES = {
    "verdict.json": "the verdict and its figures",
    "model.toml": "the extended model: `simulate`, `place` and `homogenize` take it with --model",
    "residuals.csv": "every measured value with the predictions of both models",
    "shapes.csv": "unknown dimensions that fit, with --unknown",
}
Simulated = tuple[dict[str, Any], list[str]]
Experiments = tuple["measured.Experiment", ...]


@attrs.frozen
class UnknownInput(FileInput):
    """Parameters of the unit's design that nobody measured, by a file of [[freedom]] tables."""

    kind: str = "unknown"
    text: Callable[[Any], str] = lambda unknown: unknown.text
    needed: bool = False

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Unknown | None:
        """The parameters of a file; raises InputError."""
        from ..diagnose.unknown import unknown_of

        return unknown_of(Path(values[0]), given["unit"] or design.load_preset(PRESET)) if values[0] else None

    def read(self, name: str, found: Found) -> Unknown | None:
        """The parameters of the folder's file, if it has one; raises InputError."""
        named = found.keys.pop(name, "")
        return self.made((found.path.parent / f"{name}.toml" if named else "",), found.given)


@attrs.frozen
class PythonInput(Input):
    """What is given in Python alone."""

    kind: str = "python"

    def write(self, name: str, value: Any) -> Written:
        """Its text, if there is one."""
        return Written() if value is None else Written({name: repr(value)})

    def read(self, name: str, found: Found) -> None:
        """Nothing; raises InputError where there was something."""
        if found.keys.pop(name, None):
            remedy = "run it there again"
            raise InputError("this run was made with settings given in Python", str(found.path), remedy)


def _bends(study: Diagnose) -> bool:
    return bool(evidence.bends(study.data.experiments))


def _names(study: Diagnose) -> bool:
    # While dimensions are unknown, none is.
    return _bends(study) and study.unknown is None


def _looks(study: Diagnose) -> bool:
    return any(e.role == "fit" for e in evidence.bending_freely(study.data.experiments))


def _has(title: str) -> Callable[[Diagnose], bool]:
    return lambda study: title in study.simulations


def _simulating(title: str) -> Callable[[Diagnose], float]:
    of = FREE if title in SHARES else title

    def seconds(study: Diagnose) -> float:
        at_once = title == EFFECTS and study.unknown is not None
        return 0.1 if at_once else SHARES.get(title, 1.0) * study.simulations.get(of, 0.1)

    return seconds


def _judging(study: Diagnose) -> float:
    records = sum(len(e.rows) >= RECORD for e in study.data.experiments)
    return 0.8 + SET_S * records / SET


def _shown(of: str, title: str) -> Any:
    """A section of the parts that the function `of` of `diagnose.parts` gives."""

    def show(self: Any, found: JudgedData) -> Iterator[Part]:
        from ..diagnose import parts

        yield from getattr(parts, of)(found)

    show.__name__ = of
    return section(of, title)(show)


@attrs.frozen(kw_only=True, eq=False)
class Diagnose(Study):
    """Diagnose model error from measured data: name the physical effects missing from the model, and compute
    by how much the error drops with them.
    """

    name = "diagnose"
    example = "diagnose assets/examples/paper-moduli --out out/diagnosis"
    files = FILES
    node = Node(
        "Data",
        "the effects that the model lacks, by measured data",
        (
            ("diagnosis", "diagnosis", "the verdict"),
            ("model", "model", "the extended model, for a node Simulate"),
        ),
        "{verdict}: {headline}".format_map,
        read=lambda done, call: {"diagnosis": done, "model": done.folder / "model.toml"},
        hidden=("known", "unknown"),
    )

    data: measured.Measured = given(MeasuredInput())
    unit: design.Unit | None = given(UnitInput(needed=False), default=None)
    self_contact: bool = setting(SELF_CONTACT)
    known: evidence.ExtendedModel | None = asked(
        ModelInput,
        "model",
        "extended model of an earlier diagnosis, its model.toml: its effects stay in the model, new causes "
        "are added; empty: none",
        file="known.toml",
    )
    unknown: Any = asked(
        UnknownInput,
        "unknown",
        "TOML file with [[freedom]] tables, as of `optimize`: parameters of the unit's design that nobody "
        "measured, with bounds; they are fitted, no cause is named, and shapes.csv says which fit; empty: "
        "none",
        metavar="FILE",
    )
    settings: evidence.UnitSettings | None = given(PythonInput(), default=None)

    def __attrs_post_init__(self) -> None:
        where = str(self.data.folder / "experiments.toml")
        if self.unknown and not _bends(self):
            words = "no experiment bends a unit, whose parameters could be unknown"
            raise InputError(words, where, "leave --unknown out")
        if not any(e.role == "fit" for e in self.data.experiments):
            raise InputError("every experiment is held out", where, 'give role = "fit" to some')

    def complete(self) -> Diagnose:
        """With the unit that the experiments are made with: none where they need none."""
        return attrs.evolve(self, unit=evidence.unit_behind(self.data.experiments, self.unit))

    @property
    def simulations(self) -> dict[str, float]:
        """Seconds of the simulations that the experiments need, by title."""
        plan = evidence.simulations_plan(self.data.experiments, self.unit, self.simulating(
            self.self_contact, self.settings, self.unknown, self.unit))  # fmt: skip
        return dict(plan)

    @derived
    def simulating(
        self,
        self_contact: bool,
        settings: evidence.UnitSettings | None,
        unknown: Unknown | None,
        unit: design.Unit | None,
    ) -> evidence.UnitSettings:
        """Settings of the unit's simulation.

        While dimensions are unknown, no cause is named: what effects change in the unit is not simulated,
        which would be of another shape than the one that fits.
        """
        found = settings or evidence.UnitSettings(self_contact=self_contact)
        if unknown is None or unit is None or found.designs:
            return found
        return attrs.evolve(found, designs=unknown.designs(unit), effects=())

    @derived
    def experiments(self, data: measured.Measured) -> Experiments:
        """The experiments."""
        return data.experiments

    @derived
    def remarked(self, data: measured.Measured) -> tuple[measured.Remark, ...]:
        """Remarks of the reader of the data."""
        return data.remarks

    @derived
    def before(self, known: evidence.ExtendedModel | None) -> dict[str, float]:
        """Values of effects in the model from the start."""
        return known.of_effects if known else {}

    @stage(LATTICE, _simulating(LATTICE), wanted=_has(LATTICE), kept=False)
    def lattice(self, experiments: Experiments, unit: design.Unit, tell: Tell) -> Simulated:
        """Response of compressed blocks to printing, and how they are modelled."""
        return evidence.scalings(experiments, unit, tell.cache, lambda _, share: tell(share))

    @stage(FREE, _simulating(FREE), wanted=_looks, kept=False)
    def base(
        self, experiments: Experiments, unit: design.Unit, simulating: evidence.UnitSettings, tell: Tell
    ) -> Simulated:
        """Simulators of a unit without effects, of its first look."""
        settings = attrs.evolve(simulating, effects=(), designs=None)
        return evidence.of_a_unit(evidence.bending_freely(experiments), unit, tell.cache, tell, settings)

    @stage(LOOK, _judging, wanted=_looks, kept=False)
    def look(
        self, experiments: Experiments, base: Simulated, before: Mapping[str, float], tell: Tell
    ) -> dict[str, str]:
        """Early verdict on a unit by its base simulation alone, shown while others run.

        It includes instruments and effects in time, but no weight, walls or print: those need further
        simulations, which take most of a verdict's time.
        """
        from ..diagnose.judged_data import first_look

        return first_look(evidence.bending_freely(experiments), base[0], before, tell)

    @stage(DESIGNS, _simulating(DESIGNS), wanted=lambda study: study.unknown is not None, kept=False)
    def shaped(
        self, experiments: Experiments, unit: design.Unit, simulating: evidence.UnitSettings,
        unknown: Unknown, tell: Tell,
    ) -> Shaped:  # fmt: skip
        """What the data say about unknown parameters without effects, and settings with every design."""
        from ..diagnose.unknown import shaped

        return shaped(unknown, simulating, unit, evidence.bending_freely(experiments), tell)

    @stage(EFFECTS, _simulating(EFFECTS), wanted=_has(FREE), kept=False)
    def effects(
        self, experiments: Experiments, unit: design.Unit, simulating: evidence.UnitSettings, tell: Tell,
        shaped: Shaped | None = None,
    ) -> Simulated:  # fmt: skip
        """Simulators of a unit that bends freely, and what they leave out."""
        settings = shaped.settings if shaped else simulating
        return evidence.of_a_unit(experiments, unit, tell.cache, tell, settings)

    @stage(HELD, _simulating(HELD), wanted=_has(HELD), kept=False)
    def held(
        self, experiments: Experiments, unit: design.Unit, simulating: evidence.UnitSettings, tell: Tell,
        shaped: Shaped | None = None,
    ) -> Simulated:  # fmt: skip
        """Simulators of a unit whose tip is held, and what they leave out."""
        settings = shaped.settings if shaped else simulating
        return evidence.of_a_unit(experiments, unit, tell.cache, tell, settings, held=True)

    @stage("verdict", _judging, kept=False)
    def first(
        self, experiments: Experiments, before: Mapping[str, float], tell: Tell,
        lattice: Simulated | None = None, effects: Simulated | None = None, held: Simulated | None = None,
    ) -> Judging:  # fmt: skip
        """The verdict, of a unit by a first look at each effect."""
        from ..diagnose.judged_data import judged_by

        return judged_by(experiments, before, lattice, (effects, held), tell)

    @stage(SIZES, lambda study: _simulating(SIZES)(study) + _judging(study), wanted=_names, kept=False)
    def whole(
        self, experiments: Experiments, unit: design.Unit, simulating: evidence.UnitSettings,
        before: Mapping[str, float], first: Judging, tell: Tell,
        lattice: Simulated | None = None,
    ) -> Judging:  # fmt: skip
        """The verdict with every effect in question at all its sizes."""
        from ..diagnose.judged_data import with_all_sizes

        return with_all_sizes(first, experiments, unit, simulating, before, lattice, tell)

    @intermediate()
    def found(
        self, experiments: Experiments, remarked: tuple[measured.Remark, ...],
        unit: design.Unit | None, known: evidence.ExtendedModel | None, first: Judging,
        whole: Judging | None = None, shaped: Shaped | None = None,
    ) -> JudgedData:  # fmt: skip
        """The verdict with its model and the remarks on it."""
        from ..diagnose.judged_data import judged_data

        return judged_data(experiments, remarked, unit, known, whole or first, shaped)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the experiments, and how the unit was modelled."""
        from ..diagnose.words import subtitle

        return f"Diagnosis of {self.data.folder.resolve().name}", subtitle(
            self.data.experiments, self.self_contact
        )

    @section()
    def remarks(self, remarked: tuple[measured.Remark, ...]) -> Iterator[Part]:
        """Remarks of the reader of the data."""
        for remark in remarked:
            yield Warn(remark.what, remark.where, remark.remedy, repeated=False)

    @section()
    def early(self, look: dict[str, str]) -> Iterator[Part]:
        """The first look."""
        yield recorded("first_look", look)

    @section()
    def answer(self, found: JudgedData) -> Iterator[Part]:
        """The verdict, and its files."""
        from ..diagnose import parts
        from ..diagnose.judged_data import residual_rows, summary

        yield from parts.answer(found)
        yield from (recorded(key, value) for key, value in summary(found).items())
        yield File("verdict.json", lambda path: found.verdict_text())
        yield File("model.toml", lambda path: found.model.text())
        head = ["experiment", "role", "channel", "row", "measured", "base_model", "extended_model"]
        yield csv("residuals.csv", head, residual_rows(found))

    @section()
    def shapes(self, shaped: Shaped) -> Iterator[Part]:
        """The unknown dimensions that fit."""
        yield csv("shapes.csv", *shaped.fits.table())
        yield Fact("unknown", shaped.fits.as_json(), key="unknown")

    panels = _shown("measured", "Measured and predicted")
    causes = _shown("causes", "The cause")
    rivals = _shown("rivals", "Rival explanations")
    gain = _shown("gain", "Error reduction")
    left = _shown("dependence", "Dependence of the residual")
    seen = _shown("identifiability", "Identifiability of each effect")
    noise = _shown("noise", "Noise")
    listed = _shown("data", "Data")
