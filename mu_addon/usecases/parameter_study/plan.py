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

from ...design.parameters import Unit, load_preset, read_unit
from ...errors import InputError, MuError
from ...materials.library import load_material, read_material
from ...meshing.settings import SELF_CONTACT
from ...reading import parse_toml
from ...run.folder import RUN
from ...run.inputs import FORMAT, read_inputs, read_toml, structured
from ...studies.unit_inputs import protocol_of
from ...studies.unit_ranking import UnitStudy
from ..simulate_and_place.settings import STAGES
from .point import Task
from .settings import GRID, LAST_STAGE, MEMORY, METHOD, MINUTES, MOST_POINTS, POINTS, RESIN, SEED, SOBOL
from .variable import FILE, Inputs, Variable, changed_inputs, variable

Array = np.ndarray[Any, Any]
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
    count: int = POINTS.field()
    seed: int = SEED.field()
    memory_MB: int = MEMORY.field()
    minutes: float = MINUTES.field()
    resin: str = RESIN.field()
    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    counts: tuple[int, ...] = attrs.field(default=attrs.Factory(lambda self: (self.count,), takes_self=True))

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
            given = {"unit": changed.unit, "protocol": changed.protocol, "workers": 1}
            job = UnitStudy.of_tables(changed.tables, Path("[vary]"), **given)
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
            same = document.get("method") == self.method and document.get("seed") == self.seed
            if same and list(document.get("vary", {})) == [v.name for v in self.variables]:
                counts = counts_of(run.get("points"), str(file))
        count = (counts[-1] if counts and add else max([self.count, *counts])) + add
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


@attrs.frozen
class _File:
    """The plain keys of sweep.toml."""

    preset: str = ""
    unit: str = ""
    protocol: str = ""
    resin: str = RESIN.field()
    stages: str = LAST_STAGE.field()
    method: str = METHOD.field()
    points: int = POINTS.field()
    seed: int = SEED.field()
    memory_MB: int = MEMORY.field()
    minutes: float = MINUTES.field()
    minimize: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()


def read_plan(path: Path) -> Plan:
    """The sweep of a TOML file; raises InputError."""
    document = read_toml(path, "parameter study", "give the path of a TOML file")
    return _plan_of(document, path.parent, str(path))


def parse_plan(text: str, folder: Path, where: str = "sweep.toml") -> Plan:
    """The sweep of TOML text; folder: where the files lie that it names. Raises InputError."""
    return _plan_of(parse_toml(text, where), folder, where)


def _plan_of(document: dict[str, Any], folder: Path, where: str) -> Plan:
    """The sweep of a document that a user wrote."""
    found = document.pop("format", "missing")
    if found != FORMAT or isinstance(found, bool):
        raise InputError(f"format = {found}", where, f"write format = {FORMAT}")
    document.pop(RUN, None)
    last = document.get("stages", LAST_STAGE.default)
    simulate = document.get("simulate", {})
    # What is no table is refused later, by name.
    if isinstance(simulate, dict) and last != STAGES[0]:
        document["simulate"] = {"self_contact": SELF_CONTACT.default} | simulate
    given = [document.get(name) for name in ("preset", "unit") if document.get(name)]
    if len(given) != 1:
        raise InputError("no unit is given", where, 'write preset = "mu-1.0x" or unit = "my-unit.toml"')

    def unit(file: _File) -> Unit:
        return load_preset(file.preset) if file.preset else read_unit(folder / file.unit)

    return planned(document, unit, folder, where)


def planned(
    document: Mapping[str, Any], unit: Any, files: Path, where: str, counts: tuple[int, ...] = ()
) -> Plan:
    """The plan of sweep.toml's keys; unit: its unit, or what gives it of the plain keys. Raises InputError.

    files: folder of the files that it names; counts: numbers of points by which an earlier run grew.
    """
    keys = dict(document)
    vary, tables = keys.pop("vary", None), {name: keys.pop(name) for name in STAGES if name in keys}
    if not isinstance(vary, dict) or not vary:
        raise InputError(
            "no input is varied",
            where,
            'add [vary] and lines like "chambers.wall_mm" = { low = .., high = .. }',
        )
    file = structured(_File, keys, where)
    stages = STAGES[: STAGES.index(file.stages) + 1]
    for name in tables:
        if name not in stages:
            raise InputError(
                f"[{name}] is not one of its stages", where, f'write stages = "{name}", or leave it out'
            )
    settings = {name: _settings(tables.get(name, {}), name, where) for name in stages}
    variables = tuple(variable(name, given, where) for name, given in _flat(vary).items())
    protocol = protocol_of(files / file.protocol if file.protocol else None)
    inputs = Inputs(unit(file), protocol, settings)
    plain = ("method", "seed", "memory_MB", "minutes", "resin", "minimize", "maximize")
    own = {name: getattr(file, name) for name in plain}
    plan = Plan(inputs, variables, files, count=file.points, counts=counts or (file.points,), **own)
    # A setting that is wrong for every point is reported before any work, and not as many failures.
    UnitStudy.of_tables(settings, Path(where), unit=inputs.unit, protocol=inputs.protocol, workers=1)
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


def _flat(vary: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Variables by their whole name: TOML reads chambers.wall_mm without quotes as a table in a table."""
    found: dict[str, Any] = {}
    for key, value in vary.items():
        name = f"{before}{key}"
        last = not isinstance(value, dict) or not value or any(k in value for k in ("low", "high", "values"))
        found |= {name: value} if last else _flat(value, f"{name}.")
    return found


def _settings(found: Any, stage: str, where: str) -> dict[str, Any]:
    if not isinstance(found, dict):
        raise InputError(f"{stage} is not a table", where, f"write it as [{stage}]")
    for key in found:
        if key in OF_FILES:
            raise InputError(
                f"a parameter study does not take {key}",
                f"{where}, [{stage}]",
                "leave it out; unit and protocol are named at the top of the file",
            )
    return dict(found)
