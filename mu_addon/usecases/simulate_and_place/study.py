"""One study from a unit to a ranked sensor path, stage by stage, in one folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...body.lattice import strut_volume_mm3
from ...design.anchors import Window, anchor_points, windows
from ...design.quantity import in_MPa
from ...design.settings import USUAL_RESIN
from ...design.solid import Solid, build_solid
from ...design.stl_and_nodes import write_nodes, write_stl
from ...errors import ConvergenceError, InputError, MeshingError
from ...fem.bending_angle import TipSection
from ...fem.factor import IndefiniteError
from ...fem.model import Model
from ...fem.state import State, rest
from ...fem.trajectory import Trajectory
from ...files import write_csv
from ...materials.library import load_material
from ...meshing.mesh import Mesh
from ...meshing.quality import Quality, mesh_quality
from ...placement.candidates import Candidate, Evaluation, candidate_paths
from ...placement.elimination import Contest
from ...reading import file_bytes, parse_json
from ...report.motion_files import write_model_a
from ...report.results import CONTACT_COLUMNS, ContactHistory, LatticeSearch, Signals, nearest_to_break
from ...report.vtk import write_mesh, write_trajectory
from ...run.cache import Cache
from ...run.context import RunContext
from ...run.folder import begin, keep_inputs, require_space
from ...run.progress import Progress, within
from ...run.versions import package_versions
from .analysis_mesh import analysis_mesh
from .candidates_by_pressure import CandidateSolver, solve_candidates
from .expected import PATHS_CHECKED, SOLVING, expected_bytes, expected_nodes
from .job import Job
from .model_a import history_of_wall, solve_model_a
from .motion_checks import doubts_of_job, doubts_of_motion
from .motion_tables import Row, in_order, instants, write_motion, write_self_contact, write_stretch
from .path_estimate import estimated_J_mm
from .ranking import Ranking, extremes, mesh_change_mm
from .settings import STAGES
from .study_file import LAYOUT, NAME, left_out

Array = np.ndarray[Any, Any]

# Figures of summary.json by which a finished stage is recognised.
_FIGURE_OF_STAGE = {"design": "gates", "simulate": "angle_deg", "place": "chosen"}
# Refinement of a coarser mesh, to estimate the mesh uncertainty of a ranking.
COARSER = 0.7
ESTIMATED = "J_hat_estimated_mm"


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
    ranking: Ranking = attrs.field(factory=Ranking)
    warnings: list[str] = attrs.field(factory=list)
    contact: ContactHistory | None = None
    stretch: list[Row] = attrs.field(factory=list)
    self_contact: list[Row] = attrs.field(factory=list)
    search: LatticeSearch | None = None
    light: Signals | None = None
    estimated_mm: dict[str, float] = attrs.field(factory=dict)
    _estimates: bool = False
    _ahead: CandidateSolver | None = None

    @classmethod
    def open(cls, job: Job, folder: Path, context: RunContext) -> Study:
        """Open a study in a folder, which becomes its own (`begin_study`); InputError and OutputError."""
        begin_study(job, folder, context)
        return cls.begun(job, folder, context)

    @classmethod
    def begun(cls, job: Job, folder: Path, context: RunContext) -> Study:
        """A study in a folder that is already the run's; its inputs are in the summary.

        Raises OutputError if the disk has too little room.
        """
        study, summary = cls(job, folder, context), context.summary
        simulates = "simulate" in job.stages
        require_space(folder, expected_bytes(job, expected_nodes(job) if simulates else 0))
        summary["versions"] = package_versions()
        summary["parameters"] = attrs.asdict(job.unit)
        if job.body is not None:
            low, high = job.body.bounds.tolist()
            summary["body"] = {"low_mm": low, "high_mm": high, "triangles": len(job.body.triangles)}
        if simulates:
            summary["study"] = {"times": job.times, "stations": job.stations}
            summary["study"] |= {"mesh": attrs.asdict(job.mesh)}
            if job.effects:
                summary["study"] |= job.effects.tables
            if words := left_out(job.tables()):
                summary["left_out"] = words
            study.warn(*doubts_of_job(job))
        return study

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    @property
    def has_more(self) -> bool:
        """Return True if the folder has results of further stages than this job's, from the same inputs."""
        further = STAGES[len(self.job.stages) :]
        return any(_FIGURE_OF_STAGE[stage] in self.context.summary for stage in further)

    @property
    def solver(self) -> dict[str, Any]:
        """Figures of the solver of Model A; empty before it is solved."""
        found: dict[str, Any] = self.context.summary.get("solver", {}) if self.trajectory else {}
        return found

    @property
    def anchors(self) -> Array:
        """P1..Pn in mm, (n, 3)."""
        return anchor_points(self.job.unit)

    @property
    def windows(self) -> list[Window]:
        """The candidate paths' windows of anchors."""
        return windows(len(self.anchors))

    @property
    def candidates(self) -> list[Candidate]:
        """The candidate paths."""
        return candidate_paths(self.anchors, self.windows)

    @cached_property
    def _tip(self) -> TipSection:
        assert self.mesh is not None
        return TipSection.of(self.mesh)

    def bending_angle_deg(self, u: Array) -> float:
        """Bending angle in degrees of the study's mesh under displacements (n, 3) in mm."""
        return self._tip.angle_deg(u)

    def motion_in_order(self) -> tuple[Array, Array]:
        """Pressure (s,) in kPa and bending angle (s,) in degrees of the motion as far as it was computed.

        One state a pressure, ascending; one an instant where contact, the wall or an effect has history.
        """
        shown = in_order(self.job, self.trajectory.solved if self.trajectory else self.states)
        angles = [self.bending_angle_deg(s.u) for _, s in shown] if self.mesh is not None else []
        return np.array([p for p, _ in shown]), np.array(angles)

    def warn(self, *texts: str) -> None:
        """Warn the user, now and in the report."""
        for text in texts:
            if text not in self.warnings:
                self.warnings.append(text)
                self.context.summary["warnings"] = self.warnings
                self.progress.warning(text)

    # Stages, in the order they need each other.

    def design(self, window: Window | None = None, stage: str = "") -> Solid:
        """Printable solid, its STL and the lattice nodes; with a window, the unit with that waveguide."""
        name = "unit.stl" if window is None else f"unit_{window.name}.stl"
        with self.progress.stage(stage or (f"solid with {window.name}" if window else "solid")):
            solid = build_solid(self.job.unit, window, self.job.quality, self.job.body)
            write_stl(solid, self.folder / name)
            write_nodes(self.job.unit, self.folder / "anchors.txt")
        gates = {**attrs.asdict(solid.gates), "inner_volume_error": solid.gates.inner_volume_error}
        self.context.summary.setdefault("gates", {})[name] = gates
        if window is None:
            self.solid = solid
            resin = load_material(USUAL_RESIN)
            self.context.summary["solid"] = {
                "size_mm": np.ptp(solid.vertices, axis=0),
                "ml": solid.volume_mm3 / 1e3,
                "g": solid.mass_g(resin.density_g_per_ml),
                "resin": resin.name,
            }
        return solid

    def make_mesh(self) -> Mesh:
        """Make the analysis mesh and its quality."""
        job = self.job
        with self.progress.stage("mesh"):
            mesh = self.mesh = analysis_mesh(job, job.mesh, self.cache, self.progress.update)
            self.progress.made(f"{len(mesh.nodes)} nodes and {len(mesh.tets)} elements")
            require_space(self.folder, expected_bytes(job, len(mesh.nodes)))
            self.quality = mesh_quality(mesh, job.unit, strut_volume_mm3(job.unit, job.body))
            modulus, _ = job.materials(mesh).small_strain(len(mesh.tets))
            write_mesh(self.folder / "mesh.vtu", mesh, modulus)
        own = {"beams": len(mesh.beams), "hash": mesh.hash()}
        self.context.summary["mesh"] = {**attrs.asdict(self.quality), **own}
        return mesh

    def simulate(self, candidates_beside: bool = False) -> Trajectory:
        """Simulate Model A: the unit without a sensor through the pressure protocol.

        candidates_beside: let other processes solve the candidates as soon as a state is there.
        """
        assert self.mesh is not None
        job, samples, states = self.job, self.job.samples, SOLVING["Model A"]
        with self.progress.stage("Model A"):
            model = job.model(self.mesh)
            comparable = len(self.candidates) > 1 and not job.in_time
            self._estimates = candidates_beside and comparable
            if candidates_beside and job.workers > 1 and not job.in_time:
                self._ahead = CandidateSolver(
                    job, self.cache, self.mesh, self.candidates, samples[1], whole=True, contest=self.contest
                )
            try:
                self.trajectory, self.contact = solve_model_a(
                    job, self.cache, model, samples, within(self.progress.update, 0.0, states), self._reached
                )
            except BaseException:
                if self._ahead is not None:
                    self._ahead.close()
                self._keep_partial_motion()
                raise
            self._write_motion(model, self.trajectory)
        solved = [s for s in self.trajectory.solved if s.loaded]
        self.context.summary["solver"] = {
            "method": model.solver,
            "device": model.device,
            "unknowns": len(model.free),
            "states": len(solved),
            "newton_iterations": sum(s.iterations for s in solved),
            "factorisations": sum(s.factorisations for s in solved),
            "largest_relative_residual": max((s.residual for s in solved), default=0.0),
        }
        return self.trajectory

    def _reached(self, state: State) -> None:
        self.states.append(state)
        if not (self.job.in_time or self.job.effects.in_time):
            # At once, so that a killed run leaves its progress.
            angles = self.context.summary.setdefault("angle_deg", {})
            angles[f"{state.pressure_kPa:.6g}"] = self.bending_angle_deg(state.u)
        if self._ahead is not None:
            self._ahead.reached(state)
        highest = in_MPa(float(self.job.samples[1].max()))
        if self._estimates and state.pressure_MPa == highest > 0.0:
            self._estimate()

    def _estimate(self) -> None:
        """Estimate the paths' deviation from the states under pressure, long before they are solved."""
        assert self.mesh is not None
        under = [state for state in self.states if state.pressure_MPa > 0.0]
        try:
            found = estimated_J_mm(self.job, self.cache, self.mesh, under)
        except (InputError, IndefiniteError):
            # No response where Model A is unstable or the mesh is coarse: the paths are solved all the same.
            return
        self.estimated_mm = dict(sorted(found.items(), key=lambda one: one[1]))
        self.context.summary[ESTIMATED] = self.estimated_mm
        self.progress.finding(estimate_words(self.estimated_mm))
        self.progress.update(0.0, estimate_words(self.estimated_mm))

    def _keep_partial_motion(self) -> None:
        """Write the motion found before a failure; it is partial in summary.json."""
        if self.mesh is not None and self.states:
            start = [] if self.job.in_time or self.job.effects.has_gravity else [rest(self.mesh)]
            states = [*start, *self.states]
            self.context.summary["angle_deg"] = write_motion(self.folder, self.job, self.mesh, states)
            self._write_states(states)

    def _write_states(
        self, states: Sequence[State], cells: Callable[[State], dict[str, Array]] = lambda state: {}
    ) -> None:
        """Write model_a.pvd, the states for ParaView. cells: values (m,) of the elements in one, by name."""
        assert self.mesh is not None
        reached = [(t, s) for t, _, s in instants(self.job, states)]
        write_trajectory(self.folder / "model_a.pvd", self.mesh, reached, cells)

    def _write_motion(self, model: Model, trajectory: Trajectory) -> None:
        """Write the tables of a finished motion, and check it for doubtful results."""
        job, folder, mesh, states = self.job, self.folder, model.mesh, trajectory.solved
        summary = self.context.summary
        summary["angle_deg"] = write_motion(folder, job, mesh, states)
        if self.contact is not None:
            write_csv(folder / "contact.csv", CONTACT_COLUMNS, self.contact.rows())
            summary["contact"] = self.contact.summary()
        self.stretch = write_stretch(folder, job, model, states, self.cache.folder)
        summary["nearest_to_break"] = nearest_to_break(self.stretch)
        self.self_contact, touching_kPa = write_self_contact(folder, model, states)
        if job.self_friction and model.self_contact is not None:
            # Of the whole unit, as the forces are.
            lost = 2.0 ** len(mesh.symmetry) * model.self_contact.lost_mJ
            summary["self_friction"] = {"coefficient": job.self_friction, "lost_mJ": lost}
        remembered = history_of_wall(job, self.cache, model)
        supplied = attrs.evolve(trajectory, pressure_kPa=job.supplied_kPa)
        fields = write_model_a(folder, mesh, job.materials(mesh), supplied, remembered, touching_kPa)
        of_state = dict(zip(map(id, states), fields, strict=True))
        self._write_states(states, lambda state: of_state[id(state)])
        self.warn(*doubts_of_motion(job, mesh, states, summary))

    def place(self) -> str:
        """Compare every candidate with Model A; return the chosen path."""
        assert self.mesh is not None
        assert self.trajectory is not None
        with self.progress.stage("candidates"):
            self._rank(self.contest, self._ahead)
        self._write_ranking()
        if self.job.mesh_check:
            try:
                self._compare_meshes()
            except (ConvergenceError, InputError, MeshingError) as error:
                self.warn(f"The mesh uncertainty is not known: on the coarser mesh, {error.what}.")
            if self.ranking.may_be_tied:
                with self.progress.stage("candidates"):
                    self._rank(attrs.evolve(self.contest, margin_mm=self.ranking.uncertainty_mm or 0.0))
            self._write_ranking()
        return self.ranking.chosen

    @property
    def contest(self) -> Contest:
        """The paths whose deviation is to be known exactly: the best one, or those of the mesh check."""
        return Contest(PATHS_CHECKED if self.job.mesh_check else 1, every=self.job.all_paths)

    def _rank(self, contest: Contest, under_way: CandidateSolver | None = None) -> None:
        """Solve the candidates as far as a contest needs; the ranking keeps its mesh uncertainty."""
        assert self.mesh is not None
        assert self.trajectory is not None
        found, at_least_mm = self.solve_candidates(
            self.mesh,
            self.trajectory,
            self.candidates,
            under_way,
            verify=True,
            to_look_at=True,
            contest=contest,
        )
        self.ranking = Ranking({e.name: e for e in found}, self.ranking.uncertainty_mm, at_least_mm)

    def _write_ranking(self) -> None:
        self.context.summary |= self.ranking.write(self.folder, self.job, self.candidates)

    def solve_candidates(
        self,
        mesh: Mesh,
        trajectory: Trajectory,
        candidates: Sequence[Candidate],
        under_way: CandidateSolver | None = None,
        verify: bool = False,
        to_look_at: bool = False,
        done: float = 0.0,
        contest: Contest | None = None,
    ) -> tuple[list[Evaluation], dict[str, float]]:
        """Evaluation of candidates on a mesh against its Model A; see `candidates_by_pressure`.

        And lower bounds of J_hat in mm, by name, of those that a contest does without.

        to_look_at: also keep the paths' motion; of the study's own mesh or the whole body's. done: share of
        the stage that is done before.
        """
        assert self.mesh is not None
        shown = (self.folder, self.mesh) if to_look_at else None
        update = within(self.progress.update, done, 1.0)
        solving = SOLVING["candidates"] if shown else 1.0
        found, figures = solve_candidates(
            self.job,
            self.cache,
            mesh,
            trajectory,
            candidates,
            update,
            solving,
            under_way,
            verify,
            shown,
            contest,
        )
        at_least_mm = figures.pop("at_least_mm", {})
        self.warn(*(f"No deviation is known of {path}." for path in figures.pop("ended", ())))
        if not figures.pop("independent_of_path", True):
            self.warn(
                "A candidate started from Model A's states does not lie on its own equilibrium path from "
                f"rest (difference {figures['path_difference_mm']:.2g} mm), so every candidate was solved "
                "from rest."
            )
        paths = "Paths" if mesh is self.mesh else "On the coarser mesh, paths"
        self.warn(*(f"{paths} are not compared {where}." for where in figures["not_reached"]))
        self.context.summary.setdefault("sweep", {})[f"{len(mesh.nodes)} nodes"] = figures
        return found, at_least_mm

    def _compare_meshes(self) -> None:
        """Find the ranking's mesh uncertainty: both meshes at the protocol's extreme pressures.

        Of the best `PATHS_CHECKED` paths.
        """
        job, pressure = self.job, self.job.samples[1]
        coarse = attrs.evolve(job.mesh, refine=job.mesh.refine * COARSER)
        chosen = extremes(pressure[self.ranking.compared])
        instants = [int(np.flatnonzero(pressure == p)[0]) for p in chosen]
        samples = np.arange(len(chosen), dtype=float), chosen
        if job.in_time:
            # The history of contact or wall is of the whole protocol.
            samples = job.driven.sample(job.times)
            instants = list(range(job.times))
        checked = self.ranking.best(self.candidates, PATHS_CHECKED)
        with self.progress.stage("mesh check"):
            meshing, moving = 0.04, 0.5
            update = self.progress.update
            mesh = analysis_mesh(job, coarse, self.cache, within(update, 0.0, meshing))
            model = job.model(mesh)
            trajectory, _ = solve_model_a(job, self.cache, model, samples, within(update, meshing, moving))
            found, _ = self.solve_candidates(mesh, trajectory, checked, done=moving)
        self.ranking.uncertainty_mm = mesh_change_mm(self.ranking.evaluations, found, instants)


def estimate_words(J_mm: Mapping[str, float]) -> str:
    """One line on estimates of J_hat in mm by path, the least first."""
    found = ", ".join(f"{name} {value:.2f}" for name, value in J_mm.items())
    return f"estimated mean deviation [mm]: {found}"


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


def _earlier(folder: Path) -> dict[str, Any]:
    """Figures of a folder's last run, if this version of the program computed them."""
    try:
        found = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    except (OSError, InputError):
        return {}
    if not isinstance(found, dict) or found.get("versions") != package_versions():
        return {}
    return {name: value for name, value in found.items() if name not in ("status", "reason", "warnings")}
