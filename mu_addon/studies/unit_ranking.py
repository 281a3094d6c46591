"""A unit's design, motion and ranking of sensor paths, in one folder: `design`, `simulate` and `place`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Any

import attrs

from .. import design, fem, meshing, placement
from .. import simulate_and_place as core
from ..placement.settings import BEND, LONGEST, SHORTEST
from ..run.parts import Part, Sentence, Warn, recorded
from ..run.study import (
    Dropped,
    Growth,
    Input,
    Members,
    Node,
    Over,
    Tell,
    given,
    grown,
    intermediate,
    section,
    setting,
)
from ..sensing.optics import Optics
from ..simulate_and_place.settings import ALL_PATHS, CHECKS, MESH_CHECK, PATHS, QUICK, QUICK_REFINE, STATIONS
from .inputs import OnceInput
from .parameter_study.results import angles_of
from .unit_inputs import LIGHT, optics_of
from .unit_motion import UnitMotion, state_message, state_sought, timed, wants

COARSER = 0.7
"""Refinement of a coarser mesh, by which the mesh uncertainty of a ranking is estimated, over its own."""
PATHS_CHECKED = 3
"""The best paths, which the coarser mesh solves too: only paths near the best can be tied with it."""


_places, _by_pressure, _in_time = wants("place"), wants("place", in_time=False), wants("place", in_time=True)
_checks_by_pressure = wants("place", in_time=False, also="mesh_check")
_checks_in_time = wants("place", in_time=True, also="mesh_check")


def _searches(study: UnitStudy) -> bool:
    return "place" in study.stages and study.paths == "graph"


def _under_pressure(study: UnitStudy) -> list[float]:
    return [p for p in study.samples.distinct_kPa if p > 0.0]


def _way(study: UnitStudy, member: core.Member) -> Mapping[str, Any]:
    """Model A's states from rest to those that a candidate is solved at."""
    every = {p for pressure in member[1] for p in (study.samples.outward(pressure) or [pressure])}
    return {"states": [p for p in study.samples.distinct_kPa if p in every]}


def _number(study: UnitStudy, path: str) -> Mapping[str, Any]:
    """A candidate's number."""
    return {"number": study.path_names.index(path)}


def _at_pressures(study: UnitStudy, member: core.Member) -> Mapping[str, Any]:
    """A candidate's number, and the pressures in kPa that it is solved at together."""
    return {**_number(study, member[0]), "pressures_kPa": member[1]}


def _sought(study: UnitStudy, member: core.Member) -> str:
    return f"{member[0]} at {', '.join(f'{p:g}' for p in member[1])} kPa"


def _extremes(study: UnitStudy, ranking: core.Ranking) -> list[float]:
    found: list[float] = core.extremes(study.samples.pressure_kPa[ranking.compared]).tolist()
    return found


def _extremes_on_coarse(study: UnitStudy, motion: fem.Trajectory) -> Growth:
    # Model A reaches all pressures: candidates are likely to, and are not waited for.
    with suppress(Dropped):
        yield core.extremes(motion.pressure_kPa).tolist()
    yield _extremes(study, (yield "first_ranking"))


def _best_on_coarse(study: UnitStudy, likely_ranking: core.Ranking) -> Growth:
    def members(ranking: core.Ranking) -> list[core.Member]:
        return [(name, tuple(_extremes(study, ranking))) for name in ranking.best(PATHS_CHECKED)]

    with suppress(Dropped):
        yield members(likely_ranking)
    yield members((yield "first_ranking"))


def _best_in_time(study: UnitStudy, first_ranking: core.Ranking) -> Growth:
    yield first_ranking.best(PATHS_CHECKED)


def _remark(summary: Mapping[str, Any]) -> str:
    highest = [f"{angle:.1f}° at {p:g} kPa" for p, angle in [*angles_of(summary).items()][-1:]]
    return ", ".join([*filter(None, [summary.get("chosen")]), *highest])


def _solves(wanted: Callable[[UnitStudy], bool], **growing: Any) -> Any:
    """A stage of candidates at some pressures, each from Model A's states there."""

    def solved(
        self: None,
        number: int,
        pressures_kPa: tuple[float, ...],
        states: Members,
        waveguides: Any,
        stations: int,
    ) -> core.Solved:
        return core.solved(waveguides, number, pressures_kPa, states, stations)

    over = Over(("number", "pressures_kPa"), lambda study: [], _way, _at_pressures, **growing)
    words: Any = {"says": lambda found: core.words_on_solved(found), "doing": _sought}
    return timed("candidates", over=over, wanted=wanted, parallel=True, **words)(solved)


@attrs.frozen(kw_only=True, eq=False, slots=False)
class UnitStudy(UnitMotion):
    """A unit's printable solid, its motion without a sensor, and the ranking of sensor paths."""

    name = "place"
    commands = {
        "design": (
            "Generate the printable solid of a unit: STL file and lattice nodes.",
            "design --preset mu-1.0x --path alpha4 --out out/mu-1.0x",
        ),
        "simulate": (
            "Run `design`, then simulate the unit's motion under a pressure protocol: the stage Model A, "
            "without a sensor.",
            "simulate --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
        ),
        "place": (
            "Run `design` and `simulate`, then rank the sensor paths by how much each disturbs the motion of "
            "Model A, the unit without a sensor (the main job).",
            "place --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
        ),
    }
    files = {
        **UnitMotion.files,
        "deviation.csv": "deviation and rank of every path, its mesh uncertainty and ties",
        "delta.npz": "deviation over time and length of every path, mm",
        "sensitivity.vtu": "sensitivity of the deviation to the stiffness of each element, mm (ParaView)",
        "signals.csv": "light signal of each path, and its deviation",
        "paths.csv": "every path of the lattice: length, predicted and, where it was solved, exact deviation",
    }

    nodes = {
        "simulate": Node(
            "Simulate",
            "the unit's motion under a pressure protocol",
            (("study", "study", "the motion"),),
            _remark,
            label="Simulate",
            shown=(
                "unit",
                "body",
                "protocol",
                "mesh",
                "effects",
                "obstacles",
                "times",
                "self_contact",
                "self_friction",
            ),
        ),
        "place": Node(
            "Sensor",
            "sensor paths, ranked by how much each disturbs the motion",
            (("study", "study", "motion and ranking"),),
            _remark,
            label="Rank Paths",
            shown=("workers", "stations", "mesh_check", "all_paths", "paths", "checks"),
            continues="study",
            passes=("study", "the study passes on without a ranking"),
        ),
    }

    quick: bool = given(OnceInput(descriptions=(QUICK,), target="place"), default=QUICK.default)
    stations: int = setting(STATIONS, metavar="J", target="place")
    mesh_check: bool = setting(MESH_CHECK, target="place")
    all_paths: bool = setting(ALL_PATHS, decides=False, target="place")
    paths: str = setting(PATHS, target="place")
    optics: Optics = given(
        Input(
            "optics",
            (LIGHT,),
            many=True,
            metavar="NAME=VALUE",
            target="place",
            value=optics_of,
        ),
        factory=Optics,
    )
    shortest_cells: float = setting(SHORTEST, metavar="C", target="place")
    longest_cells: float = setting(LONGEST, metavar="C", target="place")
    bend_deg: float = setting(BEND, metavar="A", target="place")
    checks: int = setting(CHECKS, metavar="N", target="place")

    def refusals(self) -> Iterator[tuple[bool, str, str, str]]:
        """Pairs of settings that exclude each other, and a body that its paths leave."""
        yield from super().refusals()
        places = "place" in self.stages
        graph = places and self.paths == "graph"
        without, one = "the search of the whole lattice does not support", "leave one of them out"
        yield graph and bool(self.obstacles), f"{without} obstacles", "obstacles, paths", one
        yield graph and bool(self.self_friction), f"{without} friction", "--self-friction, --paths graph", one
        yield (
            graph and self.unit.wall.has_memory,
            f"{without} a wall with memory",
            "[wall], paths",
            "rank the windows of anchors, or use an elastic law",
        )
        clogged = graph and bool(self.effects.clogged)
        yield clogged, f"{without} a clogged chamber", "clogged_chamber, paths", one
        yield (
            graph and self.body is not None,
            "the search of the whole lattice supports only the default box of the lattice",
            "--body, --paths graph",
            one,
        )
        if places and self.body is not None and not graph:
            from ..design.body import require_path_inside

            for window in self.windows:
                require_path_inside(self.body, self.unit, window)

    def complete(self) -> UnitStudy:
        """The study as it is run: a quick one solves less, and its figures say what they leave out."""
        if not self.quick:
            return self
        mesh = attrs.evolve(self.mesh, refine=min(self.mesh.refine, QUICK_REFINE))
        return attrs.evolve(self, mesh=mesh, mesh_check=False, under_pressure=True, quick=False)

    def require_possible(self) -> None:
        """Raise InputError for what cannot be placed, before an hour's work and not after."""
        if "place" in self.stages:
            core.require_paths(self.unit, self.body, self.limits if self.paths == "graph" else None)

    def detail(self) -> str:
        """What its stages' seconds depend on."""
        from ..simulate_and_place.expected_seconds import Size

        return str(Size.of(self)) if "simulate" in self.stages else self.stages[-1]

    # What follows from the inputs.

    @property
    def windows(self) -> list[design.Window]:
        """Windows of anchors of the candidate paths."""
        return design.windows(self.unit.chambers.count)

    @property
    def path_names(self) -> tuple[str, ...]:
        """Names of the candidate paths."""
        return tuple(one.name for one in self.windows)

    @cached_property
    def candidate_paths(self) -> tuple[placement.Candidate, ...]:
        """The candidate paths."""
        return tuple(placement.candidate_paths(design.anchor_points(self.unit), self.windows))

    @property
    def compared(self) -> core.RankingSetup:
        """What candidates are compared at."""
        return core.RankingSetup(self.path_names, self.samples, self.effects.has_gravity)

    @property
    def limits(self) -> placement.Limits:
        """Limits of paths of the whole lattice."""
        return placement.Limits(self.shortest_cells, self.longest_cells, self.bend_deg)

    @property
    def contest(self) -> Any:
        """The paths whose deviation is to be known exactly: the best one, or those of the mesh check."""
        from ..placement.deviation_bounds import Contest

        return Contest(PATHS_CHECKED if self.mesh_check else 1, every=self.all_paths)

    @property
    def sensor(self) -> Any:
        """The waveguide's parameters."""
        return self.unit.waveguide

    @property
    def checked_as(self) -> meshing.MeshSettings:
        """Settings of the mesh of the mesh check."""
        settings = attrs.evolve(self.mesh, refine=self.mesh.refine * COARSER)
        return self.mechanics.mesh_settings(settings)

    # An estimate of the ranking.

    @timed(
        "Model A",
        over=Over(
            ("what",), lambda study: ["estimate"], needs=lambda study, _: {"states": _under_pressure(study)}
        ),
        wanted=lambda study: (
            _by_pressure(study) and len(study.candidate_paths) > 1 and bool(_under_pressure(study))
        ),
        parallel=True,
        says=lambda found: core.words_on_estimates(found),
    )
    def estimates(
        self,
        what: str,
        meshed: meshing.Mesh,
        mechanics: core.Mechanics,
        states: Members,
        samples: core.Samples,
        stations: int,
        sensor: Any,
    ) -> dict[str, float]:
        """Deviation of every path in mm, long before it is solved; none of an unstable unit."""
        return core.estimates(mechanics, meshed, list(states.values()), samples, stations)

    # Candidates by pressure.

    @intermediate()
    def waveguides(
        self, meshed: meshing.Mesh, mechanics: core.Mechanics, candidate_paths: Any, sensor: Any
    ) -> Any:
        """Solver of the candidates."""
        return core.waveguides_of(mechanics, meshed, candidate_paths)

    candidates = _solves(
        _by_pressure,
        grows=lambda study: core.solving(study.compared, study.contest, begin=True),
        most=lambda study: len(study.candidate_paths) + study.contest.best,
    )
    """All candidates at the first pressures, the most promising ones at all."""

    @intermediate()
    def begun(self, compared: core.RankingSetup, contest: Any, candidates: Members) -> core.Standing:
        """Where the candidates stand once the most promising ones are solved."""
        found: core.Standing = grown(core.solving(compared, contest, begin=True), candidates)
        return found

    contenders = _solves(
        _by_pressure,
        grows=lambda study, begun: core.solving(study.compared, study.contest, begun),
        most=lambda study: len(study.candidate_paths) - study.contest.best,
        after=("begun",),
    )
    """Candidates that may still be among the best, at what they lack."""

    @intermediate()
    def standing(
        self, compared: core.RankingSetup, contest: Any, begun: core.Standing, contenders: Members
    ) -> core.Standing:
        """Where the candidates stand once the contest is over."""
        found: core.Standing = grown(core.solving(compared, contest, begun), contenders)
        return found

    @timed(
        "candidates",
        over=Over(
            ("number", "pressures_kPa"),
            lambda study: [],
            gives=_at_pressures,
            grows=lambda study, begun: core.following(study.compared, begun),
            after=("begun",),
        ),
        wanted=_by_pressure,
        parallel=True,
        doing=lambda study, member: f"{_sought(study, member)}, from rest",
    )
    def followed(self, number: int, pressures_kPa: tuple[float, ...], waveguides: Any) -> core.Followed:
        """A candidate along its whole path from rest."""
        return core.followed(waveguides, number, pressures_kPa)

    @intermediate()
    def path_check(
        self, compared: core.RankingSetup, begun: core.Standing, followed: Members
    ) -> core.PathCheck:
        """Whether candidates from Model A's states end where their own paths do."""
        found: core.PathCheck = grown(core.following(compared, begun), followed)
        return found

    # Candidates where history acts.

    @timed(
        "candidates",
        over=Over(("number",), lambda study: study.path_names, gives=_number),
        wanted=_in_time,
        parallel=True,
    )
    def marched(self, number: int, waveguides: Any, samples: core.Samples) -> core.Array:
        """Anchors (k, p, 3) in mm of a candidate at each instant, as far as it has an equilibrium."""
        return core.marched(waveguides, number, samples)

    @intermediate(wanted=_by_pressure)
    def likely_ranking(
        self,
        motion: fem.Trajectory,
        compared: core.RankingSetup,
        mechanics: core.Mechanics,
        stations: int,
        begun: core.Standing,
    ) -> core.Ranking:
        """The ranking of the most promising candidates: most likely the best ones."""
        return core.ranked(motion, compared, mechanics, stations, begun, None, None)

    @intermediate(wanted=_places)
    def first_ranking(
        self,
        motion: fem.Trajectory,
        compared: core.RankingSetup,
        mechanics: core.Mechanics,
        stations: int,
        standing: core.Standing | None = None,
        path_check: core.PathCheck | None = None,
        marched: Members | None = None,
    ) -> core.Ranking:
        """The ranking as far as the contest goes, without its mesh uncertainty."""
        return core.ranked(motion, compared, mechanics, stations, standing, path_check, marched)

    # The mesh check.

    @timed(
        "mesh check",
        wanted=wants("place", also="mesh_check"),
        failing="The mesh uncertainty is not known: there is no coarser mesh",
        parallel=True,
    )
    def coarse_mesh(
        self,
        shape: design.Unit,
        has_memory: bool,
        checked_as: meshing.MeshSettings,
        body: design.Body | None,
        tell: Tell,
    ) -> meshing.Mesh:
        """A coarser analysis mesh."""
        from ..body import mesh_printed

        return mesh_printed(
            shape, checked_as, lambda _, share: tell(share), tell.cache, body, solid=has_memory
        )

    @intermediate()
    def coarse_equilibrium(self, coarse_mesh: meshing.Mesh, mechanics: core.Mechanics) -> fem.Equilibrium:
        """Solver of the unit without a sensor on the coarser mesh."""
        return mechanics.equilibrium(coarse_mesh)

    @intermediate()
    def coarse_waveguides(
        self, coarse_mesh: meshing.Mesh, mechanics: core.Mechanics, candidate_paths: Any, sensor: Any
    ) -> Any:
        """Solver of the candidates on the coarser mesh."""
        return core.waveguides_of(mechanics, coarse_mesh, candidate_paths)

    @timed(
        "mesh check",
        over=Over(("pressure_kPa",), lambda study: [], grows=_extremes_on_coarse, after=("motion",)),
        wanted=_checks_by_pressure,
        failing="The mesh uncertainty is not known at {pressure_kPa:g} kPa: on the coarser mesh",
        parallel=True,
        says=state_message,
        doing=state_sought,
    )
    def coarse_states(self, pressure_kPa: float, coarse_equilibrium: fem.Equilibrium) -> fem.State:
        """The state at an extreme pressure, from rest."""
        return core.state_after(coarse_equilibrium, pressure_kPa, [])

    @timed(
        "mesh check",
        over=Over(
            ("number", "pressures_kPa"),
            lambda study: [],
            lambda study, member: {"coarse_states": list(member[1])},
            _at_pressures,
            grows=_best_on_coarse,
            after=("likely_ranking",),
        ),
        wanted=_checks_by_pressure,
        parallel=True,
        says=lambda found: core.words_on_solved(found),
        doing=_sought,
    )
    def coarse_candidates(
        self,
        number: int,
        pressures_kPa: tuple[float, ...],
        coarse_states: Members,
        coarse_waveguides: Any,
        stations: int,
    ) -> core.Solved:
        """One of the best candidates at the extreme pressures that the coarser mesh reaches."""
        return core.solved(coarse_waveguides, number, [*coarse_states], coarse_states, stations, whole=False)

    @timed(
        "mesh check",
        wanted=_checks_in_time,
        failing="The mesh uncertainty is not known: on the coarser mesh",
        kept=False,
    )
    def coarse_instants(
        self,
        coarse_equilibrium: fem.Equilibrium,
        mechanics: core.Mechanics,
        samples: core.Samples,
        tell: Tell,
    ) -> core.InTime:
        """The motion instant by instant on the coarser mesh."""
        from ..run.cache import Cache

        found = core.solve_in_time(mechanics, coarse_equilibrium, samples, Cache(tell.cache), tell)
        if found.error is not None:
            raise found.error
        return found

    @timed(
        "mesh check",
        over=Over(
            ("number",), lambda study: [], gives=_number, grows=_best_in_time, after=("first_ranking",)
        ),
        wanted=_checks_in_time,
        failing="The mesh uncertainty is not known: on the coarser mesh",
        parallel=True,
    )
    def coarse_marched(self, number: int, coarse_waveguides: Any, samples: core.Samples) -> core.Array:
        """Anchors (k, p, 3) in mm of one of the best candidates at each instant on the coarser mesh."""
        return core.marched(coarse_waveguides, number, samples)

    @intermediate()
    def uncertainty(
        self,
        first_ranking: core.Ranking,
        samples: core.Samples,
        stations: int,
        anchors: Any,
        coarse_mesh: meshing.Mesh | None = None,
        coarse_candidates: Members | None = None,
        coarse_states: Members | None = None,
        coarse_instants: core.InTime | None = None,
        coarse_marched: Members | None = None,
    ) -> core.Uncertainty:
        """Mesh uncertainty of J_hat, if it is known."""
        return core.uncertainty(
            first_ranking,
            samples,
            stations,
            anchors,
            coarse_mesh,
            coarse_candidates,
            coarse_states,
            coarse_instants,
            coarse_marched,
        )

    let_in = _solves(
        _checks_by_pressure,
        grows=lambda study, *found: core.letting_in(study.compared, study.contest, *found),
        after=("standing", "path_check", "uncertainty"),
    )
    """Candidates that the mesh uncertainty does not tell from the best, at what they lack."""

    @intermediate()
    def last_standing(
        self,
        compared: core.RankingSetup,
        contest: Any,
        standing: core.Standing,
        path_check: core.PathCheck,
        uncertainty: core.Uncertainty,
        let_in: Members | None = None,
    ) -> core.Standing:
        """Where the candidates stand in the end."""
        if let_in is None:
            return standing
        found: core.Standing = grown(
            core.letting_in(compared, contest, standing, path_check, uncertainty), let_in
        )
        return found

    @intermediate()
    def ranking(
        self,
        motion: fem.Trajectory,
        compared: core.RankingSetup,
        mechanics: core.Mechanics,
        stations: int,
        first_ranking: core.Ranking,
        uncertainty: core.Uncertainty,
        last_standing: core.Standing | None = None,
        path_check: core.PathCheck | None = None,
    ) -> core.Ranking:
        """The ranking with its mesh uncertainty."""
        found = first_ranking
        if last_standing is not None:
            found = core.ranked(motion, compared, mechanics, stations, last_standing, path_check, None)
        return attrs.evolve(found, uncertainty_mm=uncertainty.value_mm)

    @intermediate()
    def chosen(self, ranking: core.Ranking) -> str:
        """Name of the path of least deviation."""
        return ranking.chosen

    # What is shown of the paths.

    @intermediate()
    def painter(self, meshed: meshing.Mesh, mechanics: core.Mechanics, states: Members) -> core.PathMotions:
        """What gives fields of a mesh's states, for display."""
        return core.PathMotions(mechanics, meshed, meshed, states)

    @timed(
        "motion of the paths",
        over=Over(("path",), lambda study: study.path_names),
        wanted=_by_pressure,
        kept=False,
    )
    def path_motions(
        self,
        path: str,
        painter: core.PathMotions,
        path_check: core.PathCheck,
        last_standing: core.Standing,
        candidates: Members,
        contenders: Members,
        let_in: Members | None = None,
    ) -> core.PathMotion:
        """Displacement, stress and stretch of the unit with a sensor, against Model A's."""
        if not path_check.independent or path in last_standing.at_least_mm:
            raise Dropped
        found = {**candidates, **contenders, **(let_in or {})}
        return painter.of(core.differences(path, found, last_standing))

    @timed("map", wanted=lambda study: _by_pressure(study) and not study.effects.clogged, parallel=True)
    def sensitivity(
        self, motion: fem.Trajectory, mechanics: core.Mechanics, stations: int
    ) -> core.Sensitivity:
        """How much stiffness anywhere in the unit disturbs its motion."""
        return core.sensitivity_map(mechanics, motion, stations)

    @timed("light", wanted=_by_pressure, failing="The light signal is not available", kept=False)
    def light(
        self,
        unit: design.Unit,
        optics: Optics,
        motion: fem.Trajectory,
        ranking: core.Ranking,
        mechanics: core.Mechanics,
        tell: Tell,
    ) -> core.Light:
        """The light signal along every path."""
        return core.lit(unit, optics, motion, ranking, mechanics, tell)

    # Every path of the lattice.

    @timed("ranking of the lattice's paths", wanted=_searches)
    def predicted(
        self,
        motion: fem.Trajectory,
        mechanics: core.Mechanics,
        limits: placement.Limits,
        stations: int,
        sensor: Any,
    ) -> core.Predicted:
        """Every path's deviation by a reduced response."""
        return core.predicted(mechanics, motion, limits, stations)

    @intermediate()
    def whole_motion(self, motion: fem.Trajectory) -> fem.Trajectory:
        """Model A's motion of the whole body: a path off the mirror plane needs both sides."""
        return core.whole_motion(motion)

    @timed(
        "check of the best paths",
        over=Over(
            ("number",),
            lambda study: [],
            grows=lambda study, predicted: core.checked_paths(predicted, study.checks),
            most=lambda study: 12,
            after=("predicted",),
        ),
        wanted=_searches,
        parallel=True,
    )
    def lattice_paths(
        self,
        number: int,
        whole_motion: fem.Trajectory,
        mechanics: core.Mechanics,
        limits: placement.Limits,
        compared: core.RankingSetup,
        stations: int,
        sensor: Any,
    ) -> core.CheckedPath:
        """A path of the lattice by the full model."""
        return core.check_path(number, whole_motion, mechanics, limits, compared, stations)

    @intermediate()
    def search(
        self,
        unit: design.Unit,
        limits: placement.Limits,
        predicted: core.Predicted,
        checks: int,
        lattice_paths: Members,
    ) -> core.SearchOutcome:
        """The search's outcome, and every path, the best first."""
        return core.search_of(unit, limits, predicted, checks, lattice_paths)

    @timed("motion of the best path", wanted=_searches, kept=False)
    def best_path_motion(
        self,
        search: core.SearchOutcome,
        meshed: meshing.Mesh,
        whole_motion: fem.Trajectory,
        mechanics: core.Mechanics,
        lattice_paths: Members,
    ) -> core.NamedMotion:
        """Displacement, stress and stretch of the unit with the lattice's best path."""
        return core.motion_of_best(search, meshed, whole_motion, mechanics, lattice_paths)

    # The printable unit.

    @timed("solid with the best path", wanted=_places, kept=False)
    def solid_best(
        self, unit: design.Unit, quality: str, body: design.Body | None, chosen: str
    ) -> design.Solid:
        """The printable unit with the chosen path's waveguide."""
        return design.build_solid(unit, design.window(unit, chosen), quality, body)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the unit."""
        title, unit = super().heading()
        return f"Sensor path for {self.unit.name}" if "place" in self.stages else title, unit

    @property
    def left_out(self) -> str:
        """What the figures of a quick ranking leave out, as text; empty for another study."""
        return core.left_out(self.tables)

    @section(order=-2)
    def answer(
        self,
        solid: design.Solid,
        first_ranking: core.Ranking | None = None,
        ranking: core.Ranking | None = None,
        motion: fem.Trajectory | None = None,
    ) -> Iterator[Part]:
        """The path to take, how certain it is, and the unit with it."""
        yield from core.answer_parts(self, solid, ranking or first_ranking, motion)

    @section("ranking", "Ranking of the paths", order=-1)
    def ranks(
        self,
        motion: fem.Trajectory,
        first_ranking: core.Ranking,
        ranking: core.Ranking | None = None,
        uncertainty: core.Uncertainty | None = None,
        standing: core.Standing | None = None,
        path_check: core.PathCheck | None = None,
    ) -> Iterator[Part]:
        """Every path's deviation."""
        yield from core.ranking_parts(self, ranking or first_ranking, motion)
        if standing is not None:
            yield recorded("sweep", core.sweep_figures(standing, path_check))
            yield from core.contest_doubts(standing, path_check)
        if uncertainty is not None:
            yield from core.uncertainty_doubts(uncertainty)

    @section("ranking", "Ranking of the paths", order=-1)
    def estimated(self, estimates: Members, first_ranking: core.Ranking | None = None) -> Iterator[Part]:
        """Estimates of the deviations, shown at once, and on the page as long as no path is solved."""
        for found in estimates.values():
            yield recorded(core.ESTIMATED, found)
            words = core.words_on_estimates(found)
            yield Sentence(words, terminal=first_ranking is None, page=False, found=True)
            if first_ranking is None:
                yield from core.estimate_parts(self, found)

    @section("search", "Search of the whole lattice", order=-1)
    def searched(
        self, search: core.SearchOutcome, predicted: core.Predicted, solid: design.Solid
    ) -> Iterator[Part]:
        """The best paths of the lattice."""
        yield from core.search_parts(self, solid, search, predicted)

    @section("light", "Light signal of the sensor", order=-1)
    def lit(self, light: core.Light, ranking: core.Ranking) -> Iterator[Part]:
        """The light along every path."""
        yield from core.light_parts(light, ranking)

    @section()
    def mapped(self, sensitivity: core.Sensitivity, meshed: meshing.Mesh) -> Iterator[Part]:
        """Files of the sensitivity map."""
        yield from core.sensitivity_parts(sensitivity, meshed)

    @section()
    def shown_motions(
        self, path_motions: Members, best_path_motion: core.NamedMotion | None = None
    ) -> Iterator[Part]:
        """Files of the paths' motion, for display."""
        yield from core.path_motion_parts(path_motions, best_path_motion)

    @section()
    def quickly(self) -> Iterator[Part]:
        """What the figures of a quick ranking leave out."""
        if self.left_out:
            yield recorded("left_out", self.left_out)

    @section()
    def without(self, first_ranking: core.Ranking) -> Iterator[Part]:
        """What a ranking does without."""
        if self.in_time:
            where = "With obstacles" if self.obstacles else "With a wall whose state depends on its history"
            yield Warn(
                f"{where} neither the sensitivity map nor the light signal is computed: both need a unit "
                "whose state depends on pressure only."
            )
        elif self.effects.clogged:
            yield Warn("The sensitivity map is not computed for a unit with a clogged neck.")

    @section("where", "Deviation of each path over length and time", order=1)
    def maps(self, first_ranking: core.Ranking, ranking: core.Ranking | None = None) -> Iterator[Part]:
        """A map for each path."""
        yield from core.heatmap_parts(ranking or first_ranking)

    @section("marginals", "Mean deviation along the unit and over time", order=1)
    def marginals(self, first_ranking: core.Ranking, ranking: core.Ranking | None = None) -> Iterator[Part]:
        """Means over time and over length."""
        yield from core.marginal_parts(self, ranking or first_ranking)
