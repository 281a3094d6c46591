"""Bend a printed unit under pressure, coarsely first and then finer, in a process that waits for changes.

Between two designs it keeps mesh, model and states, from which the next one starts. Without self-contact, so
for pressures above 0 only: suction closes walls.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterable
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..body.morph import PrintedMorph
from ..body.printed_mesh import mesh_printed
from ..design.dimensions import Dimensions
from ..design.quantity import in_kPa, in_MPa
from ..errors import ConvergenceError, InputError, MeshingError, MuError, OutputError
from ..fem.bending_angle import TipSection
from ..fem.equilibrium import Equilibrium
from ..fem.model import Model
from ..fem.moved_nodes import relocated
from ..fem.newton_settings import BODY_NEWTON, NewtonSettings
from ..fem.state import State, rest
from ..fem.trajectory import Trajectory
from ..files import write_json
from ..meshing.mesh import Mesh
from ..reading import file_bytes, parse_json
from ..report.motion_files import Surface, SurfaceFields, read_motion, surfaces_of, write_model_a
from ..studies.unit_ranking import UnitStudy as Study
from . import known
from .requests import ASKED, BENT, CELLS, LEVELS, REQUEST

RUNGS = 4
"""Number of pressures solved between 0 and the largest."""
NEWTON: NewtonSettings = attrs.evolve(
    BODY_NEWTON, tolerance=1e-6, max_step_MPa=0.02, easy_factorisations=12, follow_snaps=False
)
LOOK_S = 0.05
"""Interval in s at which a new request is looked for."""
RESTS_S = 4.0
"""Time in s without a new request before a finer level, whose mesh and model no request interrupts."""
_FAR = 0.5
"""Share of the largest displacement by which a state may differ from that of the design before."""


class _Superseded(Exception):
    """A newer request is there."""


@attrs.frozen(eq=False)
class _Watched:
    """A solver of linear systems that raises _Superseded where a newer request is there."""

    solver: Any
    look: Any

    def factor(self, values: Any) -> Any:
        self.look()
        return self.solver.factor(values)

    def solve(self, b: Any) -> Any:
        self.look()
        return self.solver.solve(b)


@attrs.frozen(eq=False, slots=False)
class _Drawn:
    """A mesh as it was made, its unit and its model, which those of similar units are moved from."""

    study: Study
    mesh: Mesh
    model: Model
    surfaces: dict[str, Surface]

    @cached_property
    def morph(self) -> PrintedMorph:
        """Morph that adapts the mesh to another design."""
        return PrintedMorph(self.mesh, self.study.unit, self.study.meshed_as)


@attrs.frozen(eq=False, slots=False)
class _Solved:
    """A unit on a new or morphed mesh: its states by pressure in kPa, and their fields."""

    study: Study
    drawn: _Drawn
    mesh: Mesh
    model: Model
    states: dict[float, State]
    fields: dict[float, dict[str, Any]] = attrs.Factory(dict)

    @cached_property
    def looked(self) -> SurfaceFields:
        """Fields of stress and stretch at the surfaces."""
        return SurfaceFields(self.mesh, {name: surface.node for name, surface in self.drawn.surfaces.items()})


class LiveBending:
    """Answers the requests of a folder, each by finer and finer shapes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._number = 0
        self._shape = 0
        self._levels: dict[float, _Solved] = {}
        self._seen: tuple[int, dict[str, Any]] = 0, {}
        self._answer: dict[str, Any] = {}

    def request(self) -> dict[str, Any]:
        """The latest request; empty before the first."""
        with suppress(OSError, InputError):
            changed = (self.folder / REQUEST).stat().st_mtime_ns
            if changed != self._seen[0]:
                self._seen = changed, parse_json(file_bytes(self.folder / REQUEST), REQUEST)
        return self._seen[1]

    def step(self) -> bool:
        """Answer the latest request until a newer one comes; return False if there is none."""
        request = self.request()
        number = int(request.get("number", 0))
        if number <= self._number:
            return False
        self._number = number
        try:
            study = Study.read(self.folder / ASKED / str(number))
            for refine, error in LEVELS:
                if refine != LEVELS[0][0]:
                    if study.body is None:
                        # Made before the next change asks for it.
                        _ = self._levels[LEVELS[0][0]].drawn.morph
                    self._rest()
                self._level(study, refine, error, float(request["pressure_kPa"]), bool(request["fields"]))
                if request["shapes"]:
                    with suppress(OutputError):
                        motion = read_motion(self.folder / self._answer["folder"])
                        known.keep(motion, self._answer, study.unit, Path(request["shapes"]))
        except _Superseded:
            pass
        except MuError as error:
            write_json(self.folder / BENT, {"number": number, "trouble": error.what})
        return True

    def _look(self) -> None:
        if int(self.request().get("number", 0)) != self._number:
            raise _Superseded

    def _rest(self) -> None:
        """Wait for a newer request."""
        until = time.monotonic() + RESTS_S
        while time.monotonic() < until:
            self._look()
            time.sleep(LOOK_S)

    def _level(self, study: Study, refine: float, error: float, first_kPa: float, fields: bool) -> None:
        """Bend the unit on a mesh of one refinement, the first pressure first, and report every state."""
        self._look()
        study = attrs.evolve(study, mesh=attrs.evolve(study.mesh, refine=refine))
        before = self._levels.get(refine)
        found = self._begun(study, before)
        old = {} if before is None else _carried_over(before, found)
        body = Equilibrium(found.model, study.mechanics.materials(found.mesh), NEWTON)
        first = round(first_kPa, 3)
        top = max(float(study.protocol.pressure_kPa.max()), first_kPa, 1.0)
        halfway = [first_kPa / 2.0] if first_kPa > in_kPa(NEWTON.max_step_MPa) and not old else []
        rungs = [*halfway, first_kPa, *(top * (k + 1) / RUNGS for k in range(RUNGS))]
        wanted = [p for p in dict.fromkeys(round(p, 3) for p in rungs) if p > 0.0]
        coarse, finished = refine == LEVELS[0][0], refine == LEVELS[-1][0]
        coloured = False
        for count, pressure in enumerate(wanted):
            found.states[pressure] = self._state(body, found, pressure, old)
            self._levels[refine] = found
            # A finer level replaces the one before as a whole.
            if not coarse and count + 1 < len(wanted):
                continue
            # A coarse shape comes before its colours, and later ones with them.
            if not fields or (coarse and not coloured):
                self._tell(found, error, finished)
            if fields and (coloured or first in found.states or first <= 0.0):
                self._colour(found)
                self._tell(found, error, finished)
                coloured = True

    def _begun(self, study: Study, before: _Solved | None) -> _Solved:
        """The study's mesh and model: those of a similar design before, moved to this one, or new."""
        if before is not None and study.body is None and before.study.body is None:
            drawn, unit = before.drawn, study.unit
            if study.effects == drawn.study.effects and _wall_alone_differs(
                drawn.study.unit.printed, unit.printed
            ):
                with suppress(MeshingError, InputError):
                    same = unit.printed == drawn.study.unit.printed
                    mesh = drawn.mesh if same else drawn.morph.to(unit)
                    model = relocated(drawn.model, mesh)
                    model.load = study.effects.load(unit, mesh, model.device)
                    return _Solved(study, drawn, mesh, model, {0.0: rest(mesh)})
        settings = study.meshed_as
        mesh = mesh_printed(study.unit, settings, cache=self.folder / CELLS, body=study.body)
        self._look()
        model = study.mechanics.model(mesh)
        model.factor = _Watched(model.factor, self._look)  # type: ignore[assignment]
        drawn = _Drawn(study, mesh, model, surfaces_of(mesh))
        return _Solved(study, drawn, mesh, model, {0.0: rest(mesh)})

    def _colour(self, found: _Solved) -> None:
        """Find the fields of the states that have none yet."""
        materials = found.study.mechanics.materials(found.mesh)
        for pressure, state in found.states.items():
            if pressure not in found.fields:
                self._look()
                found.fields[pressure] = found.looked.of_states([state.u], materials)

    def _state(self, body: Equilibrium, found: _Solved, pressure: float, old: dict[float, Array]) -> State:
        """The state at a pressure in kPa: from the design before if it is near, else from those below it."""
        if pressure in old:
            with suppress(ConvergenceError):
                far = _FAR * float(np.abs(old[pressure]).max())
                return body.newton(found.model.following(old[pressure].copy()), in_MPa(pressure), far)
        below = [found.states[p] for p in sorted(found.states) if p < pressure]
        return body.reach(in_MPa(pressure), below)

    def _tell(self, found: _Solved, error: float, finished: bool) -> None:
        """Write the states found so far, and the list of files to read."""
        self._shape += 1
        folder = self.folder / f"shape-{self._shape}"
        states = tuple(found.states[p] for p in sorted(found.states))
        kPa = np.array([state.pressure_kPa for state in states])
        tip = TipSection.of(found.mesh)
        motion = Trajectory(kPa, kPa, states, np.arange(len(states)), found.mesh)
        materials, fields = found.study.mechanics.materials(found.mesh), {}
        if found.fields.keys() >= found.states.keys():
            every = [found.fields[p] for p in sorted(found.states)]
            fields = {name: np.concatenate([one[name] for one in every]) for name in every[0]}
        surfaces = found.drawn.surfaces
        write_model_a(folder, found.mesh, materials, motion, fields=fields, surfaces=surfaces)
        angles = [[state.pressure_kPa, tip.angle_deg(state.u)] for state in states]
        self._answer = {"number": self._number, "folder": folder.name, "states": angles}
        self._answer |= {"error": error, "finished": finished, "trouble": ""}
        write_json(self.folder / BENT, self._answer)
        self._remove(f"shape-{k}" for k in (self._shape - 2,))
        self._remove(f"{ASKED}/{self._number - k}" for k in range(1, 4))

    def _remove(self, names: Iterable[str]) -> None:
        for name in names:
            shutil.rmtree(self.folder / name, ignore_errors=True)


def _carried_over(before: _Solved, found: _Solved) -> dict[float, Array]:
    """Displacements (n, 3) in mm by pressure of the design before, at the nodes of this one.

    Each node takes those of the nearest there, turns of beams those of turns; none between other numbers of
    chambers, which bend otherwise.
    """
    if before.mesh.nodes.shape == found.mesh.nodes.shape:
        return {pressure: state.u for pressure, state in before.states.items()}
    if before.study.unit.chambers.count != found.study.unit.chambers.count:
        return {}
    from scipy.spatial import cKDTree

    nearest = np.empty(len(found.mesh.nodes), int)
    turns, others = _turns(found.mesh), _turns(before.mesh)
    for turning in (True, False):
        there, here = np.flatnonzero(others == turning), np.flatnonzero(turns == turning)
        nearest[here] = there[cKDTree(before.mesh.nodes[there]).query(found.mesh.nodes[here])[1]]
    return {pressure: state.u[nearest] for pressure, state in before.states.items()}


def _turns(mesh: Mesh) -> Array:
    """True (n,) for the nodes whose displacements are rotation vectors of beams."""
    turns = np.zeros(len(mesh.nodes), bool)
    turns[mesh.beams[:, 1::2]] = True
    return turns


def _wall_alone_differs(a: Dimensions, b: Dimensions) -> bool:
    """Return True if two units differ in the wall's inner face alone: others have other nodes tied to it."""
    names = ("wall", "wall_factors", "base_cap", "tip_cap")
    return attrs.evolve(b, **{name: getattr(a, name) for name in names}) == a


def answer(folder: Path) -> None:
    """Answer the requests of a folder until this process is ended; raises MuError."""
    bending = LiveBending(folder)
    while True:
        if not bending.step():
            time.sleep(LOOK_S)
