"""The runs of a unit that measured data ask for, at one scale."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..body.printed_mesh import mesh_printed
from ..design.parameters import Unit
from ..design.quantity import in_kPa, in_MPa
from ..errors import InputError
from ..measured import Experiment
from ..measured.pose import Direction, X
from ..meshing.mesh import AXES
from .drawn import Designs
from .effects import ON_UNITS
from .markers import Marker, attached
from .prediction import blocked_force, unit_pose
from .prediction.flat_obstacle import CONTACT, NEAREST
from .unit_body import HELD, WALL, Body
from .unit_run import Result, Run
from .unit_settings import FEWEST, UnitSettings, pressures

ANGLE, VOLUME, FORCE = "angle_deg", "volume_mm3", "force_N"
# Walls as shares of how far the free unit gets, pressures as shares of the way on from where one is met.
REACHES = (0.2, 0.5, NEAREST)
FIRST_REACHES = (0.5,)
SHARES = (0.15, 0.4, 0.7, 1.0)
OF_HELD = tuple(name for name, e in ON_UNITS.items() if e.of == HELD)


def gap_of(e: Experiment) -> float | None:
    """From the tip at rest to the load cell that holds it, in mm; None of an experiment with a free tip."""
    return e.gap_mm if e.kind == blocked_force.KIND else None


def _orientations(experiments: Sequence[Experiment]) -> tuple[tuple[float, Direction], ...]:
    """Orientations to simulate, in degrees about an axis, each once."""
    found: set[tuple[float, Direction]] = set()
    for e in experiments:
        at = unit_pose.STATIONS if e.kind == unit_pose.KIND else (e.orientation_deg,)
        found |= {(deg % 360.0, e.orientation_axis) for deg in at}
    return tuple(sorted(found))


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
class UnitPlan:
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
    ) -> UnitPlan:
        """The runs of the chosen experiments at one scale and gap in mm, on a mesh in the folder `cache`."""
        here = [e for e in chosen if (e.scale, gap_of(e)) == (scale, gap_mm)]
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

    @property
    def larger(self) -> Array:
        """Factor on each row of a result: lengths grow with the unit, an angle does not."""
        if self.held:
            return np.array([[self.enlarged**2]])
        lengths = [self.enlarged] * (3 * len(self.markers))
        return np.array([1.0, self.enlarged**3, *lengths])[:, None]
