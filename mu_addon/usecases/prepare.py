"""Slow computations for a window, in another process: a solid, a difference of runs, an embedding.

prepared.npz: for `solid` `vertices`, `triangles` and `gates` (JSON); for `difference` by region the distance
and `REGION_unknown`; empty for `embedding`, which the motion's folder keeps.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.anchors import window
from ..design.body import Body, read_body
from ..design.gates import Gates, Guide
from ..design.parameters import Unit, read_unit, to_toml
from ..design.solid import Solid, build_solid
from ..design.stl_and_nodes import write_stl
from ..errors import InputError
from ..files import read_npz, write_npz
from ..reading import parse_json
from ..report.motion_files import REGIONS, read_motion
from ..run.context import RunContext
from ..run.folder import FolderLayout
from ..run.inputs import FORMAT, read_inputs
from ..run.usecase import UseCase
from ..toml_writer import toml_text
from .simulate_and_place.run_difference import difference

RESULT, POINTS = "prepared.npz", "points.npz"
UNIT, BODY = "unit.toml", "body.obj"
LAYOUT = FolderLayout("prepare.toml", "# What is prepared to be shown in a window.", (RESULT,), (UNIT, BODY))


@attrs.frozen(eq=False)
class Job:
    """Key in `MAKERS`, and its inputs: texts, switches; a solid's unit and envelope."""

    what: str
    of: Mapping[str, Any]
    unit: Unit | None = None
    body: Body | None = None

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; prepare.toml is the first."""
        texts = {LAYOUT.inputs: toml_text({"format": FORMAT, "what": self.what, **self.of}, LAYOUT.header)}
        if self.unit is not None:
            texts[UNIT] = to_toml(self.unit)
        if self.body is not None:
            texts[BODY] = self.body.text()
        return texts


def read_job(folder: Path) -> Job:
    """The job that a folder describes; raises InputError."""
    path = folder / LAYOUT.inputs
    table, _ = read_inputs(path)
    what = table.word("what", tuple(MAKERS))
    values = {key: value for key, value in table.values.items() if key != "what"}
    unit, body = folder / UNIT, folder / BODY
    return Job(
        what, values, read_unit(unit) if unit.is_file() else None, read_body(body) if body.is_file() else None
    )


def solid_of(arrays: Mapping[str, Any], job: Job) -> Solid:
    """The solid that a job's arrays hold."""
    assert job.unit is not None
    gates = parse_json(str(arrays["gates"]).encode(), RESULT)
    guide = None if gates["guide"] is None else Guide(**gates.pop("guide"))
    found = Gates(**{**gates, "guide": guide})
    return Solid(arrays["vertices"], arrays["triangles"], found, _window(job), job.of["quality"])


def _window(job: Job) -> Any:
    assert job.unit is not None
    return window(job.unit, job.of["path"]) if job.of["path"] else None


def _solid(job: Job, folder: Path) -> dict[str, Any]:
    assert job.unit is not None
    made = build_solid(job.unit, _window(job), job.of["quality"], job.body)
    if job.of["stl"]:
        write_stl(made, Path(job.of["stl"]))
    gates = json.dumps(attrs.asdict(made.gates))
    return {"vertices": made.vertices, "triangles": made.triangles, "gates": np.array(gates)}


def _difference(job: Job, folder: Path) -> dict[str, Any]:
    name, one, other = job.of["name"], *(read_motion(Path(job.of[run])) for run in ("one", "other"))
    found = {r: difference(one, name, one.skin(r, job.of["cut"]), other, name) for r in REGIONS}
    known = {f"{r}_unknown": np.array(f.unknown) for r, f in found.items()}
    return {r: f.distance_mm for r, f in found.items()} | known


def _embedding(job: Job, folder: Path) -> dict[str, Any]:
    points = read_npz(folder / POINTS)
    if points is None:
        raise InputError("there are no points", str(folder / POINTS), "start again")
    read_motion(Path(job.of["one"])).embedding(points["points"])
    return {}


MAKERS = {"solid": _solid, "difference": _difference, "embedding": _embedding}


def run(job: Job, folder: Path, context: RunContext) -> None:
    """Compute the arrays and write them into the folder; raises MuError."""
    with context.progress.stage(job.what, 3.0):
        write_npz(folder / RESULT, MAKERS[job.what](job, folder), packed=False)


USE_CASE = UseCase("prepare", LAYOUT, read_job, run, lambda summary: [])
