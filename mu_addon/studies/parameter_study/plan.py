"""The inputs of a parameter study: sweep.toml, and its points in the unit cube."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ...design.parameters import Unit, load_preset, read_unit
from ...errors import InputError, MuError
from ...materials.library import load_material, read_material
from ...meshing.settings import SELF_CONTACT
from ...run.folder import RUN
from ...run.inputs import FORMAT, read_inputs
from ...simulate_and_place.settings import STAGES
from ...toml_reader import TomlTable, parsed_toml, read_toml
from ..unit_inputs import protocol_of
from ..unit_ranking import UnitStudy
from .point import Task
from .settings import GRID, LAST_STAGE, MEMORY, METHOD, MINUTES, MOST_POINTS, POINTS, RESIN, SEED, SOBOL
from .variable import FILE, Inputs, Variable, changed_inputs, variable

OF_FILES = ("unit", "body", "protocol", "obstacles", "friction")
"""Keys of study.toml that belong to files beside it."""


def sample(method: str, count: int, dimensions: int, seed: int, before: Array | None = None) -> Array:
    """Points (count, d) in [0, 1)^d, the first of them `before` (n, d), made by the same method and seed.

    sobol: a scrambled Sobol sequence; more points extend it. latin_hypercube: n points lie in n strata of
    every axis. Added points fill empty strata, so that twice (three times ...) as many points are again a
    Latin hypercube (Sallaberry, Helton, Hora 2008).
    """
    from scipy.stats import qmc

    known = np.empty((0, dimensions)) if before is None else before
    if len(known) >= count:
        return known
    if method == SOBOL:
        # A power of two is what the sequence is balanced for; less of it is a beginning.
        whole = qmc.Sobol(dimensions, rng=seed).random_base2(math.ceil(math.log2(max(count, 2))))
        return np.concatenate([known, whole[len(known) : count]])
    if not len(known):
        return np.asarray(qmc.LatinHypercube(dimensions, rng=seed).random(count))
    return np.concatenate(
        [known, _into_empty_strata(known, count, np.random.default_rng([seed, len(known)]))]
    )


def _into_empty_strata(known: Array, count: int, rng: np.random.Generator) -> Array:
    """Points (count - n, d) in strata of width 1 / count of each axis that hold no point yet."""
    added = np.empty((count - len(known), known.shape[1]))
    for axis, values in enumerate(known.T):
        # At least so many are empty; more where two points share one.
        empty = np.setdiff1d(np.arange(count), np.floor(values * count).astype(int))
        strata = rng.permutation(rng.choice(empty, len(added), replace=False))
        added[:, axis] = (strata + rng.random(len(added))) / count
    return added


@attrs.frozen
class Point:
    """One study of a sweep: its number from 1, its varied values, and its job, or why there is none."""

    number: int
    values: Mapping[str, Any]
    job: UnitStudy | None
    error: MuError | None = None


@attrs.frozen(eq=False)
class Plan:
    """A sweep: the study that is varied, its variables, and how its points are chosen.

    folder: of sweep.toml and the files that it names. memory_MB, minutes: limits of one study. minimize,
    maximize: columns of the table, the objectives of Pareto fronts. counts: numbers of points by which it
    grew, each the whole; what was added to a sample depends on them.
    """

    inputs: Inputs
    variables: tuple[Variable, ...]
    folder: Path
    method: str = METHOD.field()
    points: int = POINTS.field()
    seed: int = SEED.field()
    memory_MB: int = MEMORY.field()
    minutes: float = MINUTES.field()
    resin: str = RESIN.field()
    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    counts: tuple[int, ...] = attrs.field(default=attrs.Factory(lambda self: (self.points,), takes_self=True))

    _errors: dict[int, MuError | None] = attrs.field(factory=dict, init=False, repr=False)

    def __attrs_post_init__(self) -> None:
        if self.size > MOST_POINTS:
            raise InputError(
                f"the grid has {self.size} points", "steps", f"give fewer steps: {MOST_POINTS} at most"
            )

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages run for every study."""
        return tuple(self.inputs.tables)

    @property
    def size(self) -> int:
        """Number of points: a grid's is its levels'."""
        if self.method != GRID:
            return self.counts[-1]
        return int(np.prod([len(v.levels) for v in self.variables]))

    @property
    def density(self) -> float:
        """Density of the resin in g/ml; raises InputError."""
        path = self.folder / self.resin
        material = read_material(path) if path.suffix == ".toml" else load_material(self.resin)
        return material.density_g_per_ml

    @cached_property
    def places(self) -> Array:
        """Positions (n, d) of the points in the unit cube."""
        found = None
        for count in self.counts:
            found = sample(self.method, count, len(self.variables), self.seed, found)
        assert found is not None
        return found

    @cached_property
    def values(self) -> list[dict[str, Any]]:
        """Varied values of each point."""
        if self.method == GRID:
            grid = itertools.product(*(v.levels for v in self.variables))
            return [dict(zip([v.name for v in self.variables], row, strict=True)) for row in grid]
        rows = self.places.tolist()
        return [{v.name: v.at(u) for v, u in zip(self.variables, row, strict=True)} for row in rows]

    def point(self, number: int) -> Point:
        """The point of a number from 1; one that breaks a rule has an error."""
        values = self.values[number - 1]
        try:
            changed = changed_inputs(self.inputs, values, self.folder)
            tables = {name: TomlTable(table, "[vary]", name=name) for name, table in changed.tables.items()}
            job = UnitStudy.of_tables(
                tables, Path("[vary]"), unit=changed.unit, protocol=changed.protocol, workers=1
            )
            return Point(number, values, job)
        except MuError as error:
            return Point(number, values, None, error)

    def error(self, number: int) -> MuError | None:
        """Why there is no study of a point, None of one that breaks no rule; found once."""
        if number not in self._errors:
            self._errors[number] = self.point(number).error
        return self._errors[number]

    def task(self, number: int) -> Task | None:
        """The study of a point, None of one that breaks a rule."""
        job = self.point(number).job
        return None if job is None else Task(job.texts(), self.memory_MB, self.minutes)

    def continued(self, file: Path, add: int = 0) -> Plan:
        """The plan with the points of an earlier run of it, by that one's sweep.toml, and `add` more.

        Raises InputError for a grid that is added to.
        """
        if add and self.method == GRID:
            raise InputError("points cannot be added to a grid", "--add", "give more steps in sweep.toml")
        counts: tuple[int, ...] = ()
        with suppress(InputError):
            document, run = read_inputs(file)
            same = all(document.values.get(name) == getattr(self, name) for name in ("method", "seed"))
            if same and list(document.inner("vary").values) == [v.name for v in self.variables]:
                counts = counts_of(run.get("points"), str(file))
        count = (counts[-1] if counts and add else max([self.points, *counts])) + add
        return attrs.evolve(self, counts=counts if counts[-1:] == (count,) else (*counts, count))

    @property
    def tables(self) -> dict[str, Any]:
        """What decides it, in sweep.toml, without unit and protocol."""
        return {
            **{d.name: getattr(self, d.name) for d in (METHOD, SEED, MEMORY, MINUTES, RESIN)},
            "minimize": self.minimize,
            "maximize": self.maximize,
            **self.inputs.tables,
            "vary": {v.name: v.table for v in self.variables},
        }


def read_plan(path: Path) -> Plan:
    """The sweep of a TOML file; raises InputError."""
    return _plan_of(read_toml(path, "parameter study", "give the path of a TOML file"), path.parent)


def parse_plan(text: str, folder: Path, where: str = "sweep.toml") -> Plan:
    """The sweep of TOML text; folder: where the files lie that it names. Raises InputError."""
    return _plan_of(parsed_toml(text, where), folder)


def _plan_of(document: TomlTable, folder: Path) -> Plan:
    """The sweep of a document that a user wrote."""
    keys = {k: v for k, v in document.of_format(FORMAT).values.items() if k not in ("format", RUN)}
    if document.word("stages", default=LAST_STAGE.default) != STAGES[0]:
        keys["simulate"] = {"self_contact": SELF_CONTACT.default} | dict(document.inner("simulate").values)
    given = [name for name in ("preset", "unit") if keys.get(name)]
    if len(given) != 1:
        remedy = 'write preset = "mu-1.0x" or unit = "my-unit.toml"'
        raise InputError("no unit is given", document.at(), remedy)
    named = document.word(given[0])
    unit = load_preset(named) if given[0] == "preset" else read_unit(folder / named)
    return planned(attrs.evolve(document, values=keys), unit, folder)


_OWN = ("method", "points", "seed", "memory_MB", "minutes", "resin", "minimize", "maximize")
"""Keys of sweep.toml that the plan has as they are."""


def planned(document: TomlTable, unit: Unit, files: Path, counts: tuple[int, ...] = ()) -> Plan:
    """The plan of sweep.toml's keys for a unit. Raises InputError.

    files: folder of the files that it names; counts: numbers of points by which an earlier run grew.
    """
    vary = document.inner("vary")
    if not vary.values:
        remedy = 'add [vary] and lines like "chambers.wall_mm" = { low = .., high = .. }'
        raise InputError("no input is varied", document.at(), remedy)
    document.only((*_OWN, "preset", "unit", "protocol", "stages", "vary", *STAGES))
    stages = STAGES[: STAGES.index(document.word("stages", STAGES, LAST_STAGE.default)) + 1]
    for name in STAGES:
        if name in document and name not in stages:
            remedy = f'write stages = "{name}", or leave it out'
            raise InputError(f"[{name}] is not one of its stages", document.at(name), remedy)
    settings = {name: _settings(document.inner(name)) for name in stages}
    variables = tuple(variable(name, table) for name, table in _flat(vary).items())
    protocol = document.take("protocol", str, "")
    inputs = Inputs(unit, protocol_of(files / protocol if protocol else None), settings)
    own = attrs.evolve(document, values={k: v for k, v in document.values.items() if k in _OWN})
    counts = counts or (document.take("points", int, POINTS.default),)
    plan = own.made(Plan, inputs=inputs, variables=variables, folder=files, counts=counts)
    # A setting that is wrong for every point is reported before any work, and not as many failures.
    tables = {name: attrs.evolve(document.inner(name), values=table) for name, table in settings.items()}
    UnitStudy.of_tables(tables, Path(document.origin), unit=inputs.unit, protocol=inputs.protocol, workers=1)
    for v in variables:
        if v.name == FILE:
            for name in v.values:
                protocol_of(plan.folder / str(name))
    return plan


def counts_of(found: Any, where: str) -> tuple[int, ...]:
    """Numbers of points by which a sweep grew, of its [run] points; raises InputError."""
    listed = found if isinstance(found, list) else [found]
    if not all(type(n) is int and 2 <= n <= MOST_POINTS for n in listed) or sorted(listed) != listed:
        raise InputError(f"points = {found!r} are no numbers of points", where, "leave [run] points out")
    return tuple(listed)


def _flat(vary: TomlTable, before: str = "") -> dict[str, TomlTable]:
    """Variables by their whole name: TOML reads chambers.wall_mm without quotes as a table in a table."""
    found: dict[str, TomlTable] = {}
    for key in vary.values:
        table = vary.inner(key)
        last = not table.values or any(k in table for k in ("low", "high", "values"))
        found |= {f"{before}{key}": table} if last else _flat(table, f"{before}{key}.")
    return found


def _settings(table: TomlTable) -> dict[str, Any]:
    for key in table.values:
        if key in OF_FILES:
            raise InputError(
                f"a parameter study does not take {key}",
                table.at(key),
                "leave it out; unit and protocol are named at the top of the file",
            )
    return dict(table.values)
