"""The inputs of a study, and their text in study.toml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design.anchors import window, windows
from ...design.assets import asset_root
from ...design.body import Body, envelope, read_body, require_path_inside
from ...design.parameters import Unit, read_unit, to_toml
from ...design.rigid_body import RigidBody, mirrored, read_rigid_bodies, require_beside, to_obj
from ...design.settings import FRICTION, QUALITY
from ...errors import InputError
from ...fem.device import device_field, require_device
from ...fem.newton_settings import (
    RESOLVED_CONTACT_NEWTON,
    RESOLVED_NEWTON,
    RESOLVED_OBSTACLE_NEWTON,
    NewtonSettings,
)
from ...fem.protocol import Protocol, read_protocol
from ...meshing.settings import SELF_CONTACT, MeshSettings
from ...placement.graph import Limits
from ...run.folder import claim, keep_inputs
from ...run.inputs import digest
from ...run.lock import FolderLock
from ...sensing.guide import Optics
from .named_effects import NamedEffects
from .settings import (
    ALL_PATHS,
    CHECKS,
    MESH_CHECK,
    PATHS,
    QUICK_REFINE,
    SELF_FRICTION,
    STAGES,
    STATIONS,
    TIMES,
    UNDER_PRESSURE,
    WORKERS,
)
from .study_file import FILES, FILES_OF, LAYOUT, NAME, Tables, compose, holds, read_run
from .study_file import read as read_tables

if TYPE_CHECKING:
    # The inputs of a study are made without the solver: Blender's window waits for them.
    from ...fem.materials import Materials
    from ...fem.model import Model
    from ...meshing.mesh import Mesh

GRASP = "protocols/grasp.csv"


@attrs.frozen
class Job:
    """Inputs of a study. times: samples k of the protocol; stations: j along the backbone.

    The 13 samples of the grasp protocol are 1 s or 10 kPa apart and include each of its corners.
    """

    unit: Unit
    protocol: Protocol
    mesh: MeshSettings = attrs.field(factory=MeshSettings)
    times: int = TIMES.field()
    under_pressure: bool = UNDER_PRESSURE.field()
    stations: int = STATIONS.field()
    quality: str = QUALITY.field()
    workers: int = WORKERS.field()
    mesh_check: bool = MESH_CHECK.field()
    paths: str = PATHS.field()
    # Decides no figure, only how many there are.
    all_paths: bool = ALL_PATHS.field()
    limits: Limits = attrs.field(factory=Limits)
    # Optical constants of the resin, for the signal beside each path's disturbance.
    optics: Optics = attrs.field(factory=Optics)
    most_checks: int = CHECKS.field()
    # A sound body that replaces the lattice's box.
    body: Body | None = None
    # Rigid bodies that the unit may touch, fixed in its frame.
    obstacles: tuple[RigidBody, ...] = attrs.field(default=(), converter=tuple)
    # Effects named by measured data beyond the unit's parameters, and the direction of gravity.
    effects: NamedEffects = attrs.field(factory=NamedEffects)
    # Self-contact of walls and struts, at several times the cost.
    self_contact: bool = SELF_CONTACT._replace(default=False).field()
    self_friction: float = SELF_FRICTION.field()
    # Of the finite elements: within the solver's tolerance it decides nothing.
    device: str = device_field()
    # Stages to run: the first, the first two or all.
    stages: tuple[str, ...] = STAGES
    # Name of a path along which the unit with a waveguide is built, too; decides no figure.
    path: str = attrs.field(default="", validator=attrs.validators.instance_of(str))

    def __attrs_post_init__(self) -> None:
        if self.path:
            # Only its name is kept: an unknown one must be found before the solid is built.
            window(self.unit, self.path)
        for refused, what, where, remedy in self._refusals():
            if refused:
                raise InputError(what, where, remedy)

    def _refusals(self) -> Iterator[tuple[bool, str, str, str]]:
        """Pairs of settings that exclude each other: True if both are given, then what, where and remedy."""
        without, one = "the search of the whole lattice does not support", "leave one of them out"
        graph = "place" in self.stages and self.paths == "graph"
        yield graph and bool(self.obstacles), f"{without} obstacles", "obstacles, paths", one
        yield (
            bool(self.self_friction) and not self.self_contact,
            "friction between walls and struts needs self-contact",
            "--self-friction",
            "also give --self-contact, or leave it out",
        )
        friction = graph and bool(self.self_friction)
        yield friction, f"{without} friction", "--self-friction, --paths graph", one
        yield (
            graph and self.unit.wall.has_memory,
            "the search of the whole lattice does not support a wall with memory",
            "[wall], paths",
            "rank the windows of anchors, or use an elastic law",
        )
        for name in ("anisotropy", "strain_stiffening"):
            yield (
                bool(self.unit.wall.names) and name in self.effects.values,
                f"{name} changes a neo-Hookean wall, and this unit's has a law of its own",
                f"[wall], {name}",
                "leave [wall] out, or the effect and give the wall layers_excess or c2_over_c1",
            )
        clogged = graph and bool(self.effects.clogged)
        yield clogged, f"{without} a clogged chamber", "clogged_chamber, paths", one
        yield (
            self.under_pressure and not self.driven.pressure_kPa.any(),
            "the protocol has no pressure above 0, and its suction is left out",
            "--quick, protocol",
            "rank with suction, or give a protocol with pressure",
        )
        yield (
            not self.samples[1].any(),
            f"none of the {self.times} samples of the protocol has a pressure other than 0",
            "times",
            "give more samples, or a protocol that leaves 0 kPa",
        )

    @property
    def driven(self) -> Protocol:
        """The protocol that is solved: without suction if that is left out."""
        return self.protocol.under_pressure() if self.under_pressure else self.protocol

    @cached_property
    def samples(self) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Time in s and pressure in kPa, (k,) each, at which the protocol is solved.

        With effects in time that is the effective pressure.
        """
        protocol = self.driven
        time, pressure = protocol.sample(self.times)
        if not self.effects.in_time:
            return time, pressure
        # Between the protocol's corners the pressure is linear, as the effects have it.
        every = np.union1d(protocol.time_s, time)
        effective = self.effects.effective_kPa(
            every, np.interp(every, protocol.time_s, protocol.pressure_kPa)
        )
        # Rounded, so that the same pressure met twice is recognised as one equilibrium.
        return time, np.round(effective[np.searchsorted(every, time)], 9)

    @property
    def supplied_kPa(self) -> np.ndarray[Any, Any]:
        """The protocol's pressure (k,) in kPa at the times of `samples`."""
        return self.driven.sample(self.times)[1]

    def tables(self) -> Tables:
        """All inputs that decide the results, a table for each stage, as in study.toml.

        Not `workers` and `device`, which do not.
        """
        simulate: dict[str, Any] = {"times": self.times}
        if self.under_pressure:
            simulate[UNDER_PRESSURE.name] = True
        if self.self_contact:
            simulate["self_contact"] = True
        if self.self_friction:
            simulate["self_friction"] = self.self_friction
        if self.obstacles:
            simulate["friction"] = [o.friction for o in self.obstacles]
        tables: Tables = {
            "design": {"quality": self.quality},
            "simulate": simulate | {"mesh": attrs.asdict(self.mesh)} | self.effects.tables,
            "place": {
                "stations": self.stations,
                "mesh_check": self.mesh_check,
                "paths": self.paths,
            },
        }
        if self.optics != Optics():
            tables["place"]["optics"] = attrs.asdict(self.optics)
        if self.paths == "graph":
            tables["place"]["search"] = attrs.asdict(self.limits) | {"most_checks": self.most_checks}
        texts = self._file_texts()
        for stage, keys in FILES_OF.items():
            named = {key: texts[key] for key in keys if key in texts}
            files = [((key, FILES[key]), (f"{key}_sha256", digest(text))) for key, text in named.items()]
            tables[stage] = dict(pair for pairs in files for pair in pairs) | tables[stage]
        return {stage: tables[stage] for stage in self.stages}

    def text(self) -> str:
        """study.toml, see `tables`."""
        return compose(self.tables(), self._run)

    @property
    def _run(self) -> dict[str, Any]:
        """The table [run] of study.toml, whose keys decide no figure."""
        return {
            **({"path": self.path} if self.path else {}),
            **({ALL_PATHS.name: True} if self.all_paths else {}),
        }

    def materials(self, mesh: Mesh) -> Materials:
        """Materials of the unit's mesh, effects and all."""
        from ...fem.unit_materials import materials_of

        drawn = materials_of(self.unit, mesh)
        return self.effects.materials(drawn, mesh)

    def model(self, mesh: Mesh, threads: int = 2) -> Model:
        """Model of the unit's mesh: pressure, weight, obstacles. Raises InputError."""
        require_device(self.device)
        model = self.effects.model(self.unit, mesh, threads, self.device)
        if self.obstacles:
            from .contact_history import obstacles_of

            model.obstacles = obstacles_of(self.obstacles, self.unit, mesh)
        if self.self_contact:
            from ...fem.unit_materials import self_contact_of

            model.self_contact = self_contact_of(self.unit, mesh, self.self_friction)
        return model

    @property
    def newton(self) -> NewtonSettings:
        """Settings of Newton's method for this unit."""
        if self.in_time:
            return in_time_newton(self.self_contact)
        return RESOLVED_CONTACT_NEWTON if self.self_contact else RESOLVED_NEWTON

    @property
    def in_time(self) -> bool:
        """True if motion is solved instant by instant, since contact or the wall's law has history."""
        return bool(self.obstacles) or self.unit.wall.has_memory or bool(self.self_friction)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; study.toml is the first."""
        texts = self._file_texts()
        keys = [key for stage in self.stages for key in FILES_OF[stage] if key in texts]
        return {NAME: self.text()} | {FILES[key]: texts[key] for key in keys}

    def _file_texts(self) -> dict[str, str]:
        """Text of each file of inputs by its key in study.toml."""
        found = {"unit": to_toml(self.unit), "protocol": protocol_text(self.protocol)}
        if self.body is not None:
            found["body"] = self.body.text()
        if self.obstacles:
            found["obstacles"] = self.obstacles_text()
        return found

    def texts_in(
        self, folder: Path, run: Mapping[str, Any] = MappingProxyType({})
    ) -> tuple[dict[str, str], bool]:
        """Texts for a folder, with the still valid inputs of further stages there; True if they fit.

        So `design` in the folder of a `place` of the same unit keeps its results. run: more for the table
        [run], which decides no figure. Raises InputError for a study.toml that cannot be used.
        """
        own = self.tables()
        old = read_tables(folder)
        if old is None or any(old[stage] != own[stage] for stage in own if stage in old):
            return self.texts(), False
        files = holds(folder, old)
        if files is None:
            return self.texts(), False
        merged = old | own
        tables = {stage: merged[stage] for stage in STAGES if stage in merged}
        return {**self.texts(), **files, NAME: compose(tables, {**self._run, **run})}, True

    def obstacles_text(self) -> str:
        """obstacles.obj: the rigid bodies that the unit may touch; empty without any."""
        return to_obj(self.obstacles) if self.obstacles else ""

    def mesh_settings(self, settings: MeshSettings) -> MeshSettings:
        """Settings of a mesh: of the whole unit if an obstacle is not symmetric."""
        if not self.obstacles or mirrored(self.obstacles):
            return settings
        return attrs.evolve(settings, fraction="full")


def quick(job: Job) -> Job:
    """The quick ranking of a study's unit: less is solved, and `study_file.left_out` says what is not.

    Raises InputError for a protocol without pressure above 0.
    """
    mesh = attrs.evolve(job.mesh, refine=min(job.mesh.refine, QUICK_REFINE))
    return attrs.evolve(job, mesh=mesh, mesh_check=False, under_pressure=True)


def in_time_newton(self_contact: bool) -> NewtonSettings:
    """Settings of Newton's method where a motion is solved instant by instant."""
    return RESOLVED_CONTACT_NEWTON if self_contact else RESOLVED_OBSTACLE_NEWTON


def protocol_text(protocol: Protocol) -> str:
    """The corner points of a protocol as CSV, to their last digit."""
    rows = zip(protocol.time_s, protocol.pressure_kPa, strict=True)
    return "time_s,pressure_kPa\n" + "".join(f"{float(t)!r},{float(p)!r}\n" for t, p in rows)


def read_job(folder: Path) -> Job:
    """The job that a study's folder describes; raises InputError where it cannot be used, and OutputError."""
    where = str(folder / NAME)
    tables = read_tables(folder)
    if tables is None:
        raise InputError("this folder contains no study", where, "give a folder that holds study.toml")
    if holds(folder, tables) is None:
        raise InputError(
            "an input file has changed since this study was made",
            str(folder),
            "restore it, or start a new study with it: --unit, --protocol, --obstacle",
        )
    asked = read_run(folder).get("stages", list(tables))
    return job_of({stage: table for stage, table in tables.items() if stage in asked}, folder)


def write_study(job: Job, folder: Path) -> None:
    """Write a study's inputs into its folder, for another process to `resume` it.

    Results there of a job of more stages from the same inputs are kept; [run] names the stages of this one,
    and is not kept. Raises InputError, also where another process works in the folder, and OutputError.
    """
    lock = FolderLock(folder)
    try:
        texts, current = job.texts_in(folder, {"stages": list(job.stages)})
        if current:
            keep_inputs(folder, texts, NAME)
        claim(folder, LAYOUT, texts)
    finally:
        lock.release()


def job_of(tables: Mapping[str, Mapping[str, Any]], folder: Path) -> Job:
    """The job of study.toml's tables and the files in its folder; raises InputError with an unknown key."""
    where = str(folder / NAME)
    job: dict[str, Any] = {"unit": read_unit(folder / FILES["unit"]), "protocol": grasp()}
    if "body" in tables["design"]:
        job["body"] = read_body(folder / FILES["body"])
    if "simulate" in tables:
        job["protocol"] = read_protocol(folder / FILES["protocol"])
        if "obstacles" in tables["simulate"]:
            friction = tables["simulate"].get("friction")
            job["obstacles"] = read_rigid_bodies(folder / FILES["obstacles"], friction)
    run = read_run(folder)
    job |= {"path": run.get("path", ""), ALL_PATHS.name: run.get(ALL_PATHS.name, False)}
    return job_with(tables, where, **job)


def job_with(tables: Mapping[str, Mapping[str, Any]], where: str, **given: Any) -> Job:
    """The job from settings in tables like study.toml's and other given inputs; raises InputError."""
    job = dict(given)
    for stage, table in tables.items():
        own = (*FILES, *OF_FILES)
        values = {k: v for k, v in table.items() if k not in own and not k.endswith("_sha256")}
        if stage == "simulate" and ("effects" in values or "orientation_deg" in values):
            named, turn = values.pop("effects", {}), values.pop("orientation_deg", 0.0)
            job["effects"] = NamedEffects(named, turn, f"{where}, [{stage}.effects]")
        for key, kind in (("mesh", MeshSettings), ("search", Limits), ("optics", Optics)):
            if key in values:
                inner = _inner(values.pop(key), f"{where}, [{stage}.{key}]")
                if key == "search" and "most_checks" in inner:
                    job["most_checks"] = inner.pop("most_checks")
                _require_known(inner, [f.name for f in attrs.fields(kind)], f"{where}, [{stage}.{key}]")
                job["limits" if key == "search" else key] = _built(kind, inner, f"{where}, [{stage}.{key}]")
        _require_known(values, SETTINGS[stage], f"{where}, [{stage}]")
        job |= values
    return _built(Job, {**job, "stages": tuple(tables)}, where)


def _require_known(values: Mapping[str, Any], known: Sequence[str], where: str) -> None:
    for key in values:
        if key not in known:
            raise InputError(f"unknown key {key!r}", where, f"known: {', '.join(known)}")


def _inner(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{value!r} is not a table", where, "write it as a table")
    return dict(value)


# Keys that belong to a file of inputs beside them.
OF_FILES = ("friction",)
# Keys of each stage's table besides files and inner tables.
SETTINGS = {
    "design": ("quality",),
    "simulate": ("times", "under_pressure", "orientation_deg", "self_contact", "self_friction"),
    "place": ("stations", "mesh_check", "paths"),
}


def _built(kind: Any, values: dict[str, Any], where: str) -> Any:
    try:
        return kind(**values)
    except InputError as error:
        raise InputError(error.what, f"{where}, {error.where}", error.remedy) from error
    except TypeError as error:
        raise InputError(f"study.toml is invalid: {error}", where, "correct that key") from error
    except ValueError as error:
        raise InputError(f"a value is not offered: {error.args[0]}", where, "correct that key") from error


def grasp() -> Protocol:
    """The default protocol."""
    return read_protocol(asset_root() / GRASP)


def protocol_of(path: str | Path | None) -> Protocol:
    """The protocol in a CSV file, or the default one. Raises InputError."""
    return grasp() if path is None else read_protocol(Path(path))


def body_for(unit: Unit, path: str | Path, stages: Sequence[str] = STAGES, paths: str = "windows") -> Body:
    """The body in a file, cut to the unit's length; raises InputError, also where a path leaves it."""
    body = envelope(read_body(path), unit.dimensions)
    require_paths_inside(unit, body, stages, paths)
    return body


def require_paths_inside(unit: Unit, body: Body, stages: Sequence[str], paths: str) -> None:
    """Raise InputError where the stages rank paths that leave a unit's body, or any path of the lattice."""
    if "place" in stages:
        if paths == "graph":
            raise InputError(
                "the search of the whole lattice supports only the default box of the lattice",
                "--body, --paths graph",
                "leave one of them out",
            )
        for window in windows(unit.chambers.count):
            require_path_inside(body, unit, window)


def obstacles_for(
    unit: Unit, files: Sequence[tuple[str | Path, float | None]], own: Body | None = None
) -> tuple[RigidBody, ...]:
    """Rigid bodies next to a unit, from files, each with its friction or None for the assumed one.

    own: the unit's body, if it is not the lattice's box. Raises InputError, also if a body overlaps the unit
    at rest.
    """
    found = [RigidBody(read_body(file), FRICTION.default if mu is None else mu) for file, mu in files]
    require_beside(found, unit.dimensions, own)
    return tuple(found)


def optics_of(words: Sequence[str]) -> Optics:
    """The resin's optics, changed by NAME=VALUE pairs; raises InputError."""
    names = [field.name for field in attrs.fields(Optics)]
    values: dict[str, float] = {}
    for word in words:
        name, _, value = word.partition("=")
        try:
            values[name] = float(value)
        except ValueError:
            name = ""
        if name not in names:
            raise InputError(f"{word!r} is not understood", "--light", f"NAME=VALUE with {', '.join(names)}")
    return Optics(**values)
