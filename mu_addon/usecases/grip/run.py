"""`grip`: a gripper's printable part, its grasp of cubes and its light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...body.printed_mesh import mesh_printed
from ...design.anchors import anchor_points, window
from ...design.gripper import GripperSolid, build_gripper
from ...design.quantity import in_kPa, in_MPa
from ...design.surface import stl_bytes
from ...design.threemf import Part, read_3mf, write_3mf
from ...design.waveguide import waveguide
from ...errors import OutputError
from ...fem.materials import Materials
from ...fem.self_intersection import first_self_intersection
from ...fem.state import State, rest
from ...fem.unit_materials import materials_of, self_contact_of
from ...files import write_bytes, write_csv
from ...meshing.mesh import Mesh
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.progress import Progress
from ...run.usecase import UseCase
from ...sensing.embedded_waveguide import Joints, embed_waveguide
from ...sensing.light_signal import Signal, traced_signal
from ..simulate_and_place.job import in_time_newton
from .expected import GRASP_OF, stage_of
from .grasp import Grasp, Lift, grasp
from .job import LAYOUT, Job, plan_of, read_job
from .motion_files import write_grasp
from .phases import MEANING
from .report import write_report
from .settings import Cube

Array = np.ndarray[Any, Any]

# Rays through the waveguide, an instant.
RAYS = 40_000


@attrs.define
class Gripping:
    """State of a gripper's run; results are also in `folder` as soon as they are complete."""

    job: Job
    folder: Path
    context: RunContext
    solid: GripperSolid | None = None
    mesh: Mesh | None = None
    grasps: dict[float, Grasp] = attrs.field(factory=dict)
    signals: dict[float, Signal] = attrs.field(factory=dict)
    warnings: list[str] = attrs.field(factory=list)

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    # Stages, in the order they need each other.

    def run(self) -> None:
        """Run every stage."""
        gripper = self.job.gripper
        self.context.summary["inputs"] = {
            "gripper": attrs.asdict(gripper.fingers) | attrs.asdict(gripper.plate),
            "unit": gripper.unit.name,
            "path": gripper.path,
            "grip": attrs.asdict(self.job.grip),
        }
        self.design()
        if self.job.cubes:
            self.make_mesh()
        for cube in self.job.cubes:
            self.close_on(cube)
        if self.grasps:
            self.follow_light()

    def design(self) -> None:
        """Write the printable part as STL and 3MF, and check the 3MF by reading it."""
        with self.progress.stage("solid", 6.0):
            found = self.solid = build_gripper(self.job.gripper, self.job.quality)
            write_bytes(self.folder / "gripper.stl", stl_bytes(found.vertices, found.triangles))
            name = self.job.gripper.name
            packed = write_3mf([Part(name, found.vertices, found.triangles)], [1], name)
            back = read_3mf(packed)[0][1]
            if len(back.triangles) != len(found.triangles):
                raise OutputError(
                    "the 3MF file, read back, does not contain the part that was written", "gripper.3mf"
                )
            write_bytes(self.folder / "gripper.3mf", packed)
        self.context.summary["gates"] = attrs.asdict(found.gates)
        x, y = self.job.gripper.size_mm
        self.context.summary["size_mm"] = [x, y, float(np.ptp(found.vertices[:, 2]))]

    def make_mesh(self) -> None:
        """Analysis mesh of half a finger."""
        with self.progress.stage("mesh", 5.0):
            mesh = self.mesh = mesh_printed(self.job.gripper.unit, self.job.mesh)
            self.progress.made(f"{len(mesh.nodes)} nodes and {len(mesh.tets)} elements")
        self.context.summary["mesh"] = {"nodes": len(mesh.nodes), "tetrahedra": len(mesh.tets)}

    @property
    def materials(self) -> Materials:
        """Materials of the finger's mesh."""
        assert self.mesh is not None
        return materials_of(self.job.gripper.unit, self.mesh)

    def _key(self, *parts: Any) -> str:
        assert self.mesh is not None
        own = attrs.astuple(self.job.grip), self.job.gripper.fingers.gap_mm, self.job.self_contact
        return key(self.mesh.hash(), self.materials.hash(), own, *parts)

    def close_on(self, cube: Cube) -> None:
        """The grasp of one cube, phase by phase."""
        assert self.mesh is not None
        job, name = self.job, f"cube-{cube.side_mm:g}"
        apart = self_contact_of(job.gripper.unit, self.mesh) if job.self_contact else None
        entry = self._key("grasp", attrs.astuple(cube), job.phases.text())
        with self.progress.stage(stage_of(cube.side_mm)):
            kept = self.cache.get("grasp", entry)
            if kept is None:
                found = grasp(
                    job.gripper,
                    cube,
                    job.phases,
                    self.mesh,
                    self.materials,
                    job.grip,
                    on_instant=self.progress.update,
                    newton=in_time_newton(job.self_contact),
                    self_contact=apart,
                )
                self.cache.put("grasp", entry, _arrays(found))
            else:
                found = _grasp(cube, kept)
            self.grasps[cube.side_mm] = found
            _write_grasp_csv(self.folder / f"grasp_{cube.side_mm:g}.csv", found)
            rows = zip(found.lift.pull_mm, found.lift.pull_N, strict=True)
            write_csv(
                self.folder / f"pull_{cube.side_mm:g}.csv",
                ["down_mm", "carried_N"],
                [(f"{way:.6g}", f"{force:.6g}") for way, force in rows],
            )
            write_grasp(self.folder / name, job.gripper, self.mesh, self.materials, found)
        self.context.summary.setdefault("grasps", {})[f"{cube.side_mm:g}"] = grasp_figures(found)
        self._look_for_self_intersection(found)
        if found.snapped_mm.any():
            first = int(np.flatnonzero(found.snapped_mm)[0])
            self.warn(
                f"Closing on {cube.side_mm:g} mm parts of the finger snap, for the "
                f"first time before {found.time_s[first]:g} s ({found.pressure_kPa[first]:.4g} kPa), by "
                f"{found.snapped_mm.max():.2g} mm at most: later states are those that a damped motion "
                "reaches."
            )
        if not found.lift.held:
            self.warn(
                f"The cube of {cube.side_mm:g} mm ({cube.mass_g:.3g} g) is not lifted: friction can carry "
                f"at most {found.lift.capacity_N:.3g} N of its {cube.weight_N:.3g} N."
            )

    def _look_for_self_intersection(self, found: Grasp) -> None:
        """Report the first pressure at which walls of the free finger intersect as it opens."""
        assert self.mesh is not None
        # With self-contact no step passes a touch.
        if self.job.self_contact:
            return
        opening = range(1, found.end("i") + 1)
        states = [State(in_MPa(float(found.pressure_kPa[k])), found.u[k]) for k in opening]
        first = first_self_intersection(self.mesh, [rest(self.mesh), *states])
        if first is not None:
            self.warn(
                f"From {in_kPa(first.pressure_MPa):.4g} kPa on, walls of the opening finger intersect: "
                f"{first.crossings[0]}. States beyond are invalid. Use a smaller vacuum or --self-contact."
            )

    def follow_light(self) -> None:
        """Trace the waveguide's light through every grasp, by rays through the bent bar."""
        assert self.mesh is not None
        unit, optics = self.job.gripper.unit, self.job.optics
        with self.progress.stage("light", 20.0):
            path = window(unit, self.job.gripper.path)
            nodes = anchor_points(unit)[list(path.indices)]
            bar = embed_waveguide(waveguide(unit, path), nodes, unit.printed)
            joints = Joints.of(self.mesh, nodes)
            for side, found in self.grasps.items():
                moved = [joints.moved(u) for u in found.u]
                self.signals[side] = traced_signal(bar, moved, optics, RAYS)
                _write_grasp_csv(self.folder / f"grasp_{side:g}.csv", found, self.signals[side])
        light: dict[str, Any] = {}
        for side, signal in self.signals.items():
            ends = {name: self.grasps[side].end(name) for name in MEANING}
            error = signal.errors * signal.transmitted / signal.at_rest
            light[f"{side:g}"] = {
                "lost_at_end_of": {name: float(signal.delta[k]) for name, k in ends.items()},
                "error_at_end_of": {name: float(error[k]) for name, k in ends.items()},
            }
        self.context.summary["light"] = light

    def warn(self, text: str) -> None:
        """Warn the user, now and in the report."""
        if text not in self.warnings:
            self.warnings.append(text)
            self.progress.warning(text)
        self.context.summary["warnings"] = self.warnings


def grasp_figures(found: Grasp) -> dict[str, Any]:
    """Key figures of a grasp for summary.json."""
    hold, lift = found.end("iii"), found.lift
    return {
        "mass_g": found.cube.mass_g,
        "angle_at_hold_deg": float(found.angle_deg[hold]),
        "angle_at_opening_deg": float(found.angle_deg[found.end("i")]),
        "normal_at_hold_N": float(found.normal_N[hold]),
        "down_at_hold_N": float(found.down_N[hold]),
        "most_normal_N": float(found.normal_N.max()),
        "sticking_at_hold": float(found.sticking[hold]),
        "slid_at_hold_mm": float(found.slid_mm[hold]),
        "gap_error_mm": float(found.deepest_mm.max()),
        "held": lift.held,
        "sag_mm": lift.sag_mm,
        "carried_after_lift_N": -2.0 * float(found.down_N[found.end("iv")]),
        "weight_N": lift.weight_N,
        "capacity_N": lift.capacity_N,
        "margin": lift.margin,
        "margin_by_rule": lift.margin_by_rule,
        "pressure_work_mJ": found.pressure_work_mJ,
        "cube_work_mJ": found.cube_work_mJ,
        "lost_to_friction_mJ": float(found.lost_mJ[-1]),
    }


_OF_GRASP = tuple(f.name for f in attrs.fields(Grasp) if f.name not in ("cube", "phase", "lift"))
_OF_LIFT = tuple(f.name for f in attrs.fields(Lift))


def _arrays(found: Grasp) -> dict[str, Array]:
    """A grasp as arrays, for the cache."""
    arrays = {name: getattr(found, name) for name in _OF_GRASP}
    arrays |= {f"lift_{name}": np.asarray(getattr(found.lift, name)) for name in _OF_LIFT}
    return arrays | {"phase": np.array(found.phase, dtype="U4")}


def _grasp(cube: Cube, arrays: dict[str, Array]) -> Grasp:
    lift: dict[str, Any] = {name: arrays[f"lift_{name}"] for name in _OF_LIFT}
    lift = {name: value if value.ndim else value.item() for name, value in lift.items()}
    phase = tuple(str(name) for name in arrays["phase"])
    return Grasp(cube=cube, phase=phase, lift=Lift(**lift), **{n: arrays[n] for n in _OF_GRASP})


def _write_grasp_csv(path: Path, found: Grasp, signal: Signal | None = None) -> None:
    names = ["time_s", "pressure_kPa", "angle_deg", "normal_N", "down_N", "area_mm2", "sticking", "slid_mm"]
    names += ["deepest_mm", "lost_mJ", "volume_mm3", "snapped_mm"]
    values = [getattr(found, name) for name in names] + [found.cube_mm[:, 2]]
    columns = ["phase", *names, "cube_z_mm"]
    if signal is not None:
        columns += ["light", "light_lost"]
        values += [signal.transmitted, signal.delta]
    rows = [
        (name, *(f"{v:.6g}" for v in row)) for name, row in zip(found.phase, np.array(values).T, strict=True)
    ]
    write_csv(path, columns, rows)


def grip(job: Job, folder: Path, context: RunContext) -> Gripping:
    """Design a gripper, close it on cubes, trace its light, and report finished stages."""
    run = Gripping(job, folder, context)
    context.report = lambda stopped: write_report(run, stopped)
    run.run()
    return run


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a grasp's `summary`."""
    x, y, z = summary["size_mm"]
    lines = [f"one part of {x:g} x {y:g} x {z:.4g} mm, {summary['gates']['inner_shells']} chambers"]
    for side, g in summary.get("grasps", {}).items():
        hung = f"held, {g['margin']:.3g} times its weight" if g["held"] else "not lifted"
        lines.append(
            f"cube of {side} mm: {g['angle_at_hold_deg']:.1f} deg and {g['normal_at_hold_N']:.3g} N a finger "
            f"at the plateau, {hung}"
        )
    return lines


USE_CASE = UseCase("grip", LAYOUT, read_job, grip, console_summary, plan=plan_of, kept=(GRASP_OF,))
