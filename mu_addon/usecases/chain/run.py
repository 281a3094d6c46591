"""`chain`: units in series, their motion under their pressures, or the pressures that reach a point."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...body.printed_mesh import mesh_printed
from ...chain.chain import Chain, ChainState, Link, Loads
from ...chain.inverse import Reach, reach_point
from ...chain.joint_learning import Learned, learn
from ...chain.settings import REFINE
from ...chain.unit_between_plates import frame, spread
from ...design.parameters import Unit
from ...errors import ConvergenceError
from ...fem.state import State
from ...files import write_csv
from ...materials.library import load_material
from ...measured.pose import down
from ...meshing.mesh import Mesh
from ...report.vtk import write_trajectory
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.progress import Progress
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from ...run.versions import package_versions
from .job import LAYOUT, Job, read_job
from .report import write_report

JOINT_S = 289.0
"""Seconds in which a joint is learned at one pressure on the default mesh."""


def run_chain(job: Job, folder: Path, context: RunContext) -> Running:
    """Learn the units' joints, solve the chain, write its motion and a report of all finished stages."""
    run = Running(job, folder, context)
    context.report = lambda stopped: write_report(run, stopped)
    run.run()
    return run


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a run's `summary`."""
    lines = []
    for joint in summary["joints"]:
        lines.append(
            f"{joint['unit']}: {joint['mass_g']:.1f} g, held-out error {joint['error_deg']:.2f} deg and "
            f"{joint['error_mm']:.2f} mm"
        )
    lines = list(dict.fromkeys(lines))
    found = summary["chain"]
    x, y, z = found["tip_mm"]
    rest = ", ".join(f"{v:.1f}" for v in found["tip_at_rest_mm"])
    lines.append(
        f"tip of {found['units']} units at ({x:.1f}, {y:.1f}, {z:.1f}) mm, "
        f"{found['angle_deg']:.1f} deg; at rest ({rest}) mm"
    )
    if "target" in summary:
        target = summary["target"]
        pressures = ", ".join(f"{p:.4g}" for p in target["pressures_kPa"])
        lines.append(f"target missed by {target['miss_mm']:.3g} mm, at {pressures} kPa")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of a chain's run with the expected seconds of each on two cores."""
    # Alike units share a joint.
    spans = {one.unit.hash(): span for one, span in zip(job.units, job.ranges_kPa(), strict=True)}
    plan = []
    for n, span in enumerate(spans.values(), 1):
        finer = job.mesh.refine / REFINE.default
        # Those at rest take as long as those under two pressures.
        joint_s = JOINT_S * finer * (len(job.joint.pressures(*span)) + 2)
        plan += [(f"mesh of unit {n}", 4.0 * finer**2), (f"joint of unit {n}", joint_s)]
    return [*plan, ("chain", 2.0 if job.target is None else 12.0), ("files", 2.0), ("report", 3.5)]


KEPT = ("mesh of unit", "joint of unit")
USE_CASE = UseCase("chain", LAYOUT, read_job, run_chain, console_summary, plan=plan_of, kept=KEPT)


Array = np.ndarray[Any, Any]


@attrs.define
class Running:
    """State of a chain's run; results are also in `folder` as soon as they are complete.

    learned: by unit's number; states: at each instant of time_s.
    """

    job: Job
    folder: Path
    context: RunContext
    meshes: list[Mesh] = attrs.field(factory=list)
    learned: list[Learned] = attrs.field(factory=list)
    chain: Chain | None = None
    rest: ChainState | None = None
    time_s: Array = attrs.field(factory=lambda: np.zeros(0))
    states: list[ChainState] = attrs.field(factory=list)
    reach: Reach | None = None
    warnings: list[str] = attrs.field(factory=list)

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    def warn(self, words: str) -> None:
        """Report a warning, and keep it for the report."""
        self.warnings.append(words)
        self.progress.warning(words)

    def run(self) -> None:
        """Run every stage in order."""
        self.context.summary["versions"] = package_versions()
        self._learn()
        self._solve()
        self._write()

    def _learn(self) -> None:
        found: dict[str, tuple[Mesh, Learned]] = {}
        for one, span in zip(self.job.units, self.job.ranges_kPa(), strict=True):
            name = one.unit.hash()
            if name not in found:
                found[name] = self._learned(one.unit, span, len(found) + 1)
            self.meshes.append(found[name][0])
            self.learned.append(found[name][1])
        rows = []
        for one, learned in zip(self.job.units, self.learned, strict=True):
            rows += [(one.unit.name, *(f"{v:.6g}" for v in row.values())) for row in learned.held_out]
        titles = list(self.learned[0].held_out[0]) if self.learned[0].held_out else []
        write_csv(self.folder / "joints.csv", ["unit", *titles], dict.fromkeys(rows))
        joints = []
        for one, learned in zip(self.job.units, self.learned, strict=True):
            joint = learned.joint
            h = joint.at(0.0).hessian(joint.at(0.0).eta0)
            joints.append(
                {
                    "unit": one.unit.name,
                    "turn_deg": one.turn_deg,
                    "mass_g": joint.mass_g,
                    "pressure_kPa": joint.pressure_kPa[[0, -1]],
                    "bending_N_mm_per_rad": h[0, 0],
                    "twist_N_mm_per_rad": h[2, 2],
                    "axial_N_per_mm": h[5, 5],
                    "error_deg": _rms([row["angle_error_deg"] for row in learned.held_out]),
                    "error_mm": _rms([row["place_error_mm"] for row in learned.held_out]),
                    "missed": learned.missed,
                }
            )
        self.context.summary["joints"] = joints

    def _learned(self, unit: Unit, span: tuple[float, float], number: int) -> tuple[Mesh, Learned]:
        job, progress = self.job, self.progress
        pressures = job.joint.pressures(*span)
        with progress.stage(f"mesh of unit {number}"):
            mesh = mesh_printed(unit, job.mesh, lambda _, share: progress.update(share), self.cache.folder)
        density = load_material(job.resin).density_g_per_ml
        # A state hangs on the free ones before it, and these on the pressures visited.
        name = key("joint", unit.hash(), mesh.hash(), attrs.astuple(job.joint), density, pressures)
        with progress.stage(f"joint of unit {number}", 300.0):
            learned = learn(
                unit.name,
                unit,
                mesh,
                pressures,
                job.joint,
                density,
                lambda what: self.cache.get("plate", key(name, what)),
                lambda what, arrays: self.cache.put("plate", key(name, what), arrays),
                progress.update,
            )
        if learned.missed:
            self.warn(
                f"{unit.name}: {len(learned.missed)} loaded states were not reached, first "
                f"{learned.missed[0]}; the joint is less accurate there"
            )
        return mesh, learned

    def _solve(self) -> None:
        job = self.job
        heavy = down(job.orientation_deg) if job.gravity else np.zeros(3)
        loads = Loads(heavy, job.tip_mass_g, np.array(job.tip_force_N), np.array(job.tip_couple_N_mm))
        self.chain = chain = Chain(
            [Link(found.joint, one.turn_deg) for found, one in zip(self.learned, job.units, strict=True)],
            loads,
        )
        with self.progress.stage("chain"):
            begun = time.process_time()
            self.rest = chain.at_rest()
            if job.target is not None:
                self._reach_target(chain, job.target.reach)
            else:
                assert job.protocol is not None
                self.time_s, pressures = job.protocol.sample(job.times)
                self._follow(chain, pressures)
            seconds = (time.process_time() - begun) / max(1, len(self.states))
        used = max(float(state.used_range.max()) for state in self.states)
        if used > 1.0:
            self.warn(
                f"a unit is loaded to {used:.2f} times its joint's learned range: widen [joint] bend_deg, "
                "twist_deg, shear or stretch, or read these states with care"
            )
        last = self.states[-1]
        self.context.summary["chain"] = {
            "units": len(job.units),
            "mass_g": sum(found.joint.mass_g for found in self.learned),
            "tip_at_rest_mm": self.rest.tip_mm,
            "tip_mm": last.tip_mm,
            "tip_error_mm": last.tip_error_mm,
            "rotation_vector_deg": last.rotation_vector_deg,
            "angle_deg": last.angle_deg,
            "largest_angle_deg": max(state.angle_deg for state in self.states),
            "largest_used_range": used,
            "processor_s_a_state": seconds,
        }

    def _follow(self, chain: Chain, pressures: Array) -> None:
        """States at each row of pressures (t, n), in order from the one at rest."""
        state = self.rest
        assert state is not None
        for k, row in enumerate(pressures):
            try:
                state = chain.reach(state, row)
            except ConvergenceError as error:
                if not self.states:
                    raise
                words = ", ".join(f"{p:.4g}" for p in row)
                raise ConvergenceError(
                    f"no equilibrium of the chain at {words} kPa: {error.what}", error.where, error.remedy
                ) from None
            self.states.append(state)
            self.progress.update((k + 1) / len(pressures))

    def _reach_target(self, chain: Chain, point: tuple[float, float, float]) -> None:
        spans = [one.pressure_kPa or (0.0, 0.0) for one in self.job.units]
        low, high = np.array(spans, float).T
        self.reach = found = reach_point(chain, np.array(point), low, high)
        self.time_s = np.linspace(0.0, 1.0, self.job.times)
        self._follow(chain, self.time_s[:, None] * found.pressures_kPa)
        self.context.summary["target"] = {
            "reach_mm": point,
            "miss_mm": found.miss_mm,
            "pressures_kPa": found.pressures_kPa,
            "at_bound": found.at_bound,
            "steps": found.iterations,
        }
        rows = [
            (n, f"{p:.9g}", "yes" if end else "no")
            for n, (p, end) in enumerate(zip(found.pressures_kPa, found.at_bound, strict=True), 1)
        ]
        write_csv(self.folder / "target.csv", ["unit", "pressure_kPa", "at_bound"], rows)
        if found.miss_mm > 1.0:
            self.warn(
                f"the tip comes no nearer than {found.miss_mm:.1f} mm to the target within the pressures: "
                "move the point, widen pressure_kPa or add a unit"
            )

    def _write(self) -> None:
        assert self.rest is not None
        with self.progress.stage("files"):
            n = len(self.job.units)
            columns = ["time_s", *(f"pressure_{k}_kPa" for k in range(1, n + 1))]
            columns += ["x_mm", "y_mm", "z_mm", "x_error95_mm", "y_error95_mm", "z_error95_mm"]
            columns += [
                "rotation_x_deg",
                "rotation_y_deg",
                "rotation_z_deg",
                "angle_deg",
                "angle_error95_deg",
            ]
            columns += ["used_range"]
            rows = [
                [
                    f"{v:.9g}"
                    for v in (
                        t,
                        *s.pressures_kPa,
                        *s.tip_mm,
                        *s.tip_error_mm,
                        *s.rotation_vector_deg,
                        s.angle_deg,
                        s.angle_error_deg,
                        s.used_range.max(),
                    )
                ]
                for t, s in zip(self.time_s, self.states, strict=True)
            ]
            write_csv(self.folder / "tip.csv", columns, rows)
            mesh = self.whole_mesh()
            moving = [
                (float(t), State(0.0, self.places(s) - mesh.nodes))
                for t, s in zip(self.time_s, self.states, strict=True)
            ]
            write_trajectory(self.folder / "chain.pvd", mesh, moving)

    def whole_mesh(self) -> Mesh:
        """Meshes of all units stacked as drawn, for pictures and files: they share no nodes."""
        nodes, tets, region, first, height = [], [], [], 0, 0.0
        for one, mesh in zip(self.job.units, self.meshes, strict=True):
            nodes.append(mesh.nodes @ frame(one.turn_deg)[:3, :3].T + [0.0, 0.0, height])
            tets.append(mesh.tets + first)
            region.append(mesh.region)
            first += len(mesh.nodes)
            height += float(mesh.nodes[mesh.tip[0], 2])
        empty = np.zeros((0, 6))
        last = first - len(self.meshes[-1].nodes) + self.meshes[-1].tip
        return Mesh(
            np.concatenate(nodes),
            np.concatenate(tets),
            np.concatenate(region),
            empty,
            self.meshes[0].base,
            last,
        )

    def places(self, state: ChainState) -> Array:
        """Positions (m, 3) in mm of the nodes of `whole_mesh` in a state of the chain, for display.

        A unit's free state at its pressure, advanced by the constant strain between its plates: exact on the
        plates, approximate between them.
        """
        found = []
        parts = zip(self.job.units, self.meshes, self.learned, state.plates, strict=False)
        for i, (one, mesh, learned, base) in enumerate(parts):
            joint = learned.joint
            p = float(state.pressures_kPa[i])
            number = np.interp(p, joint.pressure_kPa, np.arange(len(joint.pressure_kPa)))
            k = min(int(number), max(len(joint.pressure_kPa) - 2, 0))
            share = number - k
            u, eta0 = (
                (1 - share) * table[k] + share * table[min(k + 1, len(table) - 1)]
                for table in (learned.free_u, joint.eta0)
            )
            station = np.clip(mesh.nodes[:, 2] / float(mesh.nodes[mesh.tip[0], 2]), 0.0, 1.0)
            x = mesh.nodes + spread(mesh, u, station, eta0, state.eta[i])
            own = base @ frame(one.turn_deg)
            found.append(x @ own[:3, :3].T + own[:3, 3])
        return np.concatenate(found)


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")
