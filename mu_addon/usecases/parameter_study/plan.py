"""The inputs of a parameter study: sweep.toml, and its points in the unit cube."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit, load_preset, read_unit, to_toml
from ...design.quantity import Description
from ...errors import InputError, MuError, did_you_mean
from ...fem.protocol import Protocol
from ...meshing.settings import SELF_CONTACT
from ...reading import parse_toml
from ...run.folder import RUN, FolderLayout
from ...run.inputs import FORMAT, read_toml
from ...toml_writer import toml_text
from ..simulate_and_place.job import OF_FILES, Job, job_with, protocol_of, protocol_text
from ..simulate_and_place.settings import STAGES
from ..simulate_and_place.study_file import FILES
from .settings import GRID, LAST_STAGE, MEMORY, METHOD, MINUTES, MOST_POINTS, POINTS, RESIN, SEED, SOBOL
from .variable import FILE, Inputs, Variable, changed_inputs, variable


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


Array = np.ndarray[Any, Any]

UNIT, PROTOCOL = "unit.toml", "protocol.csv"
PLAN, TABLE, REPORT = "plan.csv", "points.csv", "report.html"
LAYOUT = FolderLayout(
    "sweep.toml",
    "# The inputs of this sweep; unit.toml and protocol.csv beside it belong to them.",
    results=(PLAN, TABLE, REPORT),
)
_KEYS = (
    "format", "preset", "unit", "protocol", "resin", "stages", "method", "points", "seed", "memory_MB",
    "minutes", "minimize", "maximize", "vary", *STAGES,
)  # fmt: skip


@attrs.frozen
class Point:
    """One study of a sweep: its number from 1, its varied values, and its job, or why there is none."""

    number: int
    values: Mapping[str, Any]
    job: Job | None
    error: MuError | None = None


@attrs.frozen
class Plan:
    """A sweep: the study that is varied, its variables, and how its points are chosen.

    folder: of sweep.toml and the files that it names. memory_MB, minutes: limits of one study. minimize,
    maximize: columns of the table, the objectives of Pareto fronts.
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
            return self.count
        return int(np.prod([len(v.levels) for v in self.variables]))

    def values(
        self, before: Array | None = None, count: int | None = None
    ) -> tuple[list[dict[str, Any]], Array]:
        """Varied values of each point, and positions (n, d) in the unit cube; `before`: an earlier plan's."""
        if self.method == GRID:
            grid = itertools.product(*(v.levels for v in self.variables))
            names = [v.name for v in self.variables]
            return [dict(zip(names, row, strict=True)) for row in grid], np.empty((0, len(names)))
        places = sample(self.method, count or self.count, len(self.variables), self.seed, before)
        rows = [
            {v.name: v.at(u) for v, u in zip(self.variables, row, strict=True)} for row in places.tolist()
        ]
        return rows, places

    def points(self, rows: list[dict[str, Any]]) -> list[Point]:
        """The study of every row; one that breaks a rule is a failed point."""
        found = []
        for number, values in enumerate(rows, 1):
            try:
                with_them = changed_inputs(self.inputs, values, self.folder)
                job = job_with(
                    with_them.tables, "[vary]", unit=with_them.unit, protocol=with_them.protocol, workers=1
                )
                found.append(Point(number, values, job))
            except MuError as error:
                found.append(Point(number, values, None, error))
        return found

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name, without the number of points, since more may be added."""
        values = {
            "format": FORMAT,
            "method": self.method,
            "seed": self.seed,
            "memory_MB": self.memory_MB,
            "minutes": self.minutes,
            "resin": self.resin,
            "minimize": self.minimize,
            "maximize": self.maximize,
            **self.inputs.tables,
            "vary": {v.name: v.table for v in self.variables},
            "run": {"points": self.count, "files": str(self.folder.resolve())},
        }
        return {
            LAYOUT.inputs: toml_text(values, LAYOUT.header),
            UNIT: to_toml(self.inputs.unit),
            PROTOCOL: protocol_text(self.inputs.protocol),
        }


def read_plan(path: Path) -> Plan:
    """The sweep of a TOML file; raises InputError."""
    document = read_toml(path, "parameter study", "give the path of a TOML file")
    return _plan_of(_kept_apart(document), path.parent, str(path))


def parse_plan(text: str, folder: Path, where: str = "sweep.toml") -> Plan:
    """The sweep of TOML text; folder: where the files lie that it names. Raises InputError."""
    return _plan_of(_kept_apart(parse_toml(text, where)), folder, where)


def read_plan_of_run(folder: Path) -> Plan:
    """The sweep that was run in a folder; raises InputError."""
    path = folder / LAYOUT.inputs
    document = read_toml(path, "parameter study")
    run = document.pop(RUN, {})
    if not isinstance(run, dict):
        raise InputError(f"{RUN} is not a table", str(path), f"write it as [{RUN}]")
    last = [stage for stage in STAGES if stage in document][-1:]
    document |= {"unit": UNIT, "protocol": PROTOCOL, "stages": last[0] if last else STAGES[0]}
    if "points" in run:
        document["points"] = run["points"]
    files = run.get("files", str(folder))
    return _plan_of(document, folder, str(path), Path(str(files)))


def _plan_of(document: dict[str, Any], folder: Path, where: str, files: Path | None = None) -> Plan:
    """The sweep of a document; files: folder of the files that its variables name, by default its own."""
    for key in document:
        if key not in (*_KEYS, RUN):
            raise InputError(
                f"unknown key {key!r}{did_you_mean(key, _KEYS)}", where, f"known: {', '.join(_KEYS)}"
            )
    if document.get("format") != FORMAT or isinstance(document.get("format"), bool):
        raise InputError(f"format = {document.get('format', 'missing')}", where, f"write format = {FORMAT}")
    vary = document.get("vary")
    if not isinstance(vary, dict) or not vary:
        raise InputError(
            "no input is varied",
            where,
            'add [vary] and lines like "chambers.wall_mm" = { low = .., high = .. }',
        )
    stage = _checked(document, LAST_STAGE, where)
    stages = STAGES[: STAGES.index(stage) + 1]
    tables: dict[str, dict[str, Any]] = {name: _settings(document, name, where) for name in stages}
    for name in STAGES[len(stages) :]:
        if name in document:
            raise InputError(
                f"[{name}] is not one of its stages", where, f'write stages = "{name}", or leave it out'
            )
    variables = tuple(variable(name, given, where) for name, given in _flat(vary).items())
    inputs = Inputs(_unit(document, folder, where), _protocol(document, folder), tables)
    plan = Plan(
        inputs=inputs,
        variables=variables,
        folder=folder if files is None else files,
        count=_checked(document, POINTS, where),
        **{d.name: _checked(document, d, where) for d in (METHOD, SEED, MEMORY, MINUTES, RESIN)},
        minimize=_words(document, "minimize", where),
        maximize=_words(document, "maximize", where),
    )
    # A setting that is wrong for every point is reported before any work, and not as many failures.
    job_with(tables, where, unit=inputs.unit, protocol=inputs.protocol, workers=1)
    for v in variables:
        if v.name == FILE:
            for name in v.values:
                protocol_of(plan.folder / str(name))
    return plan


def _kept_apart(document: dict[str, Any]) -> dict[str, Any]:
    """The document with self-contact where it names none and something is simulated."""
    simulate = document.get("simulate", {})
    # What is no table is refused later, by name.
    if not isinstance(simulate, dict) or document.get("stages", LAST_STAGE.default) == STAGES[0]:
        return document
    return document | {"simulate": {"self_contact": SELF_CONTACT.default} | simulate}


def _flat(vary: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Variables by their whole name: TOML reads chambers.wall_mm without quotes as a table in a table."""
    found: dict[str, Any] = {}
    for key, value in vary.items():
        name = f"{before}{key}"
        last = not isinstance(value, dict) or not value or any(k in value for k in ("low", "high", "values"))
        found |= {name: value} if last else _flat(value, f"{name}.")
    return found


def _settings(document: Mapping[str, Any], stage: str, where: str) -> dict[str, Any]:
    found = document.get(stage, {})
    if not isinstance(found, dict):
        raise InputError(f"{stage} is not a table", where, f"write it as [{stage}]")
    for key in found:
        if key in FILES or key in OF_FILES:
            raise InputError(
                f"a parameter study does not take {key}",
                f"{where}, [{stage}]",
                "leave it out; unit and protocol are named at the top of the file",
            )
    return dict(found)


def _unit(document: Mapping[str, Any], folder: Path, where: str) -> Unit:
    if ("preset" in document) == ("unit" in document):
        raise InputError("no unit is given", where, 'write preset = "mu-1.0x" or unit = "my-unit.toml"')
    if "preset" in document:
        return load_preset(_word(document, "preset", where))
    return read_unit(folder / _word(document, "unit", where))


def _protocol(document: Mapping[str, Any], folder: Path) -> Protocol:
    name = document.get("protocol")
    return protocol_of(None if name is None else folder / str(name))


def _word(document: Mapping[str, Any], key: str, where: str) -> str:
    found = document[key]
    if not isinstance(found, str):
        raise InputError(f"{key} = {found!r} is not a text", where, "write it in quotes")
    return found


def _words(document: Mapping[str, Any], key: str, where: str) -> tuple[str, ...]:
    found = document.get(key, [])
    if not isinstance(found, list) or not all(isinstance(word, str) for word in found):
        raise InputError(f"{key} = {found!r} is not a list of names", where, f'write {key} = ["mass_g"]')
    return tuple(found)


def _checked(document: Mapping[str, Any], d: Description, where: str) -> Any:
    try:
        return d.checked(document.get(d.name, d.default))
    except InputError as error:
        raise InputError(error.what, f"{where}, {error.where}", error.remedy) from error
