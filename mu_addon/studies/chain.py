"""`chain`: units in series, their motion under their pressures, or the pressures that reach a point."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

from .. import chain, design, fem, meshing
from ..chain.settings import GRAVITY, LOADED, ORIENTATION, PRESSURE_STEP, REFINE, TIMES, TIP_MASS
from ..design.quantity import Description, described
from ..design.settings import USUAL_RESIN
from ..errors import InputError
from ..run.parts import Beside, Chart, Fact, File, Part, Pictures, Sentence, Table, Warn, csv, echo, recorded
from ..run.study import (
    Found,
    Input,
    Members,
    Node,
    Over,
    Study,
    Tell,
    Written,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from ..toml_reader import TomlTable
from .inputs import FileInput, NumbersInput

JOINT_S = 289.0
"""Seconds in which a joint is learned at one pressure on the default mesh."""
MOST_UNITS = 8
REACH = described(
    "reach", "", "point x y z in mm that the tip is to reach, in place of a protocol; empty: none"
)
ASSUMED = (
    "Each unit is an elastic joint between rigid plates: end planes stay plane, and units act on each "
    "other by the motion of these planes alone. A joint's potential is a polynomial of degree four about "
    "the unit's free state at each pressure, learned from its finite element model without weight. "
    "The weight of a unit acts at its centre of mass, which moves with both plates. Units do not touch "
    "each other. Inertia and air flow are neglected, and the material has no memory. The intervals "
    "include the error of the joints against the finite element model at held-out states, not the errors "
    "of mesh, print and resin."
)
_ENTRY = ("preset", "file", "turn_deg", "pressure_kPa")


@attrs.frozen
class ChainUnit:
    """One unit of a chain: turned about its axis by turn_deg, learned for pressure_kPa (low, high)."""

    unit: design.Unit
    turn_deg: float = 0.0
    pressure_kPa: tuple[float, float] | None = None

    def __attrs_post_init__(self) -> None:
        self.unit.wall.require_without_memory("a chain")
        if not math.isfinite(self.turn_deg):
            raise InputError("turn_deg is not a number", "[[unit]]", "give degrees about the axis")
        if self.pressure_kPa is not None:
            low, high = self.pressure_kPa
            if not -100.0 < low <= high <= 1000.0:
                raise InputError(
                    f"pressure_kPa = [{low:g}, {high:g}]",
                    "[[unit]]",
                    "give the lowest, then the highest, in kPa",
                )


@attrs.frozen
class MeshTable:
    """Table [mesh]."""

    refine: float = REFINE.field()


@attrs.frozen
class TableInput(Input):
    """A table of settings, made by `of`; a command reads it from a file alone."""

    kind: str = "table"
    settings: tuple[Description, ...] = ()
    of: Callable[..., Any] = MeshTable

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Any:
        """The table of the settings' values; raises InputError."""
        return self.of(**{d.name: value for d, value in zip(self.settings, values, strict=True)})


@attrs.frozen
class UnitsInput(Input):
    """Units of a chain, tables [[unit]] with a file each."""

    kind: str = "units"

    def write(self, name: str, value: tuple[ChainUnit, ...]) -> Written:
        """Their tables and files."""
        tables = [
            {"file": f"unit_{n}.toml", "turn_deg": one.turn_deg}
            | ({} if one.pressure_kPa is None else {"pressure_kPa": one.pressure_kPa})
            for n, one in enumerate(value, 1)
        ]
        files = {f"unit_{n}.toml": design.to_toml(one.unit) for n, one in enumerate(value, 1)}
        return Written({"unit": tables}, files=files)

    def read(self, name: str, found: Found) -> tuple[ChainUnit, ...]:
        """The units of the tables, of presets or of files beside; raises InputError."""
        entries = found.table.tables("unit")
        found.keys.pop("unit", None)
        return tuple(_unit(entry, found.path.parent) for entry in entries)

    def file_names(self, name: str) -> tuple[str, ...]:
        """Files of as many units as there may be."""
        return tuple(f"unit_{n}.toml" for n in range(1, MOST_UNITS + 1))


def _unit(entry: TomlTable, folder: Path) -> ChainUnit:
    entry.only(_ENTRY)
    if ("preset" in entry) == ("file" in entry):
        raise InputError(
            "a unit is named by preset or by file", entry.at(), 'give preset = "mu-1.0x", or file'
        )
    named = entry.word("preset" if "preset" in entry else "file")
    unit = design.load_preset(named) if "preset" in entry else design.read_unit(folder / named)
    rest = {key: value for key, value in entry.values.items() if key not in ("preset", "file")}
    return attrs.evolve(entry, values=rest).made(ChainUnit, unit=unit)


@attrs.frozen
class PressuresInput(FileInput):
    """Pressures of the units over time."""

    kind: str = "pressures"
    file: str = "{name}.csv"
    text: Callable[[Any], str] = lambda pressures: pressures.text()

    def read(self, name: str, found: Found) -> chain.Pressures | None:
        """The pressures of the file, or None; raises InputError."""
        named = found.take(name, str, None)
        if named is None or "reach" in found.replaced:
            return None
        return chain.read_pressures(found.path.parent / named, len(found.given["units"]))


@attrs.frozen
class ReachInput(NumbersInput):
    """A point that the tip is to reach, the table [target]; empty without one."""

    def write(self, name: str, value: tuple[float, ...]) -> Written:
        """Its table."""
        return Written({"target": {name: value}} if value else {})

    def read(self, name: str, found: Found) -> tuple[float, ...]:
        """The point of the table; raises InputError."""
        table = found.table.inner("target").only((name,))
        found.keys.pop("target", None)
        point: tuple[float, ...] = table.take(name, tuple[float, ...], ())
        return point


def _finer(study: Chain) -> float:
    return study.mesh.refine / REFINE.default


def _joint_s(study: Chain) -> float:
    # Those at rest take as long as those under two pressures.
    counts = [len(study.joint.pressures(low, high)) + 2 for *_, low, high in study.joints_of]
    return JOINT_S * _finer(study) * sum(counts) / len(counts)


@attrs.frozen(kw_only=True, eq=False)
class Chain(Study):
    """Simulate units in series, one pressure each, under gravity and a tip load, or find the pressures that
    bring the tip to a point.
    """

    name = "chain"
    node = Node(
        "Chain",
        "units in series under gravity and a load at the tip",
        (
            ("tip", "file", "tip.csv, or target.csv with a point to reach"),
            ("angle", "number", "angle of the tip relative to the base, degrees"),
        ),
        lambda summary: "tip at {:.1f}, {:.1f}, {:.1f} mm".format(*summary["chain"]["tip_mm"]),
        read=lambda done, call: {
            "tip": done.folder / ("target.csv" if "target" in done.summary else "tip.csv"),
            "angle": float(done.summary["chain"]["angle_deg"]),
        },
        hidden=("resin",),
    )
    example = "chain assets/examples/trunk/chain.toml --out out/trunk"
    from_file = (
        "The chain, a chain.toml: its units, loads, protocol or target. Options replace its values.",
        "give a chain.toml, such as assets/examples/trunk/chain.toml",
    )
    files = {
        "tip.csv": "pressures, place and rotation of the tip over time, with half widths of 95 % intervals",
        "joints.csv": "every joint at states left out of its fit",
        "target.csv": "pressures that bring the tip to the target",
        "chain.pvd": "motion of the units, for ParaView",
        "chain": "its meshes, a file for each instant",
        "chain_*.png": "the chain at its start, most bent and at its end",
    }

    units: tuple[ChainUnit, ...] = given(UnitsInput())
    protocol: chain.Pressures | None = given(PressuresInput(), default=None)
    reach: tuple[float, ...] = given(
        ReachInput(descriptions=(REACH,), metavar=("X", "Y", "Z"), many=3), default=()
    )
    gravity: bool = setting(GRAVITY)
    orientation_deg: float = setting(ORIENTATION, metavar="DEG")
    tip_mass_g: float = setting(TIP_MASS, metavar="G")
    tip_force_N: tuple[float, ...] = given(NumbersInput(), default=())
    tip_couple_N_mm: tuple[float, ...] = given(NumbersInput(), default=())
    resin: str = setting(
        described("resin", USUAL_RESIN, "resin of the library, for the units' weight"), metavar="NAME"
    )
    times: int = setting(TIMES, metavar="N")
    mesh: MeshTable = given(TableInput(settings=(REFINE,)), factory=MeshTable)
    joint: chain.Sampling = given(
        TableInput(settings=(PRESSURE_STEP, LOADED), of=lambda **values: chain.Sampling(**values)),
        factory=lambda: chain.Sampling(),
    )

    def __attrs_post_init__(self) -> None:
        if not 1 <= len(self.units) <= MOST_UNITS:
            raise InputError(
                f"a chain of {len(self.units)} units", "[[unit]]", f"give 1 to {MOST_UNITS} tables [[unit]]"
            )
        if (self.protocol is None) == (not self.reach):
            both = "both a protocol and a target" if self.reach else "neither a protocol nor a target"
            raise InputError(both, "chain.toml", 'give protocol = "FILE.csv", or [target] reach = [x, y, z]')
        if self.reach and all(one.pressure_kPa is None for one in self.units):
            raise InputError(
                "no unit has a pressure range",
                "[[unit]] pressure_kPa",
                "give pressure_kPa = [low, high] to each unit that is to move",
            )
        for name in ("reach", "tip_force_N", "tip_couple_N_mm"):
            numbers = getattr(self, name)
            if len(numbers) not in (0, 3) or not all(map(math.isfinite, numbers)):
                shown = ", ".join(f"{v:g}" for v in numbers)
                raise InputError(f"[{shown}] is no vector", name, "give three finite numbers: x, y, z")

    @property
    def joints_of(self) -> list[tuple[int, design.Unit, float, float]]:
        """Number and unit of each joint, lowest and highest pressure in kPa; equal units share theirs."""
        spans: dict[str, list[float]] = {}
        units: dict[str, design.Unit] = {}
        for n, one in enumerate(self.units):
            of = spans.setdefault(one.unit.hash(), [0.0])
            units.setdefault(one.unit.hash(), one.unit)
            of += one.pressure_kPa or ()
            of += [] if self.protocol is None else self.protocol.pressure_kPa[:, n].tolist()
        return [(k, units[name], min(of), max(of)) for k, (name, of) in enumerate(spans.items(), 1)]

    # What the stages take of the inputs.

    @derived
    def turns(self, units: tuple[ChainUnit, ...]) -> tuple[tuple[str, float], ...]:
        """Of each unit, what its joint is known by, and its turn in degrees."""
        return tuple((one.unit.hash(), one.turn_deg) for one in units)

    @derived
    def bounds(self, units: tuple[ChainUnit, ...]) -> tuple[tuple[float, float], ...]:
        """Bounds in kPa of each unit's pressure, to reach a point."""
        return tuple(one.pressure_kPa or (0.0, 0.0) for one in units)

    @derived
    def loads(
        self,
        gravity: bool,
        orientation_deg: float,
        tip_mass_g: float,
        tip_force_N: tuple[float, ...],
        tip_couple_N_mm: tuple[float, ...],
    ) -> chain.Loads:
        """Weight and loads, in the frame of the base."""
        import numpy as np

        from ..measured.pose import down

        heavy = down(orientation_deg) if gravity else np.zeros(3)
        force, couple = (np.array(one or (0.0, 0.0, 0.0)) for one in (tip_force_N, tip_couple_N_mm))
        return chain.Loads(heavy, tip_mass_g, force, couple)

    # Its stages.

    @stage(
        "mesh of unit {number}",
        lambda study: 4.0 * _finer(study) ** 2,
        over=Over(("number", "unit"), lambda study: [one[:2] for one in study.joints_of]),
    )
    def meshes(self, number: int, unit: design.Unit, mesh: MeshTable, tell: Tell) -> meshing.Mesh:
        """Analysis mesh of a whole unit."""
        from ..body import mesh_printed

        settings = meshing.MeshSettings(refine=mesh.refine, fraction="full")
        return mesh_printed(unit, settings, lambda _, share: tell(share), tell.cache)

    @stage(
        "joint of unit {number}",
        _joint_s,
        over=Over(
            ("number", "unit", "low", "high"),
            lambda study: study.joints_of,
            lambda study, member: {"meshes": member[:2]},
        ),
    )
    def joints(
        self,
        number: int,
        unit: design.Unit,
        low: float,
        high: float,
        meshes: meshing.Mesh,
        joint: chain.Sampling,
        resin: str,
        tell: Tell,
    ) -> chain.Learned:
        """The unit as an elastic joint; each state is kept by what it depends on."""
        from ..materials import load_material
        from ..run.cache import Cache, key

        cache, pressures = Cache(tell.cache), joint.pressures(low, high)
        density = load_material(resin).density_g_per_ml
        # A state hangs on the free ones before it, and these on the pressures visited.
        name = key("joint", unit.hash(), meshes.hash(), attrs.astuple(joint), density, pressures)
        return chain.learn(
            unit.name,
            unit,
            meshes,
            pressures,
            joint,
            density,
            lambda what: cache.get("plate", key(name, what)),
            lambda what, arrays: cache.put("plate", key(name, what), arrays),
            tell,
        )

    @intermediate()
    def shape(self, turns: tuple[tuple[str, float], ...], meshes: Members, joints: Members) -> chain.Shape:
        """The whole chain for display."""
        body = {unit.hash(): mesh for (_, unit), mesh in meshes.items()}
        learned = {unit.hash(): found for (_, unit, *_), found in joints.items()}
        return chain.Shape(
            tuple(turn for _, turn in turns),
            tuple(body[name] for name, _ in turns),
            tuple(learned[name] for name, _ in turns),
        )

    @stage("chain", lambda study: 12.0 if study.reach else 2.0)
    def motion(
        self,
        turns: tuple[tuple[str, float], ...],
        joints: Members,
        loads: chain.Loads,
        protocol: chain.Pressures | None,
        times: int,
        reach: tuple[float, ...],
        bounds: tuple[tuple[float, float], ...],
        tell: Tell,
    ) -> chain.Motion:
        """The chain in motion, or on the way to the point."""
        learned = {unit.hash(): found for (_, unit, *_), found in joints.items()}
        links = [chain.Link(learned[name].joint, turn) for name, turn in turns]
        return chain.move(chain.Chain(links, loads), protocol, times, reach, bounds, tell)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the units."""
        names = ", ".join(dict.fromkeys(one.unit.name for one in self.units))
        return "Units in series", f"{len(self.units)} units: {names}"

    @section()
    def answer(self, shape: chain.Shape, tip_mass_g: float, motion: chain.Motion) -> Iterator[Part]:
        """Where the tip ends."""
        import numpy as np

        lines = {
            f"{one.joint.name}: {one.joint.mass_g:.1f} g, held-out error {one.error_deg:.2f} deg and "
            f"{one.error_mm:.2f} mm": None
            for one in shape.learned
        }
        yield from echo(*lines)
        last, largest = motion.states[-1], max(state.angle_deg for state in motion.states)
        mass = sum(found.joint.mass_g for found in shape.learned)
        x, y, z = last.tip_mm
        words = f"At the end the tip is at ({x:.1f}, {y:.1f}, {z:.1f}) mm, turned by {last.angle_deg:.1f}°."
        if motion.reach is not None:
            words = f"The tip ends {motion.reach.miss_mm:.2g} mm from the target. {words}"
        yield Sentence(words, answer=True)
        yield Fact("mass of the units", mass, f"{mass:.0f} g", "chain.mass_g")
        yield Fact("mass at the tip", tip_mass_g, f"{tip_mass_g:g} g")
        yield Fact("largest angle", largest, f"{largest:.1f}°", "chain.largest_angle_deg")
        error = float(np.linalg.norm(last.tip_error_mm))
        yield Fact("error of the tip, 95 %", error, f"{error:.1f} mm")
        yield recorded("chain.units", len(shape.turns_deg))
        yield recorded("chain.tip_at_rest_mm", motion.rest.tip_mm)
        for name in ("tip_mm", "tip_error_mm", "rotation_vector_deg", "angle_deg"):
            yield recorded(f"chain.{name}", getattr(last, name))
        yield recorded("chain.largest_used_range", motion.largest_used_range)
        yield recorded("chain.processor_s_a_state", motion.processor_s / len(motion.states))
        if motion.largest_used_range > 1.0:
            yield Warn(
                f"a unit is loaded to {motion.largest_used_range:.2f} times its joint's learned range: widen "
                "[joint] bend_deg, twist_deg, shear or stretch, or read these states with care"
            )

    @section("shape", "The chain")
    def pictures(
        self, shape: chain.Shape, motion: chain.Motion, reach: tuple[float, ...], orientation_deg: float
    ) -> Iterator[Part]:
        """The chain at its start, most bent and at its end."""
        from ..report import chain_charts, vtk

        def write(path: Path) -> None:
            mesh = shape.mesh()
            moved = [fem.State(0.0, shape.places(state) - mesh.nodes) for state in motion.states]
            vtk.write_trajectory(path, mesh, list(zip(motion.time_s.tolist(), moved, strict=True)))

        hangs = abs(orientation_deg) <= 90
        yield Pictures(lambda: chain_charts.pictures(shape, motion.states, reach, hangs))
        yield File("chain.pvd", write, of=motion)

    @section("tip", "The tip")
    def tip(
        self, units: tuple[ChainUnit, ...], motion: chain.Motion, reach: tuple[float, ...]
    ) -> Iterator[Part]:
        """The way of the tip."""
        import numpy as np

        from ..report import chain_charts as charts

        columns = ["time_s", *(f"pressure_{k}_kPa" for k in range(1, len(units) + 1))]
        columns += ["x_mm", "y_mm", "z_mm", "x_error95_mm", "y_error95_mm", "z_error95_mm"]
        columns += ["rotation_x_deg", "rotation_y_deg", "rotation_z_deg", "angle_deg", "angle_error95_deg"]
        rows = [
            (
                t, *s.pressures_kPa, *s.tip_mm, *s.tip_error_mm, *s.rotation_vector_deg,
                s.angle_deg, s.angle_error_deg, s.used_range.max(),
            )
            for t, s in zip(motion.time_s, motion.states, strict=True)
        ]  # fmt: skip
        yield csv("tip.csv", [*columns, "used_range"], [[f"{v:.9g}" for v in row] for row in rows])
        *rest, last = (", ".join(f"{v:.1f}" for v in s.tip_mm) for s in (motion.rest, motion.states[-1]))
        yield from echo(
            f"tip of {len(units)} units at ({last}) mm, {motion.states[-1].angle_deg:.1f} deg; at rest "
            f"({rest[0]}) mm"
        )

        angles = {"tip against base": np.array([state.angle_deg for state in motion.states])}
        error = np.array([state.angle_error_deg for state in motion.states])
        values = np.array([state.pressures_kPa for state in motion.states]).T
        named = {f"unit {n}": column for n, column in enumerate(values, 1)}
        time_s = motion.time_s
        yield Beside(
            [
                Chart(
                    lambda: charts.tip_way(motion.states, reach),
                    "Grey: lines through the plates; bar: 95 % at the end.",
                    "path of the tip",
                ),
                Chart(
                    lambda: charts.over_time(time_s, angles, "angle [deg]", error),
                    "Band: 95 % by the joints' errors.",
                    "angle of the tip over time",
                ),
                Chart(lambda: charts.over_time(time_s, named, "pressure [kPa]"), "", "pressures over time"),
            ]
        )

    @section("target", "The target")
    def target(self, reach: tuple[float, ...], motion: chain.Motion) -> Iterator[Part]:
        """The pressures that reach the point."""
        found = motion.reach
        if found is None:
            return
        yield recorded("target.reach_mm", reach)
        yield recorded("target.steps", found.iterations)
        for name in ("miss_mm", "pressures_kPa", "at_bound"):
            yield recorded(f"target.{name}", getattr(found, name))
        pressures = list(zip(found.pressures_kPa, found.at_bound, strict=True))
        rows = [(n, p, "yes" if end else "no") for n, (p, end) in enumerate(pressures, 1)]
        columns = ["unit", "pressure_kPa", "at_bound"]
        yield csv("target.csv", columns, [(n, f"{p:.9g}", end) for n, p, end in rows])
        if found.miss_mm > 1.0:
            yield Warn(
                f"the tip comes no nearer than {found.miss_mm:.1f} mm to the target within the pressures: "
                "move the point, widen pressure_kPa or add a unit"
            )
        at = ", ".join(f"{v:g}" for v in reach)
        yield Sentence(
            f"Target ({at}) mm in the base's frame, missed by {found.miss_mm:.3g} mm after "
            f"{found.iterations} steps. Of several solutions one with low pressures is taken; a pressure at "
            "its bound cannot change further."
        )
        shown = ", ".join(f"{p:.4g}" for p in found.pressures_kPa)
        yield from echo(f"target missed by {found.miss_mm:.3g} mm, at {shown} kPa")
        yield Table(
            "",
            ["unit", ("kPa", "n"), "at its bound"],
            [(f"unit {n}", f"{p:.2f}", end) for n, p, end in rows],
        )

    @section("joints", "The joints")
    def held_out(self, units: tuple[ChainUnit, ...], joints: Members) -> Iterator[Part]:
        """Stiffness and accuracy of each unit's joint."""
        learned = {unit.hash(): found for (_, unit, *_), found in joints.items()}
        every = [(one, learned[one.unit.hash()]) for one in units if one.unit.hash() in learned]
        tables, lines = [_joint(one, found) for one, found in every], []
        for one, found in every:
            titles = list(found.held_out[0]) if found.held_out else []
            lines += [(one.unit.name, *(f"{v:.6g}" for v in row.values())) for row in found.held_out]
        yield csv("joints.csv", ["unit", *titles], list(dict.fromkeys(lines)))
        yield recorded("joints", tables)
        for (_, unit, *_), found in joints.items():
            if found.missed:
                yield Warn(
                    f"{unit.name}: {len(found.missed)} loaded states were not reached, first "
                    f"{found.missed[0]}; the joint is less accurate there"
                )
        yield Sentence(
            "Stiffness without pressure of a unit about its free state. Error: root mean square, over the "
            "states left out of the fit, of the displacement caused by the error in the joint's load "
            "(joints.csv)."
        )
        head = [
            "unit",
            *Table.numbers("turn [deg]", "mass [g]"),
            "kPa",
            ("bending [N mm/rad]", "n"),
        ]
        head += Table.numbers("twist [N mm/rad]", "axial [N/mm]", "error [deg]", "error [mm]")
        rows = []
        for n, t in enumerate(tables, 1):
            low, high = t["pressure_kPa"]
            cells = [f"{n}: {t['unit']}", f"{t['turn_deg']:g}", f"{t['mass_g']:.1f}", f"{low:g} to {high:g}"]
            cells += [f"{t['bending_N_mm_per_rad']:.0f}", f"{t['twist_N_mm_per_rad']:.0f}"]
            cells += [f"{t['axial_N_per_mm']:.3f}", f"{t['error_deg']:.2f}", f"{t['error_mm']:.2f}"]
            rows.append(cells)
        yield Table("", head, rows)

    @section("assumed", "Assumptions")
    def assumed(self) -> Iterator[Part]:
        """What the model leaves out."""
        yield Sentence(ASSUMED)


def _joint(one: ChainUnit, learned: chain.Learned) -> Mapping[str, Any]:
    """A unit's joint for summary.json."""
    joint = learned.joint
    h = joint.at(0.0).hessian(joint.at(0.0).eta0)
    return {
        "unit": one.unit.name,
        "turn_deg": one.turn_deg,
        "mass_g": joint.mass_g,
        "pressure_kPa": joint.pressure_kPa[[0, -1]].tolist(),
        "bending_N_mm_per_rad": h[0, 0],
        "twist_N_mm_per_rad": h[2, 2],
        "axial_N_per_mm": h[5, 5],
        "error_deg": learned.error_deg,
        "error_mm": learned.error_mm,
        "missed": learned.missed,
    }
