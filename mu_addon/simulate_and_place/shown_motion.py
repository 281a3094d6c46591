"""What a study shows of a unit's solid and motion: parts of its report, terminal, summary and files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import assumed, stated
from ..fem.bending_angle import TipSection
from ..fem.state import State
from ..fem.trajectory import Trajectory
from ..meshing.mesh import Mesh
from ..report import heatmaps, plots
from ..report.motion_files import CONTACT_PRESSURE, FOLDER, REGIONS, write_model_a
from ..report.results import (
    CONTACT_COLUMNS,
    SELF_CONTACT_COLUMNS,
    STRETCH_COLUMNS,
    ContactHistory,
    Picture,
    nearest_to_break,
)
from ..report.vtk import write_mesh, write_trajectory
from ..run.parts import Beside, Chart, File, Part, Pictures, Sentence, Table, Warn, csv, listed, recorded
from .charts import ANGLE, angle_picture
from .model_a import InTime
from .motion import MotionTables, StateFields, state_fields
from .motion_checks import snaps, walls_cross, would_tear
from .motion_tables import Reached
from .named_effects import parameters_of

if TYPE_CHECKING:
    from ..design.solid import Solid
    from ..meshing.quality import Quality


def motion_parts(study: Any, mesh: Mesh, reached: Reached) -> Iterator[Part]:
    """Charts of the angle and of the protocol, and pictures of the unit at its extremes."""
    effects = [*study.effects.words(), *_turned(study)]
    if effects:
        yield Sentence(f"With the effects identified from measured data: {'; '.join(effects)}.")
    tip, states = TipSection.of(mesh), reached.in_order
    pressure = np.array([p for p, _ in states])
    angle = np.array([tip.angle_deg(s.u) for _, s in states])
    low, high = float(pressure.min()), float(pressure.max())
    why = (
        "friction causes hysteresis"
        if study.obstacles or study.self_friction
        else "it depends on the history"
    )
    yield Beside(
        [
            Chart(
                partial(plots.angle_against_pressure, pressure, angle),
                "Bending angle of the tip relative to the base, without a sensor; each dot is a converged "
                "state" + (f", in order of time: {why}." if reached.in_time else "."),
                f"Bending angle against pressure from {low:g} to {high:g} kPa.",
                file="angle.svg",
            ),
            Chart(
                partial(plots.protocol, study.samples.time_s, study.samples.supplied_kPa),
                "Pressure protocol; dots: times at which the paths are compared.",
                "Pressure against time.",
            ),
        ]
    )
    yield Pictures(partial(_of_extremes, study, mesh, [s for _, s in states]))
    yield Pictures(lambda: [(f"{FOLDER}/{ANGLE}", angle_picture(pressure, angle))], shown=False)


def _turned(study: Any) -> list[str]:
    if not study.effects.has_gravity:
        return []
    return [f"gravity turned {study.effects.orientation_deg:g}° about x, 0 being the tip down"]


def _of_extremes(study: Any, mesh: Mesh, states: list[State]) -> list[tuple[str, Picture]]:
    """The unit at the least pressure, at rest and at the largest."""
    from ..report.unit_pictures import motion

    tip, ordered = TipSection.of(mesh), sorted(states, key=lambda s: s.pressure_MPa)
    shown = [ordered[0], min(ordered, key=lambda s: abs(s.pressure_MPa)), ordered[-1]]
    texts = []
    for state in {s.pressure_MPa: s for s in shown}.values():
        words = f"{state.pressure_kPa:g} kPa: {tip.angle_deg(state.u) + 0.0:.1f}°"
        texts.append((state.u, words, f"The analysis mesh at {words}."))
    return [("", picture) for picture in motion(mesh, texts, beside=study.obstacles)]


def states_file(
    mesh: Mesh, instants: Sequence[tuple[float, State]], fields: StateFields | None = None
) -> File:
    """model_a.pvd: states with their times in s for ParaView; fields: of each state, in order."""
    every = [*dict.fromkeys(state for _, state in instants)]
    of = {} if fields is None else dict(zip(every, fields.of_elements, strict=True))

    def write(path: Path) -> None:
        write_trajectory(path, mesh, instants, lambda state: of.get(state, {}))

    return File("model_a.pvd", write, of=(fields is None, *(s.u for s in every)))


def unfinished_motion_parts(
    study: Any, mesh: Mesh, reached: Reached, instants: InTime | None
) -> Iterator[Part]:
    """Files of the states that there are: what is seen at other instants is the nearest one in time."""
    times, _, states = zip(*reached.instants, strict=True)
    yield states_file(mesh, list(zip(times, states, strict=True)))
    samples, solved = study.samples, tuple(dict.fromkeys(states))
    nearest = np.abs(samples.time_s[:, None] - np.array(times)).argmin(axis=1)
    index = np.array([solved.index(states[n]) for n in nearest])
    motion = Trajectory(samples.time_s, samples.supplied_kPa, solved, index, mesh)
    fields = partial(state_fields, study.mechanics, motion, instants)
    yield _display_file(study, motion, fields, np.isin(samples.time_s, times))


def _display_file(
    study: Any, motion: Trajectory, fields: Callable[[], StateFields], reached: Array | None = None
) -> File:
    """The folder `motion`; reached: of a motion without all of its states, see `report.motion_files`."""

    def write(path: Path) -> None:
        found = fields()
        write_model_a(
            path.parent,
            motion.mesh,
            study.mechanics.materials(motion.mesh),
            motion,
            contact_kPa=found.itself.pressure_kPa,
            fields=found.surface,
            surfaces=found.surfaces,
            reached=reached,
        )

    return File(FOLDER, write, of=(reached is None, *(state.u for state in motion.solved)))


def finished_motion_parts(
    study: Any,
    motion: Trajectory,
    tables: MotionTables,
    fields: StateFields,
    instants: InTime | None,
) -> Iterator[Part]:
    """Files, tables and doubts of a whole motion."""
    mesh, states = motion.mesh, motion.solved
    supplied = attrs.evolve(motion, pressure_kPa=study.samples.supplied_kPa)
    yield _display_file(study, supplied, lambda: fields)
    of = dict(zip(states, fields.of_elements, strict=True))
    instants_shown = list(zip(motion.time_s.tolist(), motion.states, strict=True))
    shown = attrs.evolve(fields, of_elements=tuple(of[one] for one in dict.fromkeys(motion.states)))
    yield states_file(mesh, instants_shown, shown)
    yield csv("stretch.csv", STRETCH_COLUMNS, tables.stretch)
    most = nearest_to_break(tables.stretch)
    yield recorded("nearest_to_break", most)
    solved = [s for s in states if s.loaded]
    yield recorded(
        "solver",
        {
            "method": tables.solver,
            "device": study.device,
            "unknowns": tables.unknowns,
            "states": len(solved),
            "newton_iterations": sum(s.iterations for s in solved),
            "factorisations": sum(s.factorisations for s in solved),
            "largest_relative_residual": max((s.residual for s in solved), default=0.0),
        },
    )
    yield recorded("walls_cross_at_kPa", {p: list(walls) for p, walls in tables.walls_cross.items()})
    yield from map(Warn, walls_cross(tables.walls_cross))
    yield from map(Warn, snaps(states, study.in_time))
    elongation = study.unit.material.elongation_at_break
    if words := would_tear(most, elongation):
        yield Warn(words)
    yield from _stretch(tables, most, elongation, partial(_painted, motion, fields, "largest_stretch", 1.0))
    yield from _self_contact(study, motion, fields, instants)


def _stretch(tables: MotionTables, most: Mapping[str, Any], elongation: float, paint: Any) -> Iterator[Part]:
    """Stretch of wall and lattice: painted on the extreme states, and in numbers for all."""
    yield Sentence("Stretch", heading=True)
    yield paint(0.01, "stretch", "largest principal stretch")
    if most:
        place = ", ".join(f"{x:.2f}" for x in most["place_mm"])
        yield Sentence(
            f"Nearest to tearing: the {most['part']} at {most['pressure_kPa']:g} kPa, near ({place}) mm, at "
            f"{most['percent']:.3g} % of the resin's elongation at break, {100 * elongation:g} %."
        )
    columns = ["largest stretch", "x [mm]", "y [mm]", "z [mm]", "1 % exceeds", "of elongation at break [%]"]
    yield Table(
        "Largest principal stretch of each part without a sensor, and where it is at rest; the stretch "
        "that 1 % of the part's volume, or of the joints, exceeds; its share of elongation at break. Largest "
        "values depend on the mesh where a strut meets a wall. Joints: by the loads on their struts' ends.",
        [("pressure [kPa]", "n"), ("part", ""), *((name, "n") for name in columns)],
        [_signed(row, 1) for row in tables.stretch],
    )


def _signed(row: tuple[str, ...], text: int = -1) -> list[str]:
    """Cells with true minus signs; text: number of a column of words, which keep their hyphens."""
    return [cell if n == text else plots.signed(cell) for n, cell in enumerate(row)]


def _self_contact(
    study: Any, motion: Trajectory, fields: StateFields, instants: InTime | None
) -> Iterator[Part]:
    """Self-contact of walls and struts: painted on the extreme states, and in numbers for all."""
    rows = fields.itself.rows
    if not rows:
        return
    yield csv("self_contact.csv", SELF_CONTACT_COLUMNS, rows)
    if study.self_friction and instants is not None:
        lost = {"coefficient": study.self_friction, "lost_mJ": instants.lost_mJ}
        yield recorded("self_friction", lost)
    yield Sentence("Self-contact", heading=True)
    if not any(row[2] for row in rows):
        yield Sentence("No wall or strut touches another at these pressures.")
        return
    yield _painted(motion, fields, CONTACT_PRESSURE, 0.0, 1.0, "contact pressure", "contact pressure [kPa]")
    if study.self_friction and instants is not None:
        yield Sentence(
            f"They slide on each other with a coefficient of friction of {study.self_friction:g}, which "
            f"dissipates {instants.lost_mJ:.3g} mJ over the protocol."
        )
    columns = ["force [N]", "least gap [mm]", "largest contact pressure [kPa]", "x [mm]", "y [mm]", "z [mm]"]
    yield Table(
        "Contact force between walls and struts without a sensor, their least gap, and the position "
        "at rest of the largest pressure; at a single node it depends on the mesh.",
        [("pressure [kPa]", "n"), *((name, "n") for name in columns)],
        [_signed(row) for row in rows],
    )


def _painted(
    motion: Trajectory,
    fields: StateFields,
    field: str,
    low: float,
    least: float,
    word: str,
    scale: str,
) -> Pictures:
    """The states of least and largest pressure painted by a field from `low` on.

    least: smallest extent of the scale above `low`; word, scale: name of the field, and that of its scale.
    """
    found: dict[str, Any] = {}

    def values() -> dict[str, Array]:
        by_region = {r: fields.surface[f"{r}_{field}"] for r in REGIONS if f"{r}_{field}" in fields.surface}
        if field == CONTACT_PRESSURE:
            contact = fields.itself.pressure_kPa
            by_region = {r: np.array([p[fields.surfaces[r].node] for p in contact]) for r in REGIONS}
        return by_region

    def look() -> dict[str, Any]:
        if not found:
            every = values()
            pressure = [s.pressure_MPa for s in motion.solved]
            ends = dict.fromkeys((int(np.argmin(pressure)), int(np.argmax(pressure))))
            shown = [k for k in ends if motion.solved[k].loaded]
            shown = [k for k in shown if any((v[k] > low).any() for v in every.values())]
            flat = np.concatenate([v[shown].ravel() for v in every.values()]) if shown else np.zeros(1)
            # Single nodes where a strut meets the wall are no reason to darken the rest.
            above = flat[flat > low]
            top = max(low + least, float(np.quantile(above, 0.999)) if len(above) else low)
            found.update(every=every, shown=shown, top=top)
        return found

    def make() -> list[tuple[str, Picture]]:
        from ..report.unit_pictures import motion as pictures

        one, outside = look(), field == CONTACT_PRESSURE
        texts, colors = [], []
        for k in one["shown"]:
            words = f"{motion.solved[k].pressure_kPa:g} kPa"
            alt = f"The deformed unit at {words}, coloured by {word}."
            texts.append((motion.solved[k].u, words, alt))
            by_region = {}
            # Struts would hide the creases where walls meet.
            for name in ("membrane",) if outside else REGIONS:
                painted = np.ones((len(motion.mesh.nodes), 3))
                painted[fields.surfaces[name].node] = heatmaps.field_colors(
                    one["every"][name][k], low, one["top"]
                )
                by_region[REGIONS[name]] = painted
            colors.append(by_region)
        if not texts:
            return []
        return [("", one) for one in pictures(motion.mesh, texts, colors=colors, outside=outside)]

    bar = Chart(
        lambda: heatmaps.field_bar(low, look()["top"], scale), "", f"Colour scale of the {scale}.", kind="bar"
    )
    return Pictures(make, scale=bar)


def contact_parts(c: ContactHistory) -> Iterator[Part]:
    """Contact with rigid obstacles."""
    yield csv("contact.csv", CONTACT_COLUMNS, c.rows())
    yield recorded("contact", c.summary())
    if not c.force_N.any():
        yield Sentence(f"The unit does not touch {listed(c.names)}.")
        return
    yield Sentence(
        "The obstacles are rigid and fixed, with Coulomb friction. Gap error: largest penetration of the "
        "unit into an obstacle, which the penalty method admits."
    )
    rows, charts = [], []
    for b, name in enumerate(c.names):
        k = int(c.force_N[b].argmax())
        rows.append(
            [
                name,
                f"{c.friction[b]:g}",
                f"{c.force_N[b, k]:.3g}",
                plots.signed(f"{c.time_s[k]:g} s, {c.pressure_kPa[k]:g} kPa"),
                f"{c.deepest_mm[b].max():.2g}",
                f"{c.slid_mm[b].max():.2g}",
                f"{c.lost_mJ[b].max():.2g}",
            ]
        )
        if c.force_N[b].any():
            sizes = [np.linalg.norm(force[b], axis=1) for force in (c.normal_N, c.tangential_N)]
            chart = partial(plots.contact_force, c.time_s, *sizes)
            alt = f"Normal force and friction on {name} over time."
            charts.append(Chart(chart, f"Force of the unit on {name}.", alt))
    columns = ["friction", "largest force [N]", "when", "gap error [mm]", "slip [mm]", "dissipated [mJ]"]
    yield Table("Obstacles", [("obstacle", ""), *((name, "n") for name in columns)], rows)
    yield Beside(charts)


def built_parts(study: Any, solid: Solid, mesh: Mesh | None, quality: Quality | None) -> Iterator[Part]:
    """Checks of the solid, and figures of the mesh."""
    # A solid exists only if every gate passed; see design.gates.
    g = solid.gates
    gates = [
        ("genus of the bare lattice", g.lattice_genus, f"E − V + 1 = {g.lattice_genus_expected}"),
        ("components", g.components, "1"),
        ("open edges after reading the STL back", g.bad_edges_after_stl, "0"),
        ("inner shells with the inlet plugged", g.inner_shells, "1"),
        ("cavity's volume against its formula [%]", round(100 * g.inner_volume_error, 3), "within 1"),
        ("volume of resin [mm³]", round(g.volume_mm3, 1), "reported"),
    ]
    yield Table(
        "Checks of the printable solid, after reading its file back.",
        [("check", "text"), ("found", "n"), ("asked", "ask"), ("result", "")],
        [[*gate, "passed"] for gate in gates],
        stacked=True,
    )
    if mesh is None:
        return
    modulus, _ = study.mechanics.materials(mesh).small_strain(len(mesh.tets))
    yield File("mesh.vtu", lambda path: write_mesh(path, mesh, modulus), of=(mesh, modulus))
    own = {"beams": len(mesh.beams), "hash": mesh.hash()}
    if quality is not None:
        yield recorded("mesh", {**attrs.asdict(quality), **own})
        rows = [[name.replace("_", " "), value] for name, value in attrs.asdict(quality).items()]
        yield Table("", [("mesh", ""), ("", "n")], rows)


def assumption_parts(study: Any) -> Iterator[Part]:
    """Values that the paper does not give, on which the results depend."""
    rows = [
        [path, value, unit, source] for path, value, unit, source, is_assumed in _rows(study) if is_assumed
    ]
    yield Sentence("The paper does not give these values. The results depend on them.")
    head = [("parameter", ""), ("value", "n"), ("unit", ""), ("why", "text")]
    yield Table("", head, rows, stacked=True)


def parameter_table(study: Any) -> Table:
    """Every parameter, and its source."""
    rows = [
        [path, value, unit, "assumed" if is_assumed else source]
        for path, value, unit, source, is_assumed in _rows(study)
    ]
    head = [("parameter", ""), ("value", "n"), ("unit", ""), ("source", "text")]
    return Table("", head, rows, stacked=True)


def _rows(study: Any) -> list[tuple[str, Any, str, str, bool]]:
    """Path, value, unit, source, and True if the value is assumed, of every parameter."""
    reasons = {a.path: a.reason for a in assumed(study.unit)}
    rows: list[tuple[str, Any, str, str, bool]] = [("scale", study.unit.scale, "", "paper", False)]
    for section, d, value in stated(study.unit):
        path = f"{section}.{d.name}"
        rows.append((path, value, d.unit, reasons.get(path, d.source), d.assumed))
    effects = study.effects
    for (name, given), words in zip(effects.values.items(), effects.words(), strict=True):
        for p in parameters_of(name, given) or ():
            source = f"the model given: {words}"
            rows.append((f"effects.{name}.{p.name}", given[p.name], p.unit, source, False))
    if effects.has_gravity:
        source = "given by the user; 0: hanging, tip down"
        rows.append(("orientation", effects.orientation_deg, "deg", source, False))
    rows.append(("study.times", study.times, "", "samples of the protocol; the paper gives none", True))
    source = "stations along the backbone; the paper gives none"
    rows.append(("study.stations", study.stations, "", source, True))
    rows.append(("mesh.refine", study.mesh.refine, "", "divides every element size", False))
    source = "between the paper's pressures; it gives no times"
    rows.append(("protocol", "protocol.csv", "", source, True))
    return rows
