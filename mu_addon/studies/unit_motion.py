"""A unit's printable solid and its motion without a sensor, Model A: `design` and `simulate`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import attrs

from .. import design, fem, meshing
from .. import simulate_and_place as core
from ..design.quantity import described
from ..design.settings import QUALITY, USUAL_RESIN
from ..errors import InputError
from ..fem.device import DEVICE, known_device
from ..meshing.settings import REFINE, SELF_CONTACT, MeshSettings
from ..run.parts import File, Part, Sentence, Warn, csv, recorded
from ..run.study import Input, Members, Over, Study, Tell, given, intermediate, section, setting, stage
from ..simulate_and_place.settings import SELF_FRICTION, TIMES, UNDER_PRESSURE, WORKERS
from .inputs import OnceInput, UnitInput, asked
from .unit_inputs import BodyInput, EffectsInput, ObstaclesInput, ProtocolInput, grasp

AROUND = "unit and surroundings"
STAGES = ("design", "simulate", "place")


def wants(target: str, in_time: bool | None = None, also: str = "") -> Any:
    """What says of a study if it has a target.

    in_time: and its motion is solved instant by instant, or is not; also: and that input is set.
    """

    def wanted(study: Any) -> bool:
        so = target in study.stages and (in_time is None or study.in_time == in_time)
        return so and (not also or bool(getattr(study, also)))

    return wanted


def timed(title: str, of: str = "", **more: Any) -> Any:
    """A stage with the expected seconds of that title, or of another one; more: of the `Stage`."""

    def seconds(study: Any) -> float:
        from ..simulate_and_place.expected_seconds import seconds

        return seconds(study, of or title)

    return stage(title, seconds, **more)


def _visited(study: UnitMotion) -> list[float]:
    """Distinct pressures in kPa outward from 0, those above 0 first; 0 where weight acts without pressure."""
    found = [p for p in study.samples.distinct_kPa if p or study.effects.has_gravity]
    return sorted(found, key=lambda p: (p < 0, abs(p)))


def before(study: UnitMotion, pressure_kPa: float) -> list[float]:
    """Up to three pressures that a state starts from, the nearest last."""
    way = study.samples.outward(pressure_kPa)[:-1]
    return [*([0.0] if study.effects.has_gravity and pressure_kPa else []), *way][-3:]


def state_sought(study: UnitMotion, pressure_kPa: float) -> str:
    """A few words on a state that is being solved."""
    what = "self-contact" if study.self_contact and pressure_kPa < 0 else "equilibrium"
    return f"{what} at {pressure_kPa:.4g} kPa"


def state_message(state: fem.State) -> str:
    """A few words on a state."""
    return f"{state.pressure_kPa:.4g} kPa, residual {state.residual:.1e}, {state.iterations} iterations"


def _in_order(stages: Iterable[str]) -> tuple[str, ...]:
    return tuple(stages)


@attrs.frozen(kw_only=True, eq=False, slots=False)
class UnitMotion(Study):
    """A unit's design and motion; see `UnitStudy`."""

    file = "study"
    version = 4
    header = "# The inputs of this study; unit.toml and protocol.csv beside it belong to them."
    files = {
        "unit.stl": "printable unit without a sensor, mm",
        "unit_alpha[0-9]*.stl": "printable unit with that waveguide, mm",
        "anchors.txt": "lattice nodes and anchors, mm",
        "mesh.vtu": "analysis mesh with regions and moduli",
        "model_a.pvd": "motion without a sensor: displacement, stress and stretch of each sample (ParaView)",
        "model_a": "states of that motion",
        "motion.csv": "pressure, bending angle, tip and volume of the cavity over time",
        "angle.svg": "bending angle against pressure",
        "stretch.csv": "largest stretch of wall, struts and joints in every state, and how near to break",
        "self_contact.csv": "force, gap and largest pressure of the unit's contact with itself",
        "contact.csv": "contact force, penetration and slip on each obstacle over time",
        "unit.png": "the printable unit cut open",
        "motion": "displacement, stress and stretch of every state, with and without a sensor, for display",
    }

    stages: tuple[str, ...] = attrs.field(default=STAGES, converter=_in_order)
    unit: design.Unit = given(UnitInput(target="design", modelled=False))
    quality: str = setting(QUALITY, target="design")
    body: design.Body | None = given(BodyInput(group=AROUND), default=None)
    path: str = given(
        Input(
            "word",
            (
                described(
                    "path",
                    "",
                    "also build the unit with a waveguide along this path: alpha1, ...; empty: none",
                ),
            ),
            decides=False,
            metavar="NAME",
            target="design",
        ),
        default="",
        validator=attrs.validators.instance_of(str),
        converter=lambda name: name or "",
    )
    protocol: fem.Protocol = given(ProtocolInput(), factory=grasp)
    mesh: meshing.MeshSettings = given(
        Input("mesh", (REFINE,), metavar="F", target="simulate", value=lambda f: MeshSettings(refine=f)),
        factory=MeshSettings,
    )
    resin: str | None = asked(
        OnceInput,
        "wall_resin",
        "material of the wall: a name of the library or a material file, such as the material.toml of "
        "`fit-material`, in place of the unit's [material] and [wall]; empty: those of the unit",
        option="resin",
        metavar="NAME|FILE",
        group=AROUND,
        target="simulate",
    )
    effects: core.NamedEffects = given(EffectsInput(group=AROUND), factory=lambda: core.NamedEffects())
    obstacles: tuple[design.RigidBody, ...] = given(ObstaclesInput(group=AROUND), default=(), converter=tuple)
    times: int = setting(TIMES, metavar="K", target="simulate")
    under_pressure: bool = setting(UNDER_PRESSURE, target="simulate")
    # A command asks for it by default; of a call that does not name it, nothing slow is expected.
    self_contact: bool = given(
        Input("setting", (SELF_CONTACT,), target="simulate"),
        default=False,
        converter=SELF_CONTACT.checked,
    )
    self_friction: float = setting(SELF_FRICTION, metavar="MU", target="simulate")
    device: str = given(
        Input("setting", (DEVICE,), decides=False, metavar="cpu|cuda:0", target="simulate"),
        default=DEVICE.default,
        validator=known_device,
    )
    workers: int = setting(WORKERS, decides=False, metavar="N", target="simulate")

    def __attrs_post_init__(self) -> None:
        if self.path:
            # An unknown one must be found before the solid is built.
            design.window(self.unit, self.path)
        for refused, what, where, remedy in self.refusals():
            if refused:
                raise InputError(what, where, remedy)

    def refusals(self) -> Iterator[tuple[bool, str, str, str]]:
        """Pairs of settings that exclude each other: True if both are given, then what, where and remedy."""
        yield (
            bool(self.self_friction) and not self.self_contact,
            "friction between walls and struts needs self-contact",
            "--self-friction",
            "also give --self-contact, or leave it out",
        )
        for name in ("anisotropy", "strain_stiffening"):
            yield (
                bool(self.unit.wall.names) and name in self.effects.values,
                f"{name} changes a neo-Hookean wall, and this unit's has a law of its own",
                f"[wall], {name}",
                "leave [wall] out, or the effect and give the wall layers_excess or c2_over_c1",
            )
        simulates = "simulate" in self.stages
        yield (
            simulates and self.under_pressure and not self.driven.pressure_kPa.any(),
            "the protocol has no pressure above 0, and its suction is left out",
            "--quick, protocol",
            "rank with suction, or give a protocol with pressure",
        )
        yield (
            simulates and not self.samples.pressure_kPa.any(),
            f"none of the {self.times} samples of the protocol has a pressure other than 0",
            "times",
            "give more samples, or a protocol that leaves 0 kPa",
        )

    # What follows from the inputs.

    @property
    def anchors(self) -> Any:
        """P1..Pn in mm, (n, 3)."""
        return design.anchor_points(self.unit)

    @property
    def driven(self) -> fem.Protocol:
        """The protocol that is solved: without suction if that is left out."""
        return self.protocol.under_pressure() if self.under_pressure else self.protocol

    @cached_property
    def samples(self) -> core.Samples:
        """Instants at which the protocol is solved."""
        return core.Samples.of(self.driven, self.times, self.effects)

    @cached_property
    def mechanics(self) -> core.Mechanics:
        """How the unit is simulated."""
        return core.Mechanics(
            self.unit,
            self.body,
            self.obstacles,
            self.effects,
            self.self_contact,
            self.self_friction,
            self.device,
        )

    @property
    def in_time(self) -> bool:
        """True if motion is solved instant by instant."""
        return self.mechanics.in_time

    @property
    def has_history(self) -> bool:
        """True if the way back differs from the way there."""
        return self.in_time or self.effects.in_time

    @property
    def has_memory(self) -> bool:
        """True if the wall's law has memory: its mesh has no beams."""
        return self.unit.wall.has_memory

    @property
    def shape(self) -> design.Unit:
        """The unit that is meshed: material and name do not change a mesh."""
        from ..design.parameters import Material
        from ..design.wall_material import Wall

        return attrs.evolve(self.unit, name="shape", material=Material(), wall=Wall())

    @property
    def meshed_as(self) -> meshing.MeshSettings:
        """Settings of the mesh."""
        return self.mechanics.mesh_settings(self.mesh)

    @property
    def processes(self) -> int:
        """Number of processes; a motion instant by instant is one chain, and its paths are not."""
        return self.workers if "simulate" in self.stages else 1

    def bytes_needed(self) -> int:
        """Room that a run takes on the disk at most."""
        from ..simulate_and_place.expected_seconds import expected_bytes

        return expected_bytes(self)

    @property
    def report_s(self) -> float:
        """Expected seconds of the report."""
        return 14.0 if "simulate" in self.stages else 7.0

    # Design.

    @timed("solid", kept=False)
    def solid(self, unit: design.Unit, quality: str, body: design.Body | None) -> design.Solid:
        """The printable unit without a sensor."""
        return design.build_solid(unit, None, quality, body)

    @timed(
        "solid with {path}",
        "solid with the best path",
        over=Over(("path",), lambda study: [study.path]),
        wanted=lambda study: bool(study.path),
        kept=False,
    )
    def solid_asked(
        self, path: str, unit: design.Unit, quality: str, body: design.Body | None
    ) -> design.Solid:
        """The printable unit with the waveguide that was asked for."""
        return design.build_solid(unit, design.window(unit, path), quality, body)

    # Motion.

    @timed("mesh", wanted=wants("simulate"))
    def meshed(
        self,
        shape: design.Unit,
        has_memory: bool,
        meshed_as: meshing.MeshSettings,
        body: design.Body | None,
        tell: Tell,
    ) -> meshing.Mesh:
        """The analysis mesh; cells of some lattices have no seed, so that it is kept."""
        from ..body import mesh_printed

        found = mesh_printed(
            shape, meshed_as, lambda _, share: tell(share), tell.cache, body, solid=has_memory
        )
        tell.made(f"{len(found.nodes)} nodes and {len(found.tets)} elements")
        return found

    @timed("mesh", wanted=wants("simulate"))
    def mesh_quality(
        self, meshed: meshing.Mesh, unit: design.Unit, body: design.Body | None
    ) -> meshing.Quality:
        """The mesh against the design."""
        from ..body.lattice import strut_volume_mm3

        return meshing.mesh_quality(meshed, unit, strut_volume_mm3(unit, body))

    @intermediate()
    def equilibrium(self, meshed: meshing.Mesh, mechanics: core.Mechanics) -> fem.Equilibrium:
        """Solver of the unit without a sensor."""
        return mechanics.equilibrium(meshed)

    @timed(
        "Model A",
        over=Over(
            ("pressure_kPa",), _visited, needs=lambda study, pressure: {"states": before(study, pressure)}
        ),
        wanted=wants("simulate", in_time=False),
        parallel=True,
        says=state_message,
        doing=state_sought,
    )
    def states(self, pressure_kPa: float, states: Members, equilibrium: fem.Equilibrium) -> fem.State:
        """The state at a pressure, from those before it on the same side of rest."""
        return core.state_after(equilibrium, pressure_kPa, [*states.values()])

    @timed("Model A", wanted=wants("simulate", in_time=True), kept=False)
    def instants(
        self, equilibrium: fem.Equilibrium, mechanics: core.Mechanics, samples: core.Samples, tell: Tell
    ) -> core.InTime:
        """The motion instant by instant, each kept as soon as it is found."""
        from ..run.cache import Cache

        return core.solve_in_time(mechanics, equilibrium, samples, Cache(tell.cache), tell)

    @intermediate()
    def motion(
        self,
        meshed: meshing.Mesh,
        samples: core.Samples,
        states: Members | None = None,
        instants: core.InTime | None = None,
    ) -> fem.Trajectory:
        """Model A's motion to its end; raises the error that ended it early."""
        if instants is None:
            return core.motion_of(meshed, samples, states or {})
        if instants.error is not None:
            raise instants.error
        return core.motion_in_time(meshed, samples, instants)

    @timed("Model A", wanted=wants("simulate"))
    def motion_tables(
        self,
        motion: fem.Trajectory,
        mechanics: core.Mechanics,
        in_time: bool,
        tell: Tell,
    ) -> core.MotionTables:
        """Stretch of every state, and walls that pass through each other."""
        return core.tables_of(mechanics, motion, tell.cache)

    @timed("Model A", wanted=wants("simulate"), kept=False)
    def fields(
        self,
        motion: fem.Trajectory,
        mechanics: core.Mechanics,
        instants: core.InTime | None = None,
    ) -> core.StateFields:
        """Stress, stretch and pressure of contact of every state, for display."""
        return core.state_fields(mechanics, motion, instants)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the unit."""
        d = self.unit.dimensions
        return (
            f"Monolithic Unit {self.unit.name}",
            f"Monolithic Unit, scale {d.scale:g}, cell {d.cell:g} mm, {d.count} chambers",
        )

    @section()
    def asked(self) -> Iterator[Part]:
        """The inputs, in the summary."""
        yield recorded("parameters", attrs.asdict(self.unit))
        if self.body is not None:
            low, high = self.body.bounds.tolist()
            box = {"low_mm": low, "high_mm": high, "triangles": len(self.body.triangles)}
            yield recorded("body", box)
        if "simulate" not in self.stages:
            return
        stations = {"stations": self.stations} if "place" in self.stages else {}  # type: ignore[attr-defined]
        asked = {"times": self.times, "mesh": attrs.asdict(self.mesh), **stations, **self.effects.tables}
        for name, value in asked.items():
            yield recorded(f"study.{name}", value)
        for words in core.doubts_of_protocol(self.driven, self.samples):
            yield Warn(words)

    @section()
    def printed(
        self,
        solid: design.Solid,
        solid_asked: Members | None = None,
        solid_best: design.Solid | None = None,
        chosen: str | None = None,
    ) -> Iterator[Part]:
        """Files of the printable unit, with and without a sensor, and its size."""
        import numpy as np

        from ..design.stl_and_nodes import nodes_text
        from ..materials.library import load_material

        every = {"unit.stl": solid}
        every |= {f"unit_{path}.stl": found for path, found in (solid_asked or {}).items()}
        every |= {f"unit_{chosen}.stl": solid_best} if solid_best is not None and chosen else {}
        for name, one in every.items():
            yield File(name, partial(_stl, one), of=(one.vertices, one.triangles))
        yield File("anchors.txt", lambda path: nodes_text(self.unit), of=self.unit)
        gates = {
            n: {**attrs.asdict(s.gates), "inner_volume_error": s.gates.inner_volume_error}
            for n, s in every.items()
        }
        yield recorded("gates", gates)
        resin = load_material(USUAL_RESIN)
        size, ml, g = (
            np.ptp(solid.vertices, axis=0),
            solid.volume_mm3 / 1e3,
            solid.mass_g(resin.density_g_per_ml),
        )
        yield recorded("solid", {"size_mm": size, "ml": ml, "g": g, "resin": resin.name})
        sides = " x ".join(f"{mm:.1f}" for mm in size)
        words = f"solid: {sides} mm, {ml:.1f} ml, {g:.1f} g of {resin.name}"
        yield Sentence(words, terminal=True, page=False)

    @section("motion", "Motion of the unit")
    def moved(
        self,
        meshed: meshing.Mesh,
        samples: core.Samples,
        states: Members | None = None,
        instants: core.InTime | None = None,
    ) -> Iterator[Part]:
        """Angle against pressure, of the states that there are."""
        reached = self.reached(meshed, states, instants)
        if not reached.instants:
            return
        head, rows = reached.rows(meshed, self.effects.in_time)
        texts = [(f"{t:.9g}", *(f"{v:.6g}" for v in row)) for t, *row in rows]
        yield csv("motion.csv", head, texts)
        angles = core.angles_of(rows)
        yield recorded("angle_deg", angles)
        ends = sorted((float(p), a) for p, a in angles.items())
        # Without a sign on what rounds to nothing.
        shown = ", ".join(f"{round(a, 1) + 0.0:+.1f} deg at {p:g} kPa" for p, a in (ends[0], ends[-1]))
        yield Sentence(f"angle: {shown}", terminal=True, page=False)
        if not (states or instants).complete:  # type: ignore[union-attr]
            yield from core.unfinished_motion_parts(self, meshed, reached, instants)
        yield from core.motion_parts(self, meshed, reached)

    def reached(
        self, meshed: meshing.Mesh, states: Members | None, instants: core.InTime | None
    ) -> core.Reached:
        """The instants that the motion has reached so far."""
        return core.reached_of(
            meshed, self.samples, states, instants, self.effects.has_gravity, self.effects.in_time
        )

    @section("motion", "Motion of the unit")
    def finished(
        self,
        motion: fem.Trajectory,
        motion_tables: core.MotionTables,
        fields: core.StateFields,
        instants: core.InTime | None = None,
    ) -> Iterator[Part]:
        """The whole motion: files for display, stretch, contact of the unit with itself, doubts."""
        yield from core.finished_motion_parts(self, motion, motion_tables, fields, instants)

    @section("contact", "Contact with obstacles")
    def met(self, instants: core.InTime) -> Iterator[Part]:
        """Forces on obstacles."""
        if instants.contact is not None:
            yield from core.contact_parts(instants.contact)

    @section("mesh", "Solid, mesh and solver", order=2)
    def built(
        self,
        solid: design.Solid,
        meshed: meshing.Mesh | None = None,
        mesh_quality: meshing.Quality | None = None,
    ) -> Iterator[Part]:
        """Checks of the solid, and figures of the mesh."""
        yield from core.built_parts(self, solid, meshed, mesh_quality)

    @section("assumed", "Assumptions", order=2)
    def assumed(self) -> Iterator[Part]:
        """Values that the paper does not give."""
        yield from core.assumption_parts(self)

    @section("parameters", "All parameters", order=2)
    def parameters(self) -> Iterator[Part]:
        """Every parameter with its source."""
        yield core.parameter_table(self)


def _stl(solid: design.Solid, path: Path) -> None:
    design.write_stl(solid, path)
