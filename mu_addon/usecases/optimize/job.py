"""The inputs of an optimisation: design.toml, unit.toml in its folder, and an extended model."""

from __future__ import annotations

from pathlib import Path

import attrs

from ...design.body import Body
from ...design.parameters import Unit
from ...errors import InputError
from ...evidence.extended import ExtendedModel, load_model
from ...fem.unit_materials import materials_of
from ...optimization.design_file import Design, read_design
from ...optimization.settings import WORKERS
from ...optimization.unit_body import Mechanics
from ...reading import file_text
from ..simulate_and_place.extended_unit import extend
from ..simulate_and_place.named_effects import NamedEffects
from .files import DESIGN, MODEL

# No file of inputs is longer, in bytes.
_LONGEST = 1_000_000


@attrs.frozen(eq=False)
class Job:
    """An optimisation: the design, and how it is run. model: the extended model optimised, or None.

    workers: units at a time on this machine; scheduler: address of a Dask scheduler whose workers evaluate
    them instead.
    """

    design: Design
    model: ExtendedModel | None = None
    workers: int = WORKERS.field()
    scheduler: str | None = None

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; design.toml is the first."""
        found = self.design.texts()
        return found if self.model is None else {**found, MODEL: self.model.text()}


def job_from(
    file: Path,
    model: Path | None = None,
    workers: int = WORKERS.default,
    scheduler: str | None = None,
    unit: Unit | None = None,
    body: Body | None = None,
) -> Job:
    """The job of a design file and a model; unit, body: in place of the file's. Raises InputError."""
    try:
        text = file_text(file, _LONGEST)
    except OSError as error:
        raise InputError(
            f"cannot read the design: {error.strerror or error}", str(file), "give the path of a design.toml"
        ) from error
    except UnicodeDecodeError as error:
        raise InputError("the file is not UTF-8 text", str(file), "save it as UTF-8") from error
    return Job(
        read_design(file, text, unit, body), None if model is None else load_model(model), workers, scheduler
    )


def read_job(folder: Path) -> Job:
    """The optimisation that a folder describes; raises InputError."""
    model = folder / MODEL
    return job_from(folder / DESIGN, model if model.is_file() else None)


def mechanics_of(
    design: Design, model: ExtendedModel | None, refine: float | None = None
) -> tuple[Mechanics, list[str]]:
    """Mechanics of the design's units, and the effects of the model left out, as text.

    refine: of the mesh, by default the search's. Raises InputError where the unit cannot have the model.
    """
    settings = design.settings if refine is None else attrs.evolve(design.settings, refine=refine)
    if model is None:
        effects, left_out = _with_weight(NamedEffects(), design), []
        if not effects:
            return Mechanics(settings, body=design.body, self_contact=design.self_contact), []
    else:
        first = extend(design.unit, model)
        effects, left_out = _with_weight(first.effects, design), [*first.left_out]
        if first.doubt:
            left_out.insert(0, first.doubt)
    if effects.in_time:
        left_out.append(
            "effects in time (viscoelasticity, lag, leak, softening): targets apply to the unit at rest "
            "under its pressure"
        )

    def printed(unit: Unit) -> Unit:
        return unit if model is None else extend(unit, model).unit

    return Mechanics(
        settings,
        as_printed=printed,
        materials=lambda unit, mesh: effects.materials(materials_of(unit, mesh), mesh),
        model=lambda unit, mesh: effects.model(unit, mesh, threads=1),
        load=effects.load,
        body=design.body,
        self_contact=design.self_contact,
    ), left_out


def _with_weight(effects: NamedEffects, design: Design) -> NamedEffects:
    """The effects with the unit's weight in the design's orientation, by default of the resin's density."""
    if design.orientation_deg is None:
        return effects
    values = {name: dict(given) for name, given in effects.values.items()}
    values.setdefault("gravity", {"density_kg_m3": 1000.0 * design.material.density_g_per_ml})
    return NamedEffects(values, design.orientation_deg, effects.where)
