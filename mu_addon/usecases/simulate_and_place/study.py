"""One study from a unit to a ranked sensor path, stage by stage, in one folder."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import closing
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.anchors import Window, anchor_points, windows
from ...design.export import write_nodes, write_stl
from ...design.parameters import Material
from ...design.quantity import in_kPa
from ...design.solid import Solid, build_solid
from ...design.strut_cell import strut_cell
from ...design.wall import Wall
from ...errors import ConvergenceError, InputError, MeshingError
from ...fem.equilibrium import Equilibrium
from ...fem.kinematics import TipSection
from ...fem.lattice_law import deformation_gradients, stretches
from ...fem.model import Model
from ...fem.obstacle import ObstacleContact
from ...fem.self_intersection import first_self_intersection
from ...fem.state import State, rest
from ...fem.stress import peak_stretch
from ...fem.time_stepping import Instant, simulate_in_time
from ...fem.trajectory import Trajectory, simulate
from ...files import write_csv, write_npz
from ...homogenize.foam_response import ellipticity
from ...meshing.homogenised_unit import MeshingWarning
from ...meshing.mesh import LATTICE, MEMBRANE, Mesh
from ...meshing.quality import Quality, mesh_quality
from ...meshing.settings import MeshSettings
from ...placement.candidates import Candidate, Evaluation, candidate_paths
from ...placement.deviation import rank
from ...reading import file_bytes, parse_json
from ...report.results import (
    CONTACT_COLUMNS,
    SELF_CONTACT_COLUMNS,
    STRETCH_COLUMNS,
    ContactHistory,
    LatticeSearch,
    Signals,
)
from ...report.vtk import write_mesh, write_trajectory
from ...resolved.lattice import strut_volume_mm3
from ...resolved.unit import mesh_of
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.folder import begin, keep_inputs, require_space
from ...run.progress import Progress
from ...run.versions import package_versions
from .candidate_states import CandidateSolver
from .candidates_in_time import evaluations
from .contact_history import history
from .expected import work
from .job import Job
from .motion_files import write_model_a
from .path_motion import keep_motion
from .settings import STAGES
from .study_file import LAYOUT, NAME

Array = np.ndarray[Any, Any]

# Figures of summary.json by which a finished stage is recognised.
_FIGURE_OF_STAGE = {"design": "gates", "simulate": "angle_deg", "place": "chosen"}
# Disk space of a study, with a margin: a constant, and a part for each node and distinct pressure.
_BYTES = {"interactive": 30_000_000, "export": 150_000_000}
_BYTES_A_NODE = {"simulate": 300, "place": 1000}
# With self-contact, refine 0.7: docs/engineering/verification.md, the paper.
HOMOGENISED = (
    "The lattice is simulated as a homogenised continuum. With its struts as printed, which buckle, mu-1.0x "
    "bends 1.8 to 2.7 times as far at -5 and -10 kPa and 0.6 times as far at 50 kPa: where the size of the "
    "motion matters, choose the fidelity resolved."
)
# Refinement of a coarser mesh, to estimate the mesh uncertainty of a ranking.
COARSER = 0.7


@attrs.define
class Study:
    """State of a study; results are also in `folder` as soon as they are complete."""

    job: Job
    folder: Path
    context: RunContext
    solid: Solid | None = None
    mesh: Mesh | None = None
    quality: Quality | None = None
    trajectory: Trajectory | None = None
    states: list[State] = attrs.field(factory=list)
    evaluations: dict[tuple[str, str], Evaluation] = attrs.field(factory=dict)
    uncertainty_mm: dict[str, float] = attrs.field(factory=dict)
    warnings: list[str] = attrs.field(factory=list)
    solver: dict[str, Any] = attrs.field(factory=dict)
    contact: ContactHistory | None = None
    stretch: list[tuple[str, ...]] = attrs.field(factory=list)
    self_contact: list[tuple[str, ...]] = attrs.field(factory=list)
    search: LatticeSearch | None = None
    light: Signals | None = None
    _ahead: CandidateSolver | None = None

    @classmethod
    def open(cls, job: Job, folder: Path, context: RunContext) -> Study:
        """Open a study in a folder, which becomes its own (`begin_study`); InputError and OutputError."""
        begin_study(job, folder, context)
        return cls.begun(job, folder, context)

    @classmethod
    def begun(cls, job: Job, folder: Path, context: RunContext) -> Study:
        """A study in a folder already its own; its inputs are in the summary.

        Raises OutputError if the disk has too little room.
        """
        study = cls(job, folder, context)
        study._require_space(_expected_nodes(job) if "simulate" in job.stages else 0)
        context.summary["versions"] = package_versions()
        context.summary["parameters"] = attrs.asdict(job.unit)
        if job.body is not None:
            low, high = job.body.bounds.tolist()
            context.summary["body"] = {"low_mm": low, "high_mm": high, "triangles": len(job.body.triangles)}
        if "simulate" in job.stages:
            study._summarise_settings()
        return study

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    def _summarise_settings(self) -> None:
        """Put settings of the simulation into the summary, and warn of what they leave out."""
        job, summary = self.job, self.context.summary
        summary["study"] = {"times": job.times, "stations": job.stations, "rules": job.rules}
        summary["study"] |= {"mesh": job.mesh.table(), "mesher": job.mesher}
        if job.lattice is not None:
            summary["study"]["lattice"] = attrs.asdict(job.lattice)
            self._warn_of_another_cell()
        if job.effects:
            summary["study"] |= job.effects.tables
        self._warn_of_missed_corners()
        if job.mesh.order == 1:
            self.warn("Linear elements lock in thin walls: these results are for a quick look only.")
        if "simulate" in job.stages and not job.mesh.resolved:
            self.warn(HOMOGENISED)

    @cached_property
    def _tip(self) -> TipSection:
        assert self.mesh is not None
        return TipSection.of(self.mesh)

    def bending_angle_deg(self, u: Array) -> float:
        """Bending angle in degrees of the study's mesh under displacements (n, 3) in mm."""
        return self._tip.angle_deg(u)

    def _require_space(self, nodes: int) -> None:
        """Raise OutputError where the disk has less room than a study with so many nodes takes."""
        _, pressure = self.job.samples
        per_node = _BYTES_A_NODE["place" if "place" in self.job.stages else "simulate"]
        require_space(self.folder, _BYTES[self.job.quality] + nodes * per_node * len(np.unique(pressure)))

    @property
    def has_more(self) -> bool:
        """Return True if the folder has results of further stages than this job's, from the same inputs."""
        further = STAGES[len(self.job.stages) :]
        return any(_FIGURE_OF_STAGE[stage] in self.context.summary for stage in further)

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    @property
    def anchors(self) -> Array:
        """P1..Pn in mm, (n, 3)."""
        return anchor_points(self.job.unit)

    @property
    def windows(self) -> list[Window]:
        """The candidate paths' windows of anchors."""
        return windows(len(self.anchors))

    # Stages, in the order they need each other.

    def design(self, window: Window | None = None) -> Solid:
        """Printable solid, its STL and the lattice nodes; with a window, the unit with that waveguide."""
        name = "unit.stl" if window is None else f"unit_{window.name}.stl"
        with self.progress.stage("solid" if window is None else f"solid with {window.name}", 3.0):
            solid = build_solid(self.job.unit, window, self.job.quality, self.job.body)
            write_stl(solid, self.folder / name)
            write_nodes(self.job.unit, self.folder / "anchors.txt")
        gates = {**attrs.asdict(solid.gates), "inner_volume_error": solid.gates.inner_volume_error}
        self.context.summary.setdefault("gates", {})[name] = gates
        if window is None:
            self.solid = solid
        return solid

    def make_mesh(self) -> Mesh:
        """Make the analysis mesh and its quality; cached, since one of its meshers is not repeatable."""
        with self.progress.stage("mesh"):
            self.mesh = self._mesh(self.job.mesh)
            self.progress.made(f"{len(self.mesh.nodes)} nodes and {len(self.mesh.tets)} elements")
            self._require_space(len(self.mesh.nodes))
            struts = strut_volume_mm3(self.job.unit, self.job.body) if self.mesh.resolved else None
            self.quality = mesh_quality(self.mesh, self.job.unit, self.job.body, struts)
            modulus, _ = self.job.materials(self.mesh).small_strain(len(self.mesh.tets))
            write_mesh(self.folder / "mesh.vtu", self.mesh, modulus)
        own = {"beams": len(self.mesh.beams), "hash": self.mesh.hash()}
        self.context.summary["mesh"] = {**attrs.asdict(self.quality), **own}
        return self.mesh

    def _mesh(self, settings: MeshSettings) -> Mesh:
        settings = self.job.mesh_settings(settings)
        # Only the shape: material and name do not change a mesh.
        shape = attrs.evolve(self.job.unit, name="shape", material=Material(), wall=Wall())
        body = [] if self.job.body is None else [self.job.body.hash]
        name = key(shape.hash(), attrs.astuple(settings), self.job.mesher, *body)
        found = self.cache.get("mesh", name)
        fields = [f.name for f in attrs.fields(Mesh)]
        if found is not None and set(found) == set(fields):
            symmetry = tuple(str(axis) for axis in found.pop("symmetry"))
            return Mesh(**found, symmetry=symmetry)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            mesh = mesh_of(
                self.job.unit,
                settings,
                lambda _, share: self.progress.update(share),
                self.job.mesher,
                self.cache.folder,
                self.job.body,
            )
        fallback = [w for w in caught if issubclass(w.category, MeshingWarning)]
        for warning in fallback:
            self.warn(str(warning.message))
        # A substitute's mesh is cached by its mesher; here it would pass for the one asked for.
        if not fallback:
            arrays = {f: getattr(mesh, f) for f in fields}
            self.cache.put("mesh", name, {**arrays, "symmetry": np.array(mesh.symmetry, dtype="U1")})
        return mesh

    def simulate(self, candidates_beside: bool = False) -> Trajectory:
        """Simulate Model A: the unit without a sensor through the pressure protocol.

        candidates_beside: let other processes solve the candidates as soon as a state is there.
        """
        assert self.mesh is not None
        time, pressure = self.job.samples
        with self.progress.stage("Model A"):
            model = self.job.model(self.mesh)
            if candidates_beside and self.job.workers > 1 and not self.job.in_time:
                self._ahead = CandidateSolver(
                    self.job, self.cache, self.mesh, self._jobs(), pressure, self.job.headline_rule
                )
            try:
                self.trajectory = self._model_a(model, time, pressure, self._reached)
            except BaseException:
                if self._ahead is not None:
                    self._ahead.close()
                self._keep_partial_motion()
                raise
            self._write_motion(self.trajectory.solved)
            self._write_contact()
            self._write_stretch(self.trajectory.solved)
            materials = self.job.materials(self.mesh)
            touching = self._write_self_contact(model, self.trajectory.solved)
            remembered = self._remembered(model)
            supplied = attrs.evolve(self.trajectory, pressure_kPa=self.job.supplied_kPa)
            write_model_a(self.folder, self.mesh, materials, supplied, remembered, touching)
            self._look_for_self_intersection(self.trajectory.solved)
            self._tell_of_snaps(self.trajectory.solved)
            self._look_beyond_the_fit(self.trajectory.solved)
        states = [s for s in self.trajectory.solved if s.loaded]
        self.solver = {
            "method": model.solver,
            "device": model.device,
            "unknowns": len(model.free),
            "states": len(states),
            "newton_iterations": sum(s.iterations for s in states),
            "factorisations": sum(s.factorisations for s in states),
            "largest_relative_residual": max((s.residual for s in states), default=0.0),
        }
        self.context.summary["solver"] = self.solver
        return self.trajectory

    def _reached(self, state: State) -> None:
        self.states.append(state)
        if not (self.job.in_time or self.job.effects.in_time):
            # At once, so that a killed run leaves its progress.
            angles = self.context.summary.setdefault("angle_deg", {})
            angles[f"{state.pressure_kPa:.6g}"] = self.bending_angle_deg(state.u)
        if self._ahead is not None:
            self._ahead.reached(state)

    def _model_a(self, model: Model, time: Array, pressure: Array, on_state: Any) -> Trajectory:
        """Model A's trajectory on a model's mesh, load step by load step, from the cache where present."""
        materials = self.job.materials(model.mesh)
        if self.job.in_time:
            return self._in_time(model, time, pressure, on_state)
        # A state's last digits depend on the pressures visited before it.
        visited = np.unique(pressure)
        name = key(model.mesh.hash(), materials.hash(), visited, self.job.newton, *self.job.effects.parts)
        total, done = work(self.job, visited), 0.0
        body = Equilibrium(model, materials, self.job.newton)

        def keep(state: State) -> None:
            nonlocal done
            done += work(self.job, [state.pressure_kPa])
            least, _ = model.smallest_jacobian(state.u, body.parameters)
            words = f"{state.pressure_kPa:.4g} kPa, residual {state.residual:.1e}"
            words += f", {state.iterations} iterations, smallest det F {least:.2f}"
            self.progress.update(done / total if total else 1.0, words)
            on_state(state)

        return simulate(
            body,
            time,
            pressure,
            keep,
            load=lambda p: self._stored(name, p, model),
            store=lambda state: self.cache.put(
                "state", key(name, state.pressure_MPa), attrs.asdict(state, recurse=False)
            ),
        )

    def _in_time(self, model: Model, time: Array, pressure: Array, on_state: Any) -> Trajectory:
        """Model A instant by instant, since contact or wall has history, from the cache likewise."""
        job, materials = self.job, self.job.materials(model.mesh)
        name = self._in_time_key(model, time, pressure)
        found: list[list[ObstacleContact]] = []

        def keep(state: State) -> None:
            found.append([o.contact(state.u) for o in model.obstacles])
            words = f"{state.pressure_kPa:.4g} kPa"
            if job.obstacles:
                force = sum(float(np.linalg.norm(c.force_N)) for c in found[-1])
                words += f", contact {force:.3g} N"
            self.progress.update(len(found) / len(time), words)
            on_state(state)

        motion = simulate_in_time(
            Equilibrium(model, materials, job.newton),
            time,
            pressure,
            keep,
            load=lambda number: self._kept_instant(key(name, number), model),
            store=lambda number, instant: self._keep_instant(key(name, number), instant),
        )
        if model.mesh is self.mesh and job.obstacles:
            self.contact = history(job.obstacles, model.mesh, time, pressure, found)
        return motion

    def _in_time_key(self, model: Model, time: Array, pressure: Array) -> str:
        job = self.job
        parts: list[Any] = [(o.depth_mm, o.stiffness, o.stick_stiffness, o.friction) for o in model.obstacles]
        if job.self_friction:
            parts.append(job.self_friction)
        return key(
            model.mesh.hash(),
            job.materials(model.mesh).hash(),
            time,
            pressure,
            job.newton,
            job.obstacles_text() or "",
            parts,
            *job.effects.parts,
        )

    def _remembered(self, model: Model) -> Callable[[int], tuple[Array, ...]]:
        """Function of an instant's number that returns the wall's history there; empty for an elastic one."""
        if not self.job.unit.wall.has_memory:
            return lambda number: ()
        name = self._in_time_key(model, *self.job.samples)

        def remembered(number: int) -> tuple[Array, ...]:
            kept = self._kept_instant(key(name, number), model)
            return () if kept is None else kept.history

        return remembered

    def _keep_instant(self, name: str, instant: Instant) -> None:
        arrays = attrs.asdict(instant.state, recurse=False) | {"time_s": instant.time_s}
        if instant.rate is not None:
            arrays["rate"] = instant.rate
        for number, memory in enumerate(instant.contacts):
            arrays |= {f"{number} {part}": values for part, values in memory.items()}
        for number, values in enumerate(instant.history):
            arrays[f"history {number}"] = values
        self.cache.put("instant", name, arrays)

    def _kept_instant(self, name: str, model: Model) -> Instant | None:
        found = self.cache.get("instant", name)
        if found is None or found.get("u", np.empty(0)).shape != model.mesh.nodes.shape:
            return None
        contacts = [
            {part.partition(" ")[2]: a for part, a in found.items() if part.startswith(f"{number} ")}
            for number in range(len(model.remembering))
        ]
        memory = tuple(found[f"history {n}"] for n in range(len(found)) if f"history {n}" in found)
        return Instant(float(found["time_s"]), _state(found), found.get("rate"), tuple(contacts), memory)

    def _stored(self, name: str, pressure_MPa: float, model: Model) -> State | None:
        found = self.cache.get("state", key(name, pressure_MPa))
        if found is None or found.get("u", np.empty(0)).shape != model.mesh.nodes.shape:
            return None
        return _state(found)

    def _write_motion(self, states: Any) -> None:
        assert self.mesh is not None
        if self.job.in_time or self.job.effects.in_time:
            self._write_in_time(states)
            return
        ordered = sorted(states, key=lambda s: s.pressure_MPa)
        angles = [self.bending_angle_deg(s.u) for s in ordered]
        pressures = [s.pressure_kPa for s in ordered]
        write_csv(
            self.folder / "angle.csv",
            ["pressure_kPa", "angle_deg"],
            [(f"{p:.6g}", f"{a:.6g}") for p, a in zip(pressures, angles, strict=True)],
        )
        self.context.summary["angle_deg"] = {f"{p:.6g}": a for p, a in zip(pressures, angles, strict=True)}
        by_pressure = {round(s.pressure_kPa, 9): s for s in ordered}
        time, pressure = self.job.samples
        reached = [(t, by_pressure[p]) for t, p in zip(time, pressure, strict=True) if p in by_pressure]
        write_trajectory(self.folder / "model_a.pvd", self.mesh, reached)

    def _write_in_time(self, states: Any) -> None:
        """Write the motion, an instant a row: with contact or history the way back differs."""
        assert self.mesh is not None
        reached = self._instants(states)
        rows = [
            (f"{t:.9g}", f"{p:.6g}", f"{self.bending_angle_deg(s.u):.6g}", f"{s.pressure_kPa:.6g}")
            for t, p, s in reached
        ]
        head = ["time_s", "pressure_kPa", "angle_deg"]
        if self.job.effects.in_time:
            # The effective pressure of the unit without the effects in time.
            head.append("effective_kPa")
        write_csv(self.folder / "angle.csv", head, [row[: len(head)] for row in rows])
        # Of a pressure met twice, what it was the first time.
        first = {p: float(a) for _, p, a, _ in reversed(rows)}
        self.context.summary["angle_deg"] = dict(sorted(first.items(), key=lambda item: float(item[0])))
        write_trajectory(self.folder / "model_a.pvd", self.mesh, [(t, s) for t, _, s in reached])

    def _instants(self, states: Any) -> list[tuple[float, float, State]]:
        """Time in s, supplied pressure in kPa and state of every instant of the protocol that was reached."""
        time, effective = self.job.samples
        if self.job.in_time:
            at = list(states)
        else:
            by_pressure = {round(s.pressure_kPa, 9): s for s in states}
            at = [by_pressure.get(p) for p in effective.tolist()]
        supplied = self.job.supplied_kPa.tolist()
        found = zip(time.tolist(), supplied, at, strict=False)
        return [(t, p, state) for t, p, state in found if state is not None]

    def motion_in_order(self) -> tuple[Array, Array]:
        """Pressure (s,) in kPa and bending angle (s,) in degrees of the motion as far as it was computed.

        One state a pressure, ascending; one an instant where contact, the wall or an effect has history.
        """
        states = self.trajectory.solved if self.trajectory else tuple(self.states)
        if self.job.in_time or self.job.effects.in_time:
            shown = [(p, s) for _, p, s in self._instants(states)]
        else:
            shown = [(s.pressure_kPa, s) for s in sorted(states, key=lambda s: s.pressure_MPa)]
        angles = [self.bending_angle_deg(s.u) for _, s in shown] if self.mesh is not None else []
        return np.array([p for p, _ in shown]), np.array(angles)

    def _write_contact(self) -> None:
        """Write the contacts with obstacles, if there are any."""
        if self.contact is None:
            return
        write_csv(self.folder / "contact.csv", CONTACT_COLUMNS, self.contact.rows())
        self.context.summary["contact"] = self.contact.summary()

    def _write_self_contact(self, model: Model, states: tuple[State, ...]) -> list[Array]:
        """Write the self-contact of every state; return its pressure (n,) in kPa at all nodes."""
        self.self_contact = []
        if model.self_contact is None:
            return []
        found = [model.self_contact.touch(state.u) for state in states]
        for state, touch in zip(states, found, strict=True):
            row = [f"{state.pressure_kPa:.6g}", f"{touch.force_N:.4g}", "", "", "", "", ""]
            if touch.force_N:
                node = int(touch.pressure_kPa.argmax())
                place = (f"{x:.2f}" for x in model.mesh.nodes[node])
                row[2:] = [f"{touch.gap_mm:.4f}", f"{touch.pressure_kPa[node]:.4g}", *place]
            self.self_contact.append(tuple(row))
        write_csv(self.folder / "self_contact.csv", list(SELF_CONTACT_COLUMNS), self.self_contact)
        if self.job.self_friction:
            # Of the whole unit, as the forces are.
            lost = 2.0 ** len(model.mesh.symmetry) * model.self_contact.lost_mJ
            self.context.summary["self_friction"] = {"coefficient": self.job.self_friction, "lost_mJ": lost}
        return [touch.pressure_kPa for touch in found]

    def _write_stretch(self, states: tuple[State, ...]) -> None:
        """Write the largest stretches of wall and lattice in every state, and their positions."""
        assert self.mesh is not None
        self.stretch = []
        struts = "struts" if self.mesh.resolved else "homogenised lattice"
        for state in states:
            for part, region in (("wall", MEMBRANE), (struts, LATTICE)):
                peak = peak_stretch(self.mesh, state.u, region)
                place = (f"{x:.2f}" for x in peak.place_mm)
                values = (f"{peak.largest:.4f}", *place, f"{peak.exceeded:.4f}")
                self.stretch.append((f"{state.pressure_kPa:.6g}", part, *values))
        write_csv(self.folder / "stretch.csv", list(STRETCH_COLUMNS), self.stretch)

    def _look_for_self_intersection(self, states: tuple[State, ...]) -> None:
        """Report the first pressure, on either side, at which walls pass through each other, and which."""
        assert self.mesh is not None
        found: dict[str, Any] = {}
        # With self-contact no step passes a touch.
        for sign in () if self.job.self_contact else (-1, 1):
            outward = sorted(
                (s for s in states if s.pressure_MPa * sign > 0), key=lambda s: abs(s.pressure_MPa)
            )
            still = [s for s in states if s.loaded and not s.pressure_MPa]
            first = first_self_intersection(self.mesh, [rest(self.mesh), *still, *outward])
            if first is None:
                continue
            pressure = f"{in_kPa(first.pressure_MPa):.4g}"
            instead = ", --self-contact" if self.job.mesh.resolved else ""
            found[pressure] = [str(c) for c in first.crossings]
            self.warn(
                f"From {pressure} kPa on, walls intersect: {first.crossings[0]}. Self-contact is not "
                f"modelled, so states beyond this pressure are invalid. Use a thicker wall{instead} or a "
                "smaller pressure."
            )
        self.context.summary["walls_cross_at_kPa"] = found

    def _tell_of_snaps(self, states: tuple[State, ...]) -> None:
        """Report the first pressure on either side beyond a limit point, and how far a node moved.

        For a motion solved instant by instant, the first instant.
        """
        snapped = [s for s in states if s.snapped_mm]
        if self.job.in_time:
            ways = [snapped]
        else:
            outward = sorted(snapped, key=lambda s: abs(s.pressure_MPa))
            ways = [[s for s in outward if s.pressure_MPa * sign > 0] for sign in (-1, 1)]
        for way in ways:
            if way:
                first = way[0]
                self.warn(
                    f"Before {first.pressure_kPa:.4g} kPa parts of the unit snap, by {first.snapped_mm:.2g} "
                    "mm at most: states from there on are those that damped motion leads to, and the way "
                    "back differs."
                )

    def _look_beyond_the_fit(self, states: tuple[State, ...]) -> None:
        """Warn where the lattice is strained beyond the range of its law's fit or stability."""
        if self.job.lattice is None:
            return
        assert self.mesh is not None
        law = self.job.lattice.law
        low, high = law.stretch
        inside = np.flatnonzero(self.mesh.region == LATTICE)
        found = {}
        for state in states:
            F, volume = deformation_gradients(self.mesh, state.u, inside)
            a = stretches(F)
            beyond = (a[:, :, 0] < low) | (a[:, :, 2] > high)
            # One point an element: it takes a while.
            lost = ellipticity(law, F[:, 0]) <= 0
            found[f"{state.pressure_kPa:.6g}"] = {
                "least": float(a.min()),
                "largest": float(a.max()),
                "share_beyond_fit": float((volume * beyond).sum() / volume.sum()),
                "share_not_elliptic": float((volume.sum(axis=1) * lost).sum() / volume.sum()),
            }
        self.context.summary["lattice_stretch"] = found
        least, largest = (
            pick(s[n] for s in found.values()) for pick, n in ((min, "least"), (max, "largest"))
        )
        pressure, worst = max(found.items(), key=lambda item: item[1]["share_beyond_fit"])
        if worst["share_beyond_fit"]:
            self.warn(
                f"The lattice is strained to stretches from {least:.2f} to {largest:.2f}, but its law was "
                f"fitted from {low:g} to {high:g}: at {pressure} kPa {worst['share_beyond_fit']:.1%} of the "
                "lattice volume is outside that range, where the law is extrapolated."
            )
        pressure, worst = max(found.items(), key=lambda item: item[1]["share_not_elliptic"])
        if worst["share_not_elliptic"]:
            self.warn(
                f"At {pressure} kPa the law is no longer elliptic in {worst['share_not_elliptic']:.1%} of "
                "the lattice volume: struts buckle there, and the result depends on the mesh. Compare two "
                "meshes (--refine)."
            )

    def _keep_partial_motion(self) -> None:
        """Write the motion found before a failure; summary.json says that it is partial."""
        if self.mesh is not None and self.states:
            start = [] if self.job.in_time or self.job.effects.has_gravity else [rest(self.mesh)]
            self._write_motion([*start, *self.states])

    def _jobs(self) -> list[tuple[Candidate, str]]:
        return [(c, rule) for rule in self.job.rules for c in candidate_paths(self.anchors, self.windows)]

    def place(self) -> dict[str, str]:
        """Compare every candidate under every rule with Model A; return the chosen path of each rule."""
        assert self.mesh is not None
        assert self.trajectory is not None
        jobs = self._jobs()
        with self.progress.stage("candidates"):
            found = self.solve_candidates(
                self.mesh, self.trajectory, jobs, self._ahead, verify=True, to_look_at=True
            )
        self.evaluations = {(e.name, e.rule): e for e in found}
        every = candidate_paths(self.anchors, self.windows)
        chosen = self._write_ranking(every)
        if self.job.mesh_check:
            try:
                self._compare_meshes(jobs)
            except (ConvergenceError, MeshingError) as error:
                self.warn(f"The mesh uncertainty is not known: on the coarser mesh, {error.what}.")
            chosen = self._write_ranking(every)
        return chosen

    def solve_candidates(
        self,
        mesh: Mesh,
        trajectory: Trajectory,
        jobs: list[tuple[Candidate, str]],
        under_way: CandidateSolver | None = None,
        verify: bool = False,
        to_look_at: bool = False,
    ) -> list[Evaluation]:
        """Evaluation of every (candidate, rule) on a mesh against its Model A; see `sweeping`.

        to_look_at: also keep the paths' motion; of the study's own mesh or the whole body's.
        """
        if self.job.in_time:
            self.context.summary.setdefault("sweep", {})[f"{len(mesh.nodes)} nodes"] = {"along_paths": True}
            return evaluations(self.job, self.cache, mesh, trajectory, jobs, self.progress.update)
        whole = self.job.headline_rule if to_look_at else ""
        solver = under_way or CandidateSolver(
            self.job, self.cache, mesh, jobs, trajectory.pressure_kPa, whole
        )
        with closing(solver):
            found = solver.evaluations(trajectory, self.progress.update, verify)
            if to_look_at:
                assert self.mesh is not None
                keep_motion(self.job, self.folder, self.mesh, mesh, trajectory, solver, jobs)
        if not solver.independent_of_path:
            self.warn(
                "A candidate started from Model A's states does not lie on its own equilibrium path from "
                f"rest (difference {solver.path_difference_mm:.2g} mm), so every candidate was solved from "
                "rest."
            )
        self.context.summary.setdefault("sweep", {})[f"{len(mesh.nodes)} nodes"] = {
            "pressures_solved_kPa": solver.solved_kPa,
            "relative_error_between": solver.error,
            "path_difference_mm": solver.path_difference_mm,
        }
        return found

    def _compare_meshes(self, jobs: list[tuple[Candidate, str]]) -> None:
        """Largest change of any path's J_hat on a coarser mesh, by rule.

        Both meshes are compared at the protocol's extreme pressures; the relative change of the deviation
        there stands for that of J_hat.
        """
        assert self.trajectory is not None
        coarse = attrs.evolve(self.job.mesh, refine=self.job.mesh.refine * COARSER)
        _, pressure = self.job.samples
        chosen = extremes(pressure)
        instants = [int(np.flatnonzero(pressure == p)[0]) for p in chosen]
        time = np.arange(len(chosen), dtype=float)
        if self.job.in_time:
            # The history of contact or wall is of the whole protocol.
            time, chosen = self.job.protocol.sample(self.job.times)
            instants = list(range(len(time)))
        with self.progress.stage("mesh check"):
            mesh = self._mesh(coarse)
            model = self.job.model(mesh)
            trajectory = self._model_a(model, time, chosen, lambda _: None)
            ratio: dict[str, list[float]] = {rule: [] for rule in self.job.rules}
            for found in self.solve_candidates(mesh, trajectory, jobs):
                fine = self.evaluations[found.name, found.rule].deviation
                same = fine.delta[instants].mean()
                # A sensor as soft as the lattice disturbs nothing, on any mesh.
                scale = fine.J_hat / same if same else 0.0
                ratio[found.rule].append(abs(found.deviation.J_hat - same) * scale)
        self.uncertainty_mm = {rule: max(values) for rule, values in ratio.items()}

    def _write_ranking(self, every: list[Candidate]) -> dict[str, str]:
        chosen, rows, arrays = {}, [], {}
        summary: dict[str, Any] = {"J_hat_mm": {}, "J_cont_mm": {}}
        for rule in self.job.rules:
            found = [self.evaluations[c.name, rule] for c in every]
            ranks = rank(np.array([e.deviation.J_hat for e in found]))
            chosen[rule] = found[int(np.argmin(ranks))].name
            for c, e, r in zip(every, found, ranks, strict=True):
                d = e.deviation
                rows.append((c.name, c.start, c.length, rule, f"{d.J_hat:.9g}", f"{d.J_cont:.9g}", int(r)))
            arrays[f"delta_{rule}_mm"] = np.array([e.deviation.delta for e in found])
            summary["J_hat_mm"][rule] = {e.name: e.deviation.J_hat for e in found}
            summary["J_cont_mm"][rule] = {e.name: e.deviation.J_cont for e in found}
        columns = ["path", "start", "length", "rule", "J_hat_mm", "J_cont_mm", "rank"]
        write_csv(self.folder / "deviation.csv", columns, rows)
        arrays |= {
            "path": np.array([c.name for c in every]),
            "time_s": self.job.samples[0],
            "pressure_kPa": self.job.supplied_kPa,
            "station": np.linspace(0, 1, self.job.stations),
        }
        write_npz(self.folder / "delta.npz", arrays)
        summary |= {"chosen": chosen, "mesh_uncertainty_mm": self.uncertainty_mm}
        summary["tied_with_chosen"] = {rule: self.tied(rule, chosen[rule]) for rule in self.job.rules}
        self.context.summary |= summary
        self.context.summary["warnings"] = self.warnings
        return chosen

    def tied(self, rule: str, chosen: str) -> list[str]:
        """Paths whose J_hat differs from the chosen one's by less than the mesh uncertainty."""
        J = {name: e.deviation.J_hat for (name, r), e in self.evaluations.items() if r == rule}
        limit = self.uncertainty_mm.get(rule, 0.0)
        return [name for name, value in J.items() if name != chosen and value - J[chosen] < limit]

    def _warn_of_another_cell(self) -> None:
        """Warn where the lattice's law was found for another cell than the unit's."""
        assert self.job.lattice is not None
        own = strut_cell(self.job.unit)
        values = {f.name: getattr(own, f.name) for f in attrs.fields(type(own))} | {"kind": own.kind.name}
        other = []
        for name, value in self.job.lattice.cell.items():
            mine = values.get(name, value)
            words = isinstance(value, str) or isinstance(mine, str)
            if value != mine and (words or not np.isclose(value, mine, rtol=1e-6)):
                other.append(f"{name} {value} (unit: {mine})")
        if other:
            self.warn(f"The lattice law was computed for another cell than the unit's: {', '.join(other)}.")

    def _warn_of_missed_corners(self) -> None:
        """Warn where uniform samples miss the protocol's extremes."""
        corners = self.job.protocol.pressure_kPa
        samples = self.job.supplied_kPa
        for extreme, met in ((corners.min(), samples.min()), (corners.max(), samples.max())):
            if abs(extreme - met) > 1e-6:
                self.warn(
                    f"The protocol goes to {extreme:g} kPa, but its {self.job.times} samples reach only "
                    f"{met:g} kPa: choose a number of samples that includes its extremes."
                )

    def warn(self, text: str) -> None:
        """Warn the user, now and in the report."""
        if text not in self.warnings:
            self.warnings.append(text)
            self.progress.warning(text)


def begin_study(job: Job, folder: Path, context: RunContext) -> None:
    """Make a folder a study's; results of other inputs are moved to stale/, never shown as current.

    Results there of a job of more stages from the same inputs are kept. Raises InputError, also where another
    process works in the folder, and OutputError.
    """
    context.lock_folder(folder)
    texts, current = job.texts_in(folder)
    if current:
        # Further stages of the same inputs make study.toml longer, and nothing stale.
        keep_inputs(folder, texts, NAME)
        context.summary = _earlier(folder) | context.summary
    begin(context, folder, LAYOUT, texts)


def _state(arrays: dict[str, Array]) -> State:
    """State in the cache."""
    return State(
        float(arrays["pressure_MPa"]),
        arrays["u"],
        float(arrays["residual"]),
        int(arrays["iterations"]),
        int(arrays["factorisations"]),
        float(arrays.get("snapped_mm", 0.0)),
    )


def extremes(pressure_kPa: Array) -> Array:
    """Extreme pressures of a protocol, ascending, without 0."""
    found = np.unique([pressure_kPa.min(), pressure_kPa.max()])
    return found[found != 0]


def _earlier(folder: Path) -> dict[str, Any]:
    """Figures of a folder's last run, if this version of the program computed them."""
    try:
        found = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    except (OSError, InputError):
        return {}
    if not isinstance(found, dict) or found.get("versions") != package_versions():
        return {}
    return {name: value for name, value in found.items() if name not in ("status", "reason", "warnings")}


def _expected_nodes(job: Job) -> int:
    """Expected number of a mesh's nodes, from mu-1.0x: 18 500 at a refinement of 1, 71 000 at 1.8."""
    share = {"half": 1.0, "full": 2.0}[job.mesh.fraction]
    of_order = {1: 0.15, 2: 1.0}[job.mesh.order]
    units = job.unit.dimensions.count / 6
    return int(share * of_order * units * (4_000 + 17_000 * job.mesh.refine**2.3))
