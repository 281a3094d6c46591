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

from .. import design
from ..design.quantity import described
from ..errors import InputError
from ..run.context import RunContext
from ..run.study import Found, Input, Study, Written, given, setting
from .inputs import UnitInput
from .unit_inputs import BodyInput

RESULT, POINTS = "prepared.npz", "points.npz"


@attrs.frozen
class OfInput(Input):
    """Texts and switches that the computation takes, each a key of the inputs."""

    kind: str = "of"

    def write(self, name: str, value: Mapping[str, Any]) -> Written:
        """Its keys."""
        return Written(value)

    def read(self, name: str, found: Found) -> dict[str, Any]:
        """All keys that are left."""
        values = dict(found.keys)
        found.keys.clear()
        return values


@attrs.frozen(kw_only=True, eq=False)
class Prepare(Study):
    """What is prepared to be shown in a window; `of` has the texts and switches that it takes."""

    name = "prepare"
    header = "# What is prepared to be shown in a window."
    streams = True
    page = ""
    files = {RESULT: "arrays"}

    result: str = setting(
        described("result", "solid", "what is computed", choices=("solid", "difference", "embedding"))
    )
    unit: design.Unit | None = given(UnitInput(needed=False), default=None)
    body: design.Body | None = given(BodyInput(target=""), default=None)
    of: Mapping[str, Any] = given(OfInput(), factory=dict)

    def work(self, folder: Path, context: RunContext) -> None:
        """Compute the arrays and write them into the folder; raises MuError."""
        from ..files import write_npz

        maker = {"solid": _solid, "difference": _difference, "embedding": _embedding}[self.result]
        with context.progress.stage(self.result, 3.0):
            write_npz(folder / RESULT, maker(self, folder), packed=False)

    @property
    def window(self) -> design.Window | None:
        """The path of a solid's waveguide."""
        return design.window(self.unit, self.of["path"]) if self.unit and self.of["path"] else None


def solid_of(arrays: Mapping[str, Any], job: Prepare) -> design.Solid:
    """The solid that a job's arrays hold."""
    from ..design.gates import Gates, Guide
    from ..reading import parse_json

    gates = parse_json(str(arrays["gates"]).encode(), RESULT)
    guide = None if gates["guide"] is None else Guide(**gates.pop("guide"))
    found = Gates(**{**gates, "guide": guide})
    return design.Solid(arrays["vertices"], arrays["triangles"], found, job.window, job.of["quality"])


def _solid(job: Prepare, folder: Path) -> dict[str, Any]:
    import numpy as np

    from ..design.stl_and_nodes import write_stl

    assert job.unit is not None
    made = design.build_solid(job.unit, job.window, job.of["quality"], job.body)
    if job.of["stl"]:
        write_stl(made, Path(job.of["stl"]))
    gates = json.dumps(attrs.asdict(made.gates))
    return {"vertices": made.vertices, "triangles": made.triangles, "gates": np.array(gates)}


def _difference(job: Prepare, folder: Path) -> dict[str, Any]:
    import numpy as np

    from ..report.motion_files import REGIONS, read_motion
    from ..simulate_and_place.run_difference import difference

    name, one, other = job.of["name"], *(read_motion(Path(job.of[run])) for run in ("one", "other"))
    found = {r: difference(one, name, one.skin(r, job.of["cut"]), other, name) for r in REGIONS}
    known = {f"{r}_unknown": np.array(f.unknown) for r, f in found.items()}
    return {r: f.distance_mm for r, f in found.items()} | known


def _embedding(job: Prepare, folder: Path) -> dict[str, Any]:
    from ..files import read_npz
    from ..report.motion_files import read_motion

    points = read_npz(folder / POINTS)
    if points is None:
        raise InputError("there are no points", str(folder / POINTS), "start again")
    read_motion(Path(job.of["one"])).embedding(points["points"])
    return {}
