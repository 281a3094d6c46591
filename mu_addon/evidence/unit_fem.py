"""The unit's responses for the evidence, from the finite-element model that designers use."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import cached_property, partial
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..body.printed_mesh import mesh_printed
from ..design.parameters import Unit
from ..design.quantity import in_kPa, in_MPa
from ..errors import ConvergenceError, InputError
from ..measured import Experiment
from ..measured.pose import Direction, X
from ..meshing.mesh import AXES
from ..meshing.settings import SELF_CONTACT, MeshSettings
from ..run.cache import Cache
from ..run.pool import each
from ..run.processes import cores
from .drawn import Designs, Surface, require_enough
from .effect import Parameter
from .effects import ON_UNITS
from .markers import Marker, attached
from .prediction import blocked_force, pressure_step, unit_pose
from .prediction.flat_obstacle import CONTACT, NEAREST, ObstacleResponse
from .prediction.unit_pressure import KIND, UnitResponse, Variant
from .unit_body import HELD, WALL, Body
from .unit_run import Result, Run, run

Progress = Callable[[str, float], None]

ANGLE, VOLUME, FORCE = "angle_deg", "volume_mm3", "force_N"
# Kinds of a unit that bends freely.
FREE = (KIND, pressure_step.KIND, unit_pose.KIND)
# Of the pressures' range: the most that a step to which its ends are rounded may be. The quarter of it that
# rounding may take away lies well within the margin. Steps are 1 and 5 times powers of ten.
ROUND = 0.06
# Fewer pressures make no cubic spline.
FEWEST = 4
DEFAULT = MeshSettings()
# The mesh of what effects change the unit by: of an angle the same share within 2 %.
OF_CHANGES = MeshSettings(refine=0.5)
# Of the largest change of a value: below it, two meshes are not compared by their ratio.
LEAST_CHANGE = 0.05
# Share of the progress for walls.
CONTACT_SHARE = 0.2
# Walls as shares of how far the free unit gets, pressures as shares of the way on from where one is met.
REACHES = (0.2, 0.5, NEAREST)
FIRST_REACHES = (0.5,)
SHARES = (0.15, 0.4, 0.7, 1.0)
# Of the way from the mesh of changes to the model's, how much farther the answer may lie: a third of it by
# the order of the elements. In suction, where walls close, it is another at each pressure.
FARTHER, UNEVEN = 0.5, 0.25
KNOWN = tuple(name for name, e in ON_UNITS.items() if e.of != HELD)
OF_HELD = tuple(name for name, e in ON_UNITS.items() if e.of == HELD)
# A second code with another mesh and another volumetric law, the same unit: its angles are ours at pressures
# changed by 0.047 of the largest one times the square of their share of it.
DISCREPANCY = 0.04


Shown = Callable[[Result], Array]


class UnitResponseWarning(UserWarning):
    """A part of the unit's response that could not be computed and is left out."""


@attrs.frozen
class UnitSettings:
    """Settings of the unit's simulation for the evidence.

    mesh: the model's; changes: a coarser one for effects and walls, whose changes of the response are
    transferred in proportion. The difference of these two is then fitted with every hypothesis (`FARTHER`).
    pressures: their approximate number; margin: beyond the measured ones, as a share of their range. effects:
    names of those to run; whole: those run at every size, None for all; the others are run and trusted at
    `UnitEffect.first` alone. distal: chambers behind a clog. farthest_mm: of a marker from the unit, at scale
    1. discrepancy: of the response, as in `UnitResponse`. self_contact: of walls and struts. designs: units
    that differ in what nobody measured, which is then fitted beside every hypothesis, None without any.
    workers: processes, one a core.
    """

    mesh: MeshSettings = DEFAULT
    changes: MeshSettings = OF_CHANGES
    pressures: int = 12
    margin: float = 0.05
    effects: tuple[str, ...] = KNOWN
    whole: frozenset[str] | None = frozenset()
    distal: int = 1
    farthest_mm: float = 4.0
    discrepancy: float = DISCREPANCY
    self_contact: bool = SELF_CONTACT.field()
    designs: Designs | None = None
    workers: int = attrs.field(factory=cores)

    def further(self, names: Collection[str]) -> UnitSettings | None:
        """With some effects also at the remaining sizes; None where all are."""
        more = frozenset({*ON_UNITS}.intersection(names))
        if self.whole is None or more <= self.whole:
            return None
        return attrs.evolve(self, whole=self.whole | more)

    def __attrs_post_init__(self) -> None:
        for name in self.effects:
            if name not in KNOWN:
                raise InputError(
                    f"the model of the unit has no effect {name!r}",
                    "unit settings",
                    f"known: {', '.join(KNOWN)}",
                )
        if self.pressures < FEWEST or self.workers < 1:
            raise InputError(
                f"{self.pressures} pressures or {self.workers} workers are too few",
                "unit settings",
                f"give {FEWEST} pressures and 1 worker at least",
            )


def pressures(readings_kPa: Array, count: int, margin: float) -> tuple[float, ...]:
    """About `count` pressures in kPa, ascending through 0, from a little below the readings to above.

    margin: beyond the readings, as a share of their range. Raises InputError where all readings are 0.

    >>> pressures(np.array([0.02, 29.98]), 4, 0.05) == pressures(np.array([-0.02, 30.02]), 4, 0.05)
    True
    >>> pressures(np.array([-25.0, 12.46]), 4, 0.05) == pressures(np.array([-25.0, 12.54]), 4, 0.05)
    True
    """
    low, high = min(0.0, float(np.min(readings_kPa))), max(0.0, float(np.max(readings_kPa)))
    if low == high:
        raise InputError("the pressure is always 0", "unit_pressure", "add an experiment under pressure")
    # A gauge's noise moves the ends of a protocol to either side of a round number: its runs stay the same.
    whole = 10.0 ** math.floor(math.log10(ROUND * (high - low)))
    step = 5.0 * whole if 5.0 * whole <= ROUND * (high - low) else whole
    # Protocols end at steps and half way between them: both far from a quarter, where rounding changes.
    low, high = (math.copysign(step * math.floor(abs(end) / step + 0.75), end) for end in (low, high))
    beyond = margin * (high - low)
    low, high = _outward(low, -beyond), _outward(high, beyond)
    below = int(np.clip(round((count - 1) * low / (low - high)), 1, count - 2))
    sides = np.linspace(low, 0.0, below + 1), np.linspace(0.0, high, count - below)
    return tuple(np.concatenate([sides[0][:-1], sides[1]]).tolist())


def _outward(end: float, margin: float) -> float:
    """The end plus the margin, in two digits, so that a longer record finds the same runs.

    In three where two would take most of the margin, as 105 becomes 100.
    """
    found = float(f"{end + margin:.2g}")
    return found if abs(found) > abs(end + margin / 2) else float(f"{end + margin:.3g}")


def unit_responses(
    unit: Unit,
    experiments: Sequence[Experiment],
    settings: UnitSettings | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    held: bool = False,
) -> tuple[UnitResponse, ...]:
    """Response of the freely bending unit at each scale and orientation of the experiments given.

    Of unit_pose experiments those are the `unit_pose.STATIONS` about their axis. held: instead the force in N
    on a load cell that holds the tip, of blocked_force experiments, at each scale, gap and orientation; a
    unit of s times the size presses with s^2 times the force at the same pressures.

    The unit keeps its moduli at every scale, as proportional scaling has it. Its runs are kept in the folder
    `cache` and found again there, also by another call; `progress` is called with a text and the share done.
    Sizes of an effect that cannot be computed are left out with a UnitResponseWarning, and so are pressures
    that the base model does not reach. Raises InputError for markers out of place (`attached`) and added
    masses, which the model lacks, and ConvergenceError where the base model reaches too few pressures.
    """
    settings = settings or UnitSettings()
    if held:
        settings = attrs.evolve(settings, effects=tuple(n for n in settings.effects if n != CONTACT))
    chosen = [e for e in experiments if e.kind in ((blocked_force.KIND,) if held else FREE)]
    report = progress or (lambda stage, share: None)
    for e in chosen:
        if e.added_mass_g:
            raise InputError("the model of the unit has no added mass", e.name, "leave the experiment out")
    setups = sorted({(e.scale, _gap(e)) for e in chosen}, key=repr)
    found: dict[str, Result] = {}
    plans = [_Plan.of(unit, chosen, *setup, settings, cache, found) for setup in setups]
    for plan in plans:
        for m in plan.markers:
            report(f"marker {m.number} at {plan.scale:g}x lies {m.distance_mm:.2f} mm from its point", 0.0)
    # What runs of effects start from comes before all of them: the same digits on any number of cores.
    starts = {plan.case().key(): plan.case() for plan in plans}
    cases = starts | {case.key(): case for plan in plans for case in plan.runs()}
    of_walls = CONTACT_SHARE if CONTACT in settings.effects else 0.0

    def solve(cases: dict[str, Run], begin: float, part: float, alone: int = 0) -> None:
        def of_all(what: str, share: float) -> None:
            report(what, begin + part * share)

        _solve(found, cases, settings.workers, cache, of_all, alone)

    solve(cases, 0.0, 1.0 - of_walls, len(starts))
    if of_walls:
        solve({c.key(): c for plan in plans for _, _, c in plan.walls()}, 1.0 - of_walls, of_walls)
    responses = _counted_alike([r for plan in plans for r in plan.responses()])
    # A request for the channels of all uses the first.
    return tuple(sorted(responses, key=lambda r: -len(r.channels)))


def _gap(e: Experiment) -> float | None:
    return e.gap_mm if e.kind == blocked_force.KIND else None


def _orientations(experiments: Sequence[Experiment]) -> tuple[tuple[float, Direction], ...]:
    """Orientations to simulate, in degrees about an axis, each once."""
    found: set[tuple[float, Direction]] = set()
    for e in experiments:
        at = unit_pose.STATIONS if e.kind == unit_pose.KIND else (e.orientation_deg,)
        found |= {(deg % 360.0, e.orientation_axis) for deg in at}
    return tuple(sorted(found))


def _counted_alike(responses: Sequence[UnitResponse]) -> list[UnitResponse]:
    """The responses with a wall's reach counted from the farthest motion of the free unit in any of them."""
    farthest: dict[int, float] = {}
    for r in responses:
        for s, side in r.walls.items():
            farthest[s] = max(farthest.get(s, 0.0), side.farthest_mm)

    def counted(r: UnitResponse) -> dict[int, ObstacleResponse]:
        spare = {s: farthest[s] - side.farthest_mm for s, side in r.walls.items()}
        return {s: attrs.evolve(side, spare_mm=spare[s]) for s, side in r.walls.items()}

    return [attrs.evolve(r, walls=counted(r)) for r in responses]


def similar(unit: Unit) -> Unit:
    """The unit at 1.0x that moves as this one does, all lengths scaled; this one if that cannot be drawn.

    An elastic body has no intrinsic length: enlarged as a whole, at the same pressures and moduli, it rotates
    by the same angles. The print's offsets and skin depth in mm do not grow with the unit, so here they are
    divided by its scale.
    """
    p, s = unit.print, unit.scale
    lengths = {"offset_xy_mm": p.offset_xy_mm, "offset_z_mm": p.offset_z_mm, "skin_depth_mm": p.skin_depth_mm}
    try:
        return unit.evolve(scale=1.0, **{name: length / s for name, length in lengths.items()})
    except InputError:
        return unit


@attrs.frozen
class _Plan:
    """Runs for one scale: `body`, similar to the unit, which is `enlarged` times as large.

    readings_kPa: the least and the greatest. measured: columns with readings. found: results by key of runs.
    """

    body: Body
    settings: UnitSettings
    scale: float
    enlarged: float
    orientations: tuple[tuple[float, Direction], ...]
    pressures_kPa: tuple[float, ...]
    readings_kPa: tuple[float, float]
    markers: tuple[Marker, ...]
    measured: frozenset[str]
    found: dict[str, Result] = attrs.field(factory=dict)

    @classmethod
    def of(
        cls,
        unit: Unit,
        chosen: Sequence[Experiment],
        scale: float,
        gap_mm: float | None,
        settings: UnitSettings,
        cache: Path | None,
        found: dict[str, Result],
    ) -> _Plan:
        here = [e for e in chosen if (e.scale, _gap(e)) == (scale, gap_mm)]
        scaled = attrs.evolve(unit, scale=scale)
        readings = np.concatenate([e["pressure_kPa"] for e in here])
        mesh = mesh_printed(scaled, settings.mesh, cache=cache)
        reduced = similar(scaled)
        enlarged = scale / reduced.scale
        gap, touching = None if gap_mm is None else gap_mm / enlarged, settings.self_contact
        return cls(
            Body(reduced, settings.mesh, settings.distal, gap_mm=gap, self_contact=touching),
            settings,
            scale,
            enlarged,
            _orientations(here),
            pressures(readings, settings.pressures, settings.margin),
            (float(readings.min()), float(readings.max())),
            attached(mesh, here, settings.farthest_mm * scale),
            frozenset(c for e in here for c, values in e.columns.items() if np.isfinite(values).any()),
            found,
        )

    @property
    def held(self) -> bool:
        """True if a load cell holds the tip."""
        return self.body.gap_mm is not None

    @property
    def rows(self) -> tuple[str, ...]:
        """Channels of a result's rows, those of the outline apart."""
        places = (f"marker{m.number}_{a}_mm" for m in self.markers for a in AXES)
        return (FORCE,) if self.held else (ANGLE, VOLUME, *places)

    @property
    def names(self) -> list[str]:
        """Effects that have runs, walls apart."""
        own = [n for n in self.settings.effects if ON_UNITS[n].of != WALL]
        return [*own, *(OF_HELD if self.held else ())]

    def case(
        self, effect: str = "", size: float = 0.0, orientation: tuple[float, Direction] = (0.0, X)
    ) -> Run:
        """A run of an effect whose size is that at 1.0x, of the reference where none is named.

        The reference's outline is always kept, so that one run serves with and without walls.
        """
        points = tuple(tuple((m.point / self.enlarged).tolist()) for m in self.markers)
        turn, axis = orientation
        mesh = self.settings.changes
        body = attrs.evolve(self.body, mesh=mesh, orientation_deg=turn, orientation_axis=axis)
        outline = not effect and not self.held
        return Run(body, self.pressures_kPa, points, effect, size, outline)

    @property
    def base_case(self) -> Run:
        """The run of the base model."""
        return attrs.evolve(self.case(), body=self.body)

    def of_designs(self, designs: Designs) -> list[Run]:
        """A run of every design, on the mesh of changes, at this scale, as far as the readings go."""
        case, cases = self.case(), []
        steps = self._steps
        for unit in designs.units:
            body = attrs.evolve(case.body, unit=similar(attrs.evolve(unit, scale=self.scale)), other=True)
            other = attrs.evolve(case, body=body, pressures_kPa=steps, outline=False)
            cases.append(case if body.unit == case.body.unit else other)
        return cases

    @property
    def _steps(self) -> tuple[float, ...]:
        """Pressures in kPa of other designs, ascending through 0, to the ends of the readings.

        Those that a path visits anyway, by its largest steps: a state on the way costs nothing. Where nothing
        was read, to the base's end.
        """
        ends = pressures(np.array(self.readings_kPa), FEWEST, 0.0)
        newton = attrs.evolve(self.body, other=True).newton()
        sides = []
        for read, end in zip(
            (ends[0], ends[-1]), (self.pressures_kPa[0], self.pressures_kPa[-1]), strict=True
        ):
            step = in_kPa(newton.largest_step_MPa(in_MPa(end)))
            count = max(FEWEST - 1, math.ceil(abs(read) / step - 1e-9)) if read else 1
            sides.append(np.linspace(0.0, read or end, count + 1)[1:])
        return (*sides[0][::-1].tolist(), 0.0, *sides[1].tolist())

    def _of_design(self, case: Run, rows: Sequence[int], at: Array, coarse: Array) -> Array:
        """Channels (c, k) of another design at pressures (k,) in kPa, on the mesh of changes.

        coarse (c, k): the unit's on that mesh. Beyond the design's own pressures their difference grows in
        proportion to pressure: there it serves a softer resin alone, and a body that collapses costs most.
        """
        from scipy.interpolate import CubicSpline

        own = np.array(case.pressures_kPa)
        values = (self.larger * self.result(case).values)[rows]
        if not np.isfinite(values).all():
            return np.full_like(coarse, np.nan)
        change = CubicSpline(own, values - CubicSpline(at, coarse, axis=1)(own), axis=1)
        inside = np.clip(at, own[0], own[-1])
        grown = np.divide(at, inside, out=np.ones_like(at), where=inside != 0.0)
        return np.asarray(coarse + grown * change(inside))

    def surface(self, rows: Sequence[int], at: Array, base: Array, coarse: Array) -> Surface | None:
        """The response over the designs; those that do not reach a pressure are left out with a warning.

        rows: of the channels. base, coarse (c, k): the unit's at pressures (k,) in kPa, on both meshes.
        """
        designs = self.settings.designs
        if designs is None:
            return None
        places, values, rest = [], [], int(np.flatnonzero(at == 0.0)[0])
        for place, case in zip(designs.at, self.of_designs(designs), strict=True):
            response = base
            if case.body.other:
                response = taken_over(self._of_design(case, rows, at, coarse), coarse, base, rest)
            if np.isnan(response).any():
                pairs = zip(designs.parameters, place, strict=True)
                shape = ", ".join(f"{p.name} {v:g}" for p, v in pairs)
                _warn(f"{shape} at {self.scale:g}x is left out: {self.result(case).why}")
            else:
                places.append(place)
                values.append(response)
        require_enough(len(places), len(designs.parameters))
        return Surface(designs.parameters, np.array(places), np.array(values))

    def runs(self) -> Iterator[Run]:
        """First the runs that runs of effects start from, then the longest."""
        yield self.case()
        yield self.base_case
        if self.settings.designs:
            yield from self.of_designs(self.settings.designs)
        for name in sorted(set(self.names)):
            effect = ON_UNITS[name]
            for orientation in self.orientations if effect.has_gravity else ((0.0, X),):
                for size in self.sizes(name):
                    if size != effect.parameter.null:
                        yield self.case(name, size, orientation)

    def whole(self, name: str) -> bool:
        """True if an effect is run at every size."""
        return self.settings.whole is None or name in self.settings.whole

    def sizes(self, name: str) -> tuple[float, ...]:
        """Sizes of an effect that are run, its null among them."""
        effect = ON_UNITS[name]
        return (effect.sizes_at if self.whole(name) else effect.first_at)(self.enlarged)

    def result(self, case: Run) -> Result:
        """What was found by a run, without the unit's outline."""
        found = self.found[case.key()]
        return Result(found.values[: len(self.rows)], found.why)

    @cached_property
    def base(self) -> Result:
        """What the base model gives."""
        return self.result(self.base_case)

    @cached_property
    def coarse(self) -> Result:
        """That on the mesh of changes."""
        return self.result(self.case())

    def free(self) -> dict[int, tuple[Array, Array]]:
        """Pressures of the free unit from 0 on, and its outline's moves in mm, by side, 1 for +y."""
        outline = self.found[self.case().key()].values[-2:] * self.enlarged
        at = np.array(self.pressures_kPa)
        sides: dict[int, tuple[Array, Array]] = {}
        for sign in (1, -1):
            rows = np.flatnonzero((sign * at >= 0) & np.isfinite(outline[0]))
            rows = rows[np.argsort(sign * at[rows])]
            side = 1 if outline[0, rows[-1]] >= outline[1, rows[-1]] else -1
            outward = outline[0 if side > 0 else 1, rows]
            outward[0] = 0.0
            if len(rows) > 2 and (np.diff(outward) > 0).all() and side not in sides:
                sides[side] = at[rows], outward
        return sides

    def walls(self) -> Iterator[tuple[int, float, Run]]:
        """Side and reach in mm of each wall, and the unit's run against it."""
        from scipy.interpolate import PchipInterpolator

        for side, (pressure, outward) in self.free().items():
            for reach in REACHES if self.whole(CONTACT) else FIRST_REACHES:
                gap = (1 - reach) * outward[-1]
                met = float(PchipInterpolator(outward, pressure)(gap))
                steps = sorted(met + s * (pressure[-1] - met) for s in SHARES)
                case = self.case(CONTACT, side * gap / self.enlarged)
                yield side, reach * outward[-1], attrs.evolve(case, pressures_kPa=tuple(steps))

    def sides(self, rows: Sequence[int]) -> dict[int, ObstacleResponse]:
        """The response to walls by side, of the channels in these rows."""
        from scipy.interpolate import CubicSpline

        reached = np.isfinite(self.coarse.values[0])
        free = CubicSpline(
            np.array(self.pressures_kPa)[reached], (self.larger * self.coarse.values)[:, reached], axis=1
        )
        walls: dict[int, list[tuple[float, Array]]] = {}
        for side, reach, case in self.walls():
            result = self.found[case.key()]
            if not np.isfinite(result.values).all():
                _warn(f"a wall {reach:.3g} mm within reach at {self.scale:g}x is left out: {result.why}")
                continue
            change = self.larger * result.values - free(case.pressures_kPa)
            # In the order of shares: the pressures ascend, those below 0 toward rest.
            change = change[rows][:, :: 1 if case.pressures_kPa[-1] > 0 else -1].T
            walls.setdefault(side, []).append((reach, change))
        sides = self.free()
        return {
            side: ObstacleResponse(*sides[side], [r for r, _ in kept], SHARES, np.array([c for _, c in kept]))
            for side, kept in walls.items()
        }

    @property
    def larger(self) -> Array:
        """Factor on each row of a result: lengths grow with the unit, an angle does not."""
        if self.held:
            return np.array([[self.enlarged**2]])
        lengths = [self.enlarged] * (3 * len(self.markers))
        return np.array([1.0, self.enlarged**3, *lengths])[:, None]

    def responses(self) -> Iterator[UnitResponse]:
        """The response in each orientation."""
        every, why = np.array(self.pressures_kPa), self.base.why or self.coarse.why
        reached = np.isfinite(self.base.values[0] + self.coarse.values[0])
        if np.count_nonzero(reached) < FEWEST:
            raise ConvergenceError(
                f"the unit at {self.scale:g}x has an equilibrium at too few of the measured pressures: {why}",
                "unit_pressure",
                "check the unit's moduli and wall against the specimen's",
            )
        if not reached.all():
            missed = ", ".join(f"{p:g}" for p in every[~reached])
            _warn(f"The unit at {self.scale:g}x does not reach {missed} kPa: {why}")
        channels = tuple(c for c in self.rows if c in self.measured)
        rows = [self.rows.index(c) for c in channels]
        at, shown = self._shown(rows, reached)
        values = shown(self.base)
        walls = self.sides(rows) if CONTACT in self.settings.effects else {}
        coarse = shown(self.coarse)
        surface, errors = (
            self.surface(rows, at, values, coarse),
            self._mesh_errors(at, values, values - coarse),
        )
        gap = (self.body.gap_mm or 0.0) * self.enlarged
        for turn, axis in self.orientations:
            found = {n: self._variant(n, (turn, axis), shown) for n in self.names}
            variants = {n: v for n, v in found.items() if v is not None} | errors
            how = (self.scale, turn, axis, walls, self.settings.discrepancy, gap)
            yield UnitResponse(channels, at, values, variants, *how, surface)

    def _shown(self, rows: Sequence[int], reached: Array) -> tuple[Array, Shown]:
        """Pressures (k,) in kPa of the response, and a result's channels (c, k) there, nan if not reached.

        Those that were reached, and in suction those midway: there walls and struts touch one after the
        other, at pressures that differ between meshes by less than the interval of simulated pressures.
        """
        from scipy.interpolate import CubicSpline

        at = np.array(self.pressures_kPa)[reached]
        suction = at[at <= 0.0]
        more = np.sort(np.concatenate([at, (suction[1:] + suction[:-1]) / 2.0]))

        def shown(result: Result) -> Array:
            values = (self.larger * result.values)[np.ix_(np.array(rows), np.flatnonzero(reached))]
            if not np.isfinite(values).all():
                return np.full((len(rows), len(more)), np.nan)
            return np.asarray(CubicSpline(at, values, axis=-1)(more))

        return more, shown

    def _variant(self, name: str, orientation: tuple[float, Direction], shown: Shown) -> Variant | None:
        """The response to an effect at the sizes that could be computed; None where that is one alone."""
        effect = ON_UNITS[name]
        grown = self.enlarged**effect.length
        sizes, missed, values = [], [], []
        for size in self.sizes(name):
            result = self.base
            if size != effect.parameter.null:
                result = self._taken_over(self._continued(self.result(self.case(name, size, orientation))))
            response = shown(result)
            if np.isnan(response).any():
                missed.append(size * grown)
                _warn(f"{name} = {size * grown:g} at {self.scale:g}x is left out: {result.why}")
            else:
                sizes.append(size * grown)
                values.append(response)
        if len(sizes) < 2:
            return None
        # Beyond a size that was not, or could not be, computed the effect is unknown.
        missed += [size * grown for size in effect.sizes_at(self.enlarged) if size not in self.sizes(name)]
        low = sizes[0] if any(m < sizes[0] for m in missed) else -math.inf
        high = sizes[-1] if any(m > sizes[-1] for m in missed) else math.inf
        return Variant(effect.parameter.narrowed(low, high), np.array(sizes), np.array(values))

    def _continued(self, result: Result) -> Result:
        """The result, its changes extrapolated in proportion to pressure where it ends before the readings.

        There it serves gauges alone, and a body that collapses costs most.
        """
        at, values = np.array(self.pressures_kPa), result.values.copy()
        coarse, reached = self.coarse.values, np.isfinite(values[0])
        low, high = self.readings_kPa
        for beyond, last in ((at < low, reached.argmax()), (at > high, len(at) - 1 - reached[::-1].argmax())):
            rows = np.flatnonzero(beyond & ~reached)
            if len(rows) and at[last] and not (at[rows] * at[last] < 0).any():
                change = values[:, [last]] - coarse[:, [last]]
                values[:, rows] = coarse[:, rows] + change * at[rows] / at[last]
        return Result(values, result.why)

    def _taken_over(self, result: Result) -> Result:
        """The base's response with an effect, from its change of the coarser mesh's."""
        rest = self.pressures_kPa.index(0.0)
        return Result(taken_over(result.values, self.coarse.values, self.base.values, rest), result.why)

    def _mesh_errors(self, at: Array, base: Array, way: Array) -> dict[str, Variant]:
        """Errors of the model's mesh, everywhere and at each suction, at pressures (k,) in kPa.

        base (c, k): response of c channels; way (c, k): its change from the coarser mesh.
        """
        shares = {"mesh_share": (np.ones_like(at), FARTHER)}
        sucking = np.flatnonzero(at < 0)
        shares |= {f"mesh_share_{-at[i]:.3g}_kPa_below": (np.eye(len(at))[i], UNEVEN) for i in sucking}
        sizes, found = np.array([0.0, 1.0]), {}
        for name, (share, spread) in shares.items():
            name += "_held" * self.held
            most = 10.0 * spread
            p = Parameter(name, "", -most, most, 0.0, source="two meshes differ by 1", spread=spread)
            found[name] = Variant(p, sizes, np.array([base + size * share * way for size in sizes]))
        return found


def taken_over(changed: Array, coarse: Array, base: Array, rest: int) -> Array:
    """The base's values (c, k) with a change, from those of a coarser mesh with it and without, (c, k) each.

    In proportion to how far both move from rest, which differs by the meshes' errors. rest: the column
    without pressure.
    """
    far, near = (values - values[:, [rest]] for values in (base, coarse))
    least = (LEAST_CHANGE * np.nanmax(np.abs(near), axis=1, keepdims=True)) ** 2
    ratio = (far * near + least) / np.maximum(near**2 + least, np.finfo(float).tiny)
    return np.asarray(base + ratio * (changed - coarse))


def _warn(text: str) -> None:
    warnings.warn(text, UnitResponseWarning, stacklevel=4)


def _solve(
    found: dict[str, Result],
    cases: dict[str, Run],
    workers: int,
    cache: Path | None,
    report: Progress,
    alone: int = 0,
) -> None:
    """Add results by key, from the cache where they are there; what is computed is stored there at once.

    alone: how many of the cases, the first, are run before the others.
    """
    table = None if cache is None else Cache(cache)
    stored = {key: _stored(table, key, case) for key, case in cases.items() if table is not None}
    kept = {key: result for key, result in stored.items() if result is not None}
    found |= kept
    missing = [key for key in cases if key not in kept]
    # One run here first: it compiles the kernels for the other processes.
    done, first = len(kept), max(len({*missing}.intersection([*cases][:alone])), 0 if kept else 1)
    for keys, processes in ((missing[:first], 1), (missing[first:], workers)):
        tasks = [cases[key] for key in keys]
        for number, result in each(partial(run, cache=cache), tasks, processes, "unit_pressure"):
            key, case = keys[number], tasks[number]
            found[key] = result
            if table is not None:
                table.put("unit", key, {"values": result.values, "why": np.array(result.why)})
            what = f"{case.effect} = {case.size:g}" if case.effect else "base"
            done += 1
            report(f"unit, {what}", done / len(cases))


def _stored(table: Cache, key: str, case: Run) -> Result | None:
    """Stored result, or None where there is none that can be read completely."""
    kept = table.get("unit", key)
    if kept is None or not {"values", "why"} <= set(kept):
        return None
    shape = (case.rows, len(case.pressures_kPa))
    return Result(kept["values"], str(kept["why"])) if kept["values"].shape == shape else None
