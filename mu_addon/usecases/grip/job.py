"""Inputs of a grasp: the gripper, the cubes, the phases, and the detail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs

from ...design.gripper import Gripper, read_gripper, to_toml
from ...design.parameters import to_toml as unit_toml
from ...design.settings import QUALITY
from ...errors import InputError
from ...meshing.settings import SELF_CONTACT, MeshSettings
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, read_inputs, structured
from ...run.progress_estimate import Plan
from ...sensing.guide import Optics
from ...toml_writer import toml_text
from .expected import expected_plan
from .phases import Phases, read_phases, shipped_phases
from .settings import COARSE_REFINE, COARSE_STEP_S, REFINE, SIDES, STEP_S, Cube, Grip

GRIPPER, UNIT, PROTOCOL = "gripper.toml", "unit.toml", "protocol.csv"
LAYOUT = FolderLayout(
    "grip.toml",
    "# The inputs of this grasp; gripper.toml, unit.toml and protocol.csv beside it belong to them.",
    results=(
        "gripper.stl",
        "gripper.3mf",
        "grasp_*.csv",
        "pull_*.csv",
        "cube-*",
        "gripper.png",
        "frame_*.png",
        "report.html",
    ),
)


@attrs.frozen
class Detail:
    """Detail of a grasp: mesh and the longest time between instants."""

    mesh: MeshSettings
    step_s: float

    def grip(self, **values: Any) -> Grip:
        """Contact of fingers and cube, with values of `Grip`."""
        return Grip(step_s=self.step_s, **values)


def detailed(coarse: bool, refine: float | None = None) -> Detail:
    """Detail of a quick look, or of a whole run; refine: replaces its refinement."""
    own = COARSE_REFINE if coarse else REFINE.default
    mesh = MeshSettings(refine=own if refine is None else refine)
    return Detail(mesh, COARSE_STEP_S if coarse else STEP_S)


@attrs.frozen
class Job:
    """Inputs of a run. cubes: without any, no grasp; self_contact: of a finger's walls and struts.

    Raises InputError.
    """

    gripper: Gripper
    cubes: tuple[Cube, ...] = tuple(Cube(side) for side in SIDES)
    grip: Grip = attrs.field(factory=Grip)
    phases: Phases = attrs.field(factory=shipped_phases)
    mesh: MeshSettings = attrs.field(factory=lambda: MeshSettings(refine=REFINE.default))
    quality: str = QUALITY.field()
    optics: Optics = attrs.field(factory=Optics)
    self_contact: bool = SELF_CONTACT._replace(default=False).field()

    def __attrs_post_init__(self) -> None:
        self.gripper.unit.wall.require_without_memory("a grasp")
        sides = [cube.side_mm for cube in self.cubes]
        if len(set(sides)) < len(sides):
            raise InputError("two cubes have the same side", "--cube", "name each side once")
        for side in sides:
            if side >= self.gripper.fingers.gap_mm:
                raise InputError(
                    f"a cube of {side:g} mm does not fit between fingers "
                    f"{self.gripper.fingers.gap_mm:g} mm apart",
                    "--cube",
                    "choose a smaller cube, or a gripper with a wider gap",
                )

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; grip.toml is the first."""
        values = {
            "format": FORMAT,
            "quality": self.quality,
            "cubes": [attrs.asdict(cube) for cube in self.cubes],
            "grip": attrs.asdict(self.grip),
            "mesh": attrs.asdict(self.mesh),
            "optics": attrs.asdict(self.optics),
        }
        if self.self_contact:
            values["self_contact"] = True
        return {
            LAYOUT.inputs: toml_text(values, LAYOUT.header),
            GRIPPER: to_toml(self.gripper, UNIT),
            UNIT: unit_toml(self.gripper.unit),
            PROTOCOL: self.phases.text(),
        }


def read_job(folder: Path) -> Job:
    """The job that a folder of `grip` describes; raises InputError."""
    path = folder / LAYOUT.inputs
    values, _ = read_inputs(path)
    given = {"gripper": read_gripper(folder / GRIPPER), "phases": read_phases(folder / PROTOCOL)}
    return structured(Job, values, str(path), **given)


def plan_of(job: Job) -> Plan:
    """Stages of a grasp with the expected seconds of each on two cores."""
    sides = [cube.side_mm for cube in job.cubes]
    return expected_plan(sides, job.mesh.refine, job.grip.step_s)
