"""`grip`: a gripper's printable part, its grasp of cubes, and its light."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

from .. import design, fem, grasp, meshing, sensing
from ..design.quantity import describe, described
from ..design.settings import FRICTION, QUALITY
from ..errors import InputError, OutputError
from ..grasp.settings import BEYOND, DENSITY, STEP_S
from ..meshing.settings import REFINE, SELF_CONTACT
from ..run.parts import Beside, Chart, Fact, File, Part, Pictures, Sentence, Table, Warn, csv, echo, recorded
from ..run.study import (
    Found,
    Input,
    Node,
    Over,
    Study,
    Tell,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from .inputs import UNIT, FileInput, NumbersInput, asked

CUBES = described("cubes_mm", "12.5 25", "side lengths in mm of the cubes to grasp")
COARSE = described("coarse", False, "quick, less accurate run: coarser mesh, longer time steps")
WHOLE_REFINE, COARSE_REFINE, COARSE_STEP_S = 0.5, 0.4, 1.0
# Rays through the waveguide, an instant.
RAYS = 40_000
WHY = {
    "friction": "published coefficients of dry elastomers on hard plastics are mostly 0.5 to 1 and above",
    "beyond_mm": "distance of the cube's centre beyond the tips, whose edges then touch it near its centre",
    "pressure_MPa": "contact stiffness: reference pressure",
    "depth_mm": "penetration depth at that pressure",
    "stick_mm": "elastic slip before sliding",
    "halvings": "subdivision of the faces for contact points",
    "step_s": "largest time step",
}
COLUMNS = (
    "time_s", "pressure_kPa", "angle_deg", "normal_N", "down_N", "area_mm2", "sticking", "slid_mm",
    "deepest_mm", "lost_mJ", "volume_mm3", "snapped_mm",
)  # fmt: skip


@attrs.frozen
class GripperInput(FileInput):
    """A gripper; its unit is in another file."""

    kind: str = "gripper"
    load: Callable[[Path], Any] = lambda path: design.read_gripper(path)

    def texts(self, name: str, value: design.Gripper) -> dict[str, str]:
        """Texts of both files."""
        from ..design.gripper import to_toml

        return {f"{name}.toml": to_toml(value, UNIT), UNIT: design.to_toml(value.unit)}

    def file_names(self, name: str) -> tuple[str, ...]:
        """Both files."""
        return f"{name}.toml", UNIT


@attrs.frozen
class PhasesInput(FileInput):
    """Pressure over the phases of a grasp, by default those that are shipped."""

    kind: str = "phases"
    file: str = "{name}.csv"
    text: Callable[[Any], str] = lambda phases: phases.text()
    load: Callable[[Path], Any] = lambda path: grasp.read_phases(path)

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> grasp.Phases:
        """The phases of a file, by default those that are shipped; raises InputError."""
        found: grasp.Phases | None = super().made(values, given)
        return grasp.shipped_phases() if found is None else found

    def same(self, value: grasp.Phases, other: grasp.Phases) -> bool:
        """Return True for equal pressures and phases."""
        return value.text() == other.text()


@attrs.frozen
class RefineInput(Input):
    """Refinement of the mesh; without one, that of the detail."""

    kind: str = "refine"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> float:
        """The refinement; raises InputError."""
        usual = COARSE_REFINE if given["coarse"] else WHOLE_REFINE
        return float(REFINE.checked(usual if values[0] is None else values[0]))

    def read(self, name: str, found: Found) -> float:
        """The refinement of the file; raises InputError."""
        return self.made((found.keys.pop(name, None),), found.given)


def _grasp_s(study: Grip) -> float:
    return 420.0 * study.finer / study.step_s(study.coarse)


@attrs.frozen(kw_only=True, eq=False)
class Grip(Study):
    """Design a gripper of two units and simulate its grasp of cubes with friction: printable part, forces,
    light signal.
    """

    name = "grip"
    example = "grip --preset gripper --out out/gripper"
    node = Node(
        "Gripper",
        "the gripper's grasp of cubes",
        (("grasp", "grasp", "the grasp"),),
        lambda summary: _held(summary),
        label="Grasp",
        hidden=("beyond_mm", "protocol", "refine", "quality", "solid_only"),
    )
    files = {
        "gripper.stl": "the printable part, mm",
        "gripper.3mf": "the same as 3MF",
        "grasp_*.csv": "time series of the grasp of a cube, by its side in mm",
        "pull_*.csv": "friction capacity against displacement of the cube",
        "cube-*": "its motion: finger.pvd (ParaView), motion/, gripper.npz, left.pc2, right.pc2 (Blender)",
        "gripper.png": "the printable part cut open",
        "frame_*.png": "fingers and cube at the end of a phase",
    }

    gripper: design.Gripper = given(GripperInput())
    cubes_mm: tuple[float, ...] = given(
        NumbersInput(descriptions=(CUBES,), metavar="MM", many=True, option="cube"),
        factory=lambda: tuple(map(float, CUBES.default.split())),
    )
    density_g_per_ml: float = setting(DENSITY, metavar="G_PER_ML")
    friction: float = setting(FRICTION, metavar="MU")
    beyond_mm: float = setting(BEYOND, metavar="MM")
    protocol: grasp.Phases = asked(
        PhasesInput,
        "protocol",
        "pressure protocol with the phases i to v; empty: protocols/gripper.csv",
        empty=attrs.Factory(lambda: grasp.shipped_phases()),
        metavar="CSV",
        path="file",
    )
    coarse: bool = setting(COARSE)
    refine: float = given(
        RefineInput(
            descriptions=(
                REFINE._replace(
                    default=None,
                    text=f"{REFINE.text}; empty: {WHOLE_REFINE:g}, or {COARSE_REFINE:g} with --coarse",
                ),
            ),
            metavar="F",
        ),
        default=attrs.Factory(lambda study: COARSE_REFINE if study.coarse else WHOLE_REFINE, takes_self=True),
    )
    self_contact: bool = setting(SELF_CONTACT)
    solid_only: bool = setting(
        described("solid_only", False, "write only the printable part; simulate nothing")
    )
    quality: str = setting(QUALITY)

    def __attrs_post_init__(self) -> None:
        self.gripper.unit.wall.require_without_memory("a grasp")
        gap = self.gripper.fingers.gap_mm
        for side in self.cubes_mm:
            grasp.Cube(side, self.density_g_per_ml)
            if self.cubes_mm.count(side) > 1:
                raise InputError("two cubes have the same side", "--cube", "name each side once")
            if side >= gap:
                raise InputError(
                    f"a cube of {side:g} mm does not fit between fingers {gap:g} mm apart",
                    "--cube",
                    "choose a smaller cube, or a gripper with a wider gap",
                )

    @property
    def sides(self) -> tuple[float, ...]:
        """Sides in mm of the cubes that are grasped."""
        return () if self.solid_only else self.cubes_mm

    @property
    def finer(self) -> float:
        """Factor on the seconds of a solve on the default mesh."""
        return (self.refine / WHOLE_REFINE) ** 3.5

    def detail(self) -> str:
        """What the seconds of a grasp depend on, beside the cube."""
        return f"grip {self.refine:g} {self.step_s(self.coarse):g}{' apart' * self.self_contact}"

    # What the stages take of the inputs.

    @derived
    def fingers(self, gripper: design.Gripper) -> design.Gripper:
        """The fingers alone: of names, path and plate no grasp depends."""
        unit = attrs.evolve(gripper.unit, name="finger")
        return design.Gripper(unit=unit, path="alpha1", fingers=gripper.fingers)

    @derived
    def path(self, gripper: design.Gripper) -> str:
        """Path of the waveguides."""
        return gripper.path

    @derived
    def step_s(self, coarse: bool) -> float:
        """Longest interval between instants in s."""
        return COARSE_STEP_S if coarse else STEP_S

    @derived
    def contact(self, friction: float, beyond_mm: float) -> grasp.Contact:
        """Contact of fingers and cubes."""
        return grasp.Contact(friction, beyond_mm)

    # Its stages.

    @stage("solid", 5.0, kept=False)
    def part(self, gripper: design.Gripper, quality: str) -> design.GripperSolid:
        """The printable part."""
        return design.build_gripper(gripper, quality)

    @stage("mesh", lambda study: 5.0 * study.finer, wanted=lambda study: study.sides)
    def mesh(self, fingers: design.Gripper, refine: float, tell: Tell) -> meshing.Mesh:
        """Analysis mesh of half a finger."""
        from ..body import mesh_printed

        mesh = mesh_printed(fingers.unit, meshing.MeshSettings(refine=refine))
        tell.made(f"{len(mesh.nodes)} nodes and {len(mesh.tets)} elements")
        return mesh

    @intermediate()
    def filled(self, fingers: design.Gripper, mesh: meshing.Mesh) -> fem.Materials:
        """Materials of the finger's mesh."""
        return fem.materials_of(fingers.unit, mesh)

    @stage("grasp of {side:g} mm", _grasp_s, over=Over(("side",), lambda study: study.sides))
    def grasps(
        self,
        side: float,
        density_g_per_ml: float,
        fingers: design.Gripper,
        protocol: grasp.Phases,
        mesh: meshing.Mesh,
        filled: fem.Materials,
        contact: grasp.Contact,
        step_s: float,
        self_contact: bool,
        tell: Tell,
    ) -> grasp.Grasp:
        """The grasp of a cube, phase by phase."""
        from ..fem.newton_settings import BODY_CONTACT_NEWTON, BODY_OBSTACLE_NEWTON
        from ..fem.self_contact import self_contact_of

        return grasp.grasp(
            fingers,
            grasp.Cube(side, density_g_per_ml),
            protocol,
            mesh,
            filled,
            contact,
            step_s,
            on_instant=tell,
            newton=BODY_CONTACT_NEWTON if self_contact else BODY_OBSTACLE_NEWTON,
            self_contact=self_contact_of(fingers.unit, mesh) if self_contact else None,
        )

    # With self-contact no step passes a touch.
    @stage(
        "crossing walls",
        1.0,
        over=Over(("side",), lambda study: study.sides, lambda study, side: {"grasps": side}),
        wanted=lambda study: study.sides and not study.self_contact,
    )
    def crossings(self, side: float, mesh: meshing.Mesh, grasps: grasp.Grasp) -> tuple[float, str] | None:
        """First pressure in kPa at which walls of the free finger cross as it opens, and which."""
        opening = range(1, grasps.end("i") + 1)
        states = [fem.State(design.in_MPa(float(grasps.pressure_kPa[k])), grasps.u[k]) for k in opening]
        first = fem.first_self_intersection(mesh, [fem.rest(mesh), *states])
        return None if first is None else (design.in_kPa(first.pressure_MPa), str(first.crossings[0]))

    @stage(
        "light",
        lambda study: 4.0 * len(study.sides) / study.step_s(study.coarse),
        over=Over(("side",), lambda study: study.sides, lambda study, side: {"grasps": side}),
    )
    def light(
        self, side: float, fingers: design.Gripper, path: str, mesh: meshing.Mesh, grasps: grasp.Grasp
    ) -> sensing.Signal:
        """Light through the bent waveguide at every instant, by rays."""
        along = design.window(fingers.unit, path)
        return sensing.signal_of_states(fingers.unit, along, mesh, list(grasps.u), rays=RAYS)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the fingers."""
        from ..report.plots import label

        gap = self.gripper.fingers.gap_mm
        return (
            f"Gripper: {self.gripper.name}",
            f"Two {self.gripper.unit.name} {gap:g} mm apart, {label(self.gripper.path)} in each",
        )

    @section()
    def answer(
        self,
        gripper: design.Gripper,
        part: design.GripperSolid,
        grasps: Mapping[float, grasp.Grasp] | None = None,
    ) -> Iterator[Part]:
        """The part, and which cubes it lifts."""
        import numpy as np

        from ..report import grasp_charts as charts

        x, y, z = *gripper.size_mm, float(np.ptp(part.vertices[:, 2]))
        yield recorded("size_mm", [x, y, z])
        yield recorded("gates", attrs.asdict(part.gates))
        if grasps:
            yield recorded("grasps", {f"{s:g}": figures_of(g) for s, g in grasps.items()})
        size = f"{x:g} x {y:g} x {z:.4g} mm"
        yield from echo(f"one part of {size}, {part.gates.inner_shells} chambers")
        yield File("gripper.stl", lambda path: design.stl_bytes(part.vertices, part.triangles))
        yield File("gripper.3mf", lambda path: _threemf(gripper.name, part))
        shown = [Fact("part", size, size), Fact("resin", 0, f"{part.gates.volume_mm3 / 1e3:.3g} ml")]
        words = []
        for side, g in (grasps or {}).items():
            angle, force, lift = g.angle_deg[g.end("iii")], g.normal_N[g.end("iii")], g.lift
            shown.append(Fact(f"{side:g} mm, plateau", angle, f"{angle:.1f}°, {force:.2f} N"))
            hung = f"held, {lift.margin:.3g} times its weight" if lift.held else "not lifted"
            yield from echo(
                f"cube of {side:g} mm: {angle:.1f} deg and {force:.3g} N a finger at the plateau, {hung}"
            )
            words.append(
                f"The cube of {side:g} mm is lifted: friction can carry {lift.margin:.1f} times its weight."
                if lift.held
                else f"The cube of {side:g} mm is dropped: friction can carry {lift.capacity_N:.2g} N of "
                f"{lift.weight_N:.2g} N."
            )
        answer = " ".join(words) or "The printable part passed every geometry check."

        picture = Pictures(lambda: [("gripper.png", charts.part_picture(gripper, part))])
        yield Beside([[Sentence(answer, answer=True), *shown], picture])

    @section()
    def motions(
        self,
        gripper: design.Gripper,
        mesh: meshing.Mesh,
        filled: fem.Materials,
        grasps: Mapping[float, grasp.Grasp] | None = None,
    ) -> Iterator[Part]:
        """The motion of each grasp as files, and what went wrong in it."""
        from ..report.grasp_files import write_grasp

        yield recorded("mesh", {"nodes": len(mesh.nodes), "tetrahedra": len(mesh.tets)})
        for side, g in (grasps or {}).items():

            def write(path: Path, g: grasp.Grasp = g) -> None:
                write_grasp(path, gripper, mesh, filled, g)

            yield File(f"cube-{side:g}", write, of=g)
            pulls = zip(g.lift.pull_mm, g.lift.pull_N, strict=True)
            rows = [(f"{way:.6g}", f"{force:.6g}") for way, force in pulls]
            yield csv(f"pull_{side:g}.csv", ["down_mm", "carried_N"], rows)
            if g.snapped_mm.any():
                first = int(g.snapped_mm.astype(bool).argmax())
                yield Warn(
                    f"Closing on {side:g} mm parts of the finger snap, for the first time before "
                    f"{g.time_s[first]:g} s ({g.pressure_kPa[first]:.4g} kPa), by {g.snapped_mm.max():.2g} "
                    "mm at most: later states are those that a damped motion reaches."
                )
            if not g.lift.held:
                yield Warn(
                    f"The cube of {side:g} mm ({g.cube.mass_g:.3g} g) is not lifted: friction can carry at "
                    f"most {g.lift.capacity_N:.3g} N of its {g.cube.weight_N:.3g} N."
                )

    @section()
    def crossed(self, crossings: Mapping[float, tuple[float, str]]) -> Iterator[Part]:
        """Walls that cross."""
        for pressure, words in {one for one in crossings.values() if one}:
            yield Warn(
                f"From {pressure:.4g} kPa on, walls of the opening finger intersect: {words}. States beyond "
                "are invalid. Use a smaller vacuum or --self-contact."
            )

    @section("frames", "The grasp, phase by phase")
    def frames(
        self, gripper: design.Gripper, mesh: meshing.Mesh, grasps: Mapping[float, grasp.Grasp]
    ) -> Iterator[Part]:
        """Fingers and cube in each phase."""
        from ..report import grasp_charts as charts

        meaning = "; ".join(f"{name}: {words}" for name, words in grasp.MEANING.items())
        yield Sentence(f"{meaning}. The gripper hangs, tips down; fingers are cut open.")
        for side, g in grasps.items():

            def pictures(g: grasp.Grasp = g, side: float = side) -> list[tuple[str, Any]]:
                named = zip(grasp.NAMES, charts.frames(gripper, mesh, g), strict=True)
                return [(f"frame_{side:g}_{name}.png", picture) for name, picture in named]

            yield Sentence(f"Cube of {side:g} mm")
            yield Pictures(pictures)
        words = "Lines of anchors; thin lines: the cubes."
        yield Beside([Chart(lambda: charts.shapes(gripper, grasps), words, "shapes of the fingers")])

    @section("force", "Forces")
    def forces(
        self, grasps: Mapping[float, grasp.Grasp], light: Mapping[float, sensing.Signal] | None = None
    ) -> Iterator[Part]:
        """Forces and angle over time."""
        import numpy as np

        rows: list[list[str]] = []
        for side, g in grasps.items():
            values = [*(getattr(g, name) for name in COLUMNS), g.cube_mm[:, 2]]
            columns = ["phase", *COLUMNS, "cube_z_mm"]
            if signal := (light or {}).get(side):
                columns += ["light", "light_lost"]
                values += [signal.transmitted, signal.delta]
            table = zip(g.phase, np.array(values).T, strict=True)
            shown = [(phase, *(f"{v:.6g}" for v in row)) for phase, row in table]
            yield csv(f"grasp_{side:g}.csv", columns, shown)
            for name in grasp.NAMES:
                k = g.end(name)
                cells = [f"{side:g}", f"{name}, end", f"{g.pressure_kPa[k]:g}", f"{g.angle_deg[k]:.1f}"]
                cells += [f"{g.normal_N[k]:.3f}", f"{g.down_N[k]:.3f}"]
                cells += [f"{100 * g.sticking[k]:.0f}" if g.area_mm2[k] > 0 else "", f"{g.slid_mm[k]:.2f}"]
                rows.append([*cells, f"{g.deepest_mm[k]:.2f}"])
        labels = {
            "normal_N": "normal force of a finger [N]",
            "down_N": "force of a finger along z, down [N]",
            "angle_deg": "bending angle [deg]",
        }
        yield Beside(
            [
                _over_time(grasps, {side: getattr(g, name) for side, g in grasps.items()}, words)
                for name, words in labels.items()
            ]
        )
        yield Table(
            "Values of one whole finger. Slip: largest accumulated slip of any contact point. Gap error: "
            "largest penetration of the finger into the cube, which the penalty method admits.",
            [
                "cube [mm]", "phase", *Table.numbers("kPa", "angle [deg]", "normal [N]", "down [N]"),
                *Table.numbers("sticking [%]", "slip [mm]", "gap error [mm]"),
            ],
            rows,
        )  # fmt: skip

    @section("lift", "Lifting")
    def lifts(self, grasps: Mapping[float, grasp.Grasp]) -> Iterator[Part]:
        """What friction carries."""
        from ..report import grasp_charts as charts

        yield Sentence(
            "A closing finger also elongates and pushes the cube onto its support. The gripper must rise by "
            "some millimetres until friction has reversed and carries the weight; then the cube leaves its "
            "support."
        )
        words = "Dots: friction equals the weight."
        yield Beside([Chart(lambda: charts.pulling(grasps), words, "force against displacement")])
        head = ["cube [mm]", *Table.numbers("mass [g]", "weight [N]"), "held", ("rise [mm]", "n")]
        head += Table.numbers("friction capacity [N]", "capacity / weight", "2 mu N / weight")
        rows = []
        for side, g in grasps.items():
            f = g.lift
            rise = f"{f.sag_mm:.2f}" if f.held else ""
            cells = [f"{side:g}", f"{g.cube.mass_g:.1f}", f"{f.weight_N:.3f}", "yes" if f.held else "no"]
            rows.append([*cells, rise, f"{f.capacity_N:.3f}", f"{f.margin:.1f}", f"{f.margin_by_rule:.1f}"])
        yield Table("", head, rows)

    @section("light", "Waveguide signal")
    def signals(
        self, grasps: Mapping[float, grasp.Grasp], light: Mapping[float, sensing.Signal]
    ) -> Iterator[Part]:
        """The light that the grasps take away."""
        record, at_hold, error = {}, {}, {}
        for side, signal in light.items():
            ends = {name: grasps[side].end(name) for name in grasp.NAMES}
            errors = signal.errors * signal.transmitted / signal.at_rest
            record[f"{side:g}"] = {
                "lost_at_end_of": {name: float(signal.delta[k]) for name, k in ends.items()},
                "error_at_end_of": {name: float(errors[k]) for name, k in ends.items()},
            }
            at_hold[side] = 100.0 * float(signal.delta[ends["iii"]])
            error[side] = 100.0 * float(errors[ends["iii"]])
        yield recorded("light", record)
        each = "; ".join(f"{s:g} mm: {v:.1f} ± {error[s]:.1f} %" for s, v in sorted(at_hold.items()))
        yield Sentence(f"At the plateau: {each}.{_compared(at_hold, error)}")
        yield Sentence(
            "Computed by ray tracing through the deformed waveguide of the chosen path. The loss is positive "
            "and relative to the light at rest. Both fingers have the same model, so their signals are "
            "equal. The optical constants of the resin are assumed: no published values were found."
        )
        lost = {side: 100.0 * signal.delta for side, signal in light.items()}
        yield Beside([_over_time({side: grasps[side] for side in light}, lost, "light lost, ΔV/Vf [%]")])

    @section("assumed", "Assumptions")
    def assumed(
        self, gripper: design.Gripper, contact: grasp.Contact, step_s: float, self_contact: bool
    ) -> Iterator[Part]:
        """What the paper does not give."""
        from ..design.gripper import SECTIONS

        grip = {**attrs.asdict(contact), "step_s": step_s}
        sizes = attrs.asdict(gripper.fingers) | attrs.asdict(gripper.plate)
        yield recorded(
            "inputs", {"gripper": sizes, "unit": gripper.unit.name, "path": gripper.path, "grip": grip}
        )
        parts = "keep apart" if self_contact else "may pass through each other"
        yield Sentence(
            "The paper does not give the size of its gripper, the pressures of its grasp other than 0, -20 "
            "and 40 kPa, or the mass of its cubes. The plate is clamped, the weight of the fingers is "
            "neglected, and both fingers are equal. The fingers are simulated as printed, strut by strut; "
            f"their own walls and struts {parts}."
        )
        rows = [
            (f"{one.section}.{d.name}", f"{sizes[d.name]:g}", d.unit, d.source.removeprefix("assumed: "))
            for one in SECTIONS
            for d in describe(one)
        ]
        rows += [(f"grip.{name}", f"{value:g}", "", WHY[name]) for name, value in grip.items()]
        yield Table("", ["parameter", ("value", "n"), "unit", ("why", "text")], rows)


def figures_of(found: grasp.Grasp) -> dict[str, Any]:
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


def _held(summary: Mapping[str, Any]) -> str:
    held = [side for side, g in summary.get("grasps", {}).items() if g["held"]]
    return f"holds {', '.join(held)} mm" if held else ""


def _threemf(name: str, part: design.GripperSolid) -> bytes:
    """The part as 3MF, read back; raises OutputError."""
    from ..design import threemf

    packed = design.write_3mf([threemf.Part(name, part.vertices, part.triangles)], [1], name)
    if len(threemf.read_3mf(packed)[0][1].triangles) != len(part.triangles):
        raise OutputError(
            "the 3MF file, read back, does not contain the part that was written", "gripper.3mf"
        )
    return packed


def _over_time(grasps: Mapping[float, grasp.Grasp], values: Mapping[float, Any], words: str) -> Chart:
    from ..report import grasp_charts as charts

    return Chart(lambda: charts.over_time(grasps, values, words), "", words)


def _compared(at_hold: Mapping[float, float], error: Mapping[float, float]) -> str:
    """Which cube changes the light more, in words; "" of a single one."""
    if len(at_hold) < 2:
        return ""
    small, large = min(at_hold), max(at_hold)
    more = abs(at_hold[small]) - abs(at_hold[large])
    compared = "more than" if more > 0 else "less than"
    if abs(more) < 2.0 * (error[small] ** 2 + error[large] ** 2) ** 0.5:
        compared = "as much as"
    return (
        f" Within the error of the ray tracing, the cube of {small:g} mm changes the light {compared} that "
        f"of {large:g} mm; the paper measured a larger signal for the smaller "
        f"cube{'.' if compared == 'more than' else '; this model does not reproduce that.'}"
    )
