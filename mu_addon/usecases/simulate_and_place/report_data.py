"""Data of a study's report, of all finished stages."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design.parameters import assumed, stated
from ...errors import InputError
from ...files import plain, write_bytes, write_text
from ...report.motion_files import CONTACT_PRESSURE, REGIONS, read_motion
from ...report.results import (
    Gate,
    PaintedStates,
    Parameter,
    Path,
    Picture,
    RankingResult,
    ReportData,
    SideView,
)
from ...report.stopped import NO_PICTURES
from ...run.cache import key
from ...run.versions import package_versions
from .named_effects import parameters_of

if TYPE_CHECKING:
    from .named_effects import NamedEffects
    from .study import Study

FILES = {
    "study.toml": "inputs of this run",
    "unit.toml": "parameters of the unit",
    "protocol.csv": "pressure protocol",
    "obstacles.obj": "rigid obstacles, mm",
    "unit.stl": "printable unit without a sensor, mm",
    "anchors.txt": "lattice nodes and anchors, mm",
    "mesh.vtu": "analysis mesh with regions and moduli",
    "model_a.pvd": "motion without a sensor: displacement, stress and stretch of each sample (ParaView)",
    "motion.csv": "pressure, bending angle, tip and volume of the cavity over time",
    "angle.svg": "bending angle against pressure",
    "stretch.csv": "largest stretch of wall, struts and joints in every state, and how near to break",
    "self_contact.csv": "force, gap and largest pressure of the unit's contact with itself in every state",
    "contact.csv": "contact force, penetration and slip on each obstacle over time",
    "deviation.csv": "deviation and rank of every path, its mesh uncertainty and ties",
    "delta.npz": "deviation over time and length of every path, mm",
    "sensitivity.vtu": "sensitivity of the deviation to the stiffness of each element, mm (ParaView)",
    "signals.csv": "light signal of each path, and its deviation",
    "paths.csv": "every path of the lattice: length, predicted and, where it was solved, exact deviation",
    "motion": "displacement, stress and stretch of every state, with and without a sensor, for display",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}


def write_report(study: Study, stopped: str = "") -> None:
    """Write report.html (and unit.png); `stopped`: why an incomplete study stopped.

    Pictures take most of the time: a run that was asked to stop leaves them out. An existing report on the
    same figures, or on more stages from the same inputs, is kept.
    """
    from .report import write_html

    summary, figures = study.context.summary, _figures(study)
    same = summary.get("report_of") == figures and not stopped
    if (study.has_more or same) and (study.folder / "report.html").is_file():
        return
    summary.pop("report_of", None)
    with study.progress.stage("report"):
        versions = package_versions()
        view, pictures = _pictures(study)
        if pictures:
            write_bytes(study.folder / "unit.png", pictures[0].png)
        _panel_pictures(study)
        study.progress.update(0.75)
        data = report_data(study, view, pictures, versions, stopped, _search_picture(study))
        study.progress.update(0.9)
        write_html(study.folder / "report.html", data)
    if not stopped:
        summary["report_of"] = figures


# Of a summary what no report shows, or differs each time.
_NOT_SHOWN = ("seconds", "options", "status", "report_of")


def _figures(study: Study) -> str:
    """Hash of the figures that a report shows: those of summary.json, with the versions of the packages."""
    shown = {name: value for name, value in study.context.summary.items() if name not in _NOT_SHOWN}
    return key(json.dumps(plain(shown), sort_keys=True), study.job.text())


def _panel_pictures(study: Study) -> None:
    """Write pictures of the study's results for panels, into its folder of the motion."""
    from ...report.plots import angle_against_pressure
    from .charts import write_angle, write_delta

    if study.trajectory is None or study.mesh is None or study.context.hurried:
        return
    write_angle(study.folder, *study.motion_in_order())
    write_text(study.folder / "angle.svg", angle_against_pressure(*study.motion_in_order()))
    found = study.ranking.evaluations.values()
    top = max((float(np.nanmax(e.deviation.delta)) for e in found), default=0.0)
    for e in found:
        write_delta(study.folder, e.name, e.deviation.delta, study.trajectory.time_s, top)


def _of_model(study: Study) -> list[str]:
    """Changes that an extended model made to the unit, and those that were left out, as text."""
    model = study.context.summary.get("model", {})
    doubt = model.get("doubt")
    return [
        *([f"The extended model's {doubt}."] if doubt else []),
        *(f"Applied from the extended model: {words}." for words in model.get("applied", ())),
        *(f"Not applied from the extended model: {words}." for words in model.get("left_out", ())),
    ]


def report_data(
    study: Study,
    view: SideView | None,
    pictures: list[Picture],
    versions: dict[str, str],
    stopped: str = "",
    search_picture: Picture | None = None,
) -> ReportData:
    """Data of the report of a study, complete or stopped early for a reason."""
    job, d = study.job, study.job.unit.dimensions
    windows = study.windows
    known = {**study.ranking.evaluations, **study.ranking.at_least_mm}
    complete = all(w.name in known for w in windows)
    moved_kPa, angle_deg = study.motion_in_order()
    ranking = _ranking(study) if complete else None
    return ReportData(
        title=f"Sensor path for {job.unit.name}" if ranking else f"Monolithic Unit {job.unit.name}",
        unit=f"Monolithic Unit, scale {d.scale:g}, cell {d.cell:g} mm, {d.count} chambers",
        status="partial" if stopped else "complete",
        reason=stopped,
        warnings=(*study.warnings, *_of_model(study), *([NO_PICTURES] if study.context.hurried else [])),
        view=view,
        pictures=tuple(pictures),
        paths=tuple(Path(w.name, w.start, w.length) for w in windows),
        ranking=ranking,
        left_out=study.context.summary.get("left_out", ""),
        estimated_mm={} if ranking else study.estimated_mm,
        search=study.search,
        search_picture=search_picture,
        light=study.light,
        contact=study.contact,
        stretch=tuple(study.stretch),
        elongation_at_break=job.unit.material.elongation_at_break,
        stretched=_painted(study, "largest_stretch", 1.0, 0.01, "stretch"),
        self_contact=tuple(study.self_contact),
        self_friction=study.context.summary.get("self_friction"),
        touched=_painted(study, CONTACT_PRESSURE, 0.0, 1.0, "contact pressure"),
        effects=tuple(_effect_words(job.effects)),
        pressure_kPa=moved_kPa,
        angle_deg=angle_deg,
        in_time=job.in_time or job.effects.in_time,
        protocol_s=job.samples[0] if len(moved_kPa) else np.zeros(0),
        protocol_kPa=job.supplied_kPa if len(moved_kPa) else np.zeros(0),
        parameters=_parameters(study),
        mesh=_mesh_figures(study),
        solver={name.replace("_", " "): value for name, value in study.solver.items()},
        gates=_gates(study),
        seconds=study.progress.seconds,
        versions=versions,
        files={n: what for n, what in _files(study).items() if (study.folder / n).exists()},
    )


def _ranking(study: Study) -> RankingResult:
    from ...placement.deviation import rank

    solved = study.ranking.evaluations
    found = [solved[w.name].deviation for w in study.windows if w.name in solved]
    j_hat = np.array([d.J_hat for d in found])
    return RankingResult(
        delta=np.array([d.delta for d in found]),
        j_hat=j_hat,
        j_cont=np.array([d.J_cont for d in found]),
        rank=[int(r) for r in rank(j_hat)],
        chosen=study.ranking.chosen,
        tied=study.ranking.tied,
        uncertainty_mm=study.ranking.uncertainty_mm,
        at_least_mm=study.ranking.at_least_mm,
    )


def _parameters(study: Study) -> list[Parameter]:
    unit = study.job.unit
    reasons = {a.path: a.reason for a in assumed(unit)}
    rows = [Parameter("scale", unit.scale, "", "paper")]
    for section, d, value in stated(unit):
        path = f"{section}.{d.name}"
        rows.append(Parameter(path, value, d.unit, reasons.get(path, d.source), d.assumed))
    rows += _effects(study.job.effects)
    m, k, j = study.job.mesh, study.job.times, study.job.stations
    rows += [
        Parameter("study.times", k, "", "samples of the protocol; the paper gives none", True),
        Parameter("study.stations", j, "", "stations along the backbone; the paper gives none", True),
        Parameter("mesh.refine", m.refine, "", "divides every element size"),
        Parameter("protocol", "protocol.csv", "", "between the paper's pressures; it gives no times", True),
    ]
    return rows


def _effect_words(effects: NamedEffects) -> list[str]:
    """Other effects on the unit, as text."""
    turned = (
        [f"gravity turned {effects.orientation_deg:g}° about x, 0 being the tip down"]
        if effects.has_gravity
        else []
    )
    return [*effects.words(), *turned]


def _effects(effects: NamedEffects) -> list[Parameter]:
    """Sizes of effects that are no parameters of the unit, and the direction of gravity if it matters."""
    rows = [
        Parameter(f"effects.{name}.{p.name}", given[p.name], p.unit, f"the model given: {words}")
        for (name, given), words in zip(effects.values.items(), effects.words(), strict=True)
        for p in parameters_of(name, given) or ()
    ]
    if effects.has_gravity:
        turned = Parameter(
            "orientation", effects.orientation_deg, "deg", "given by the user; 0: hanging, tip down"
        )
        rows.append(turned)
    return rows


def _gates(study: Study) -> list[Gate]:
    if study.solid is None:
        return []
    # A solid exists only if every gate passed; see design.gates.
    g = study.solid.gates
    return [
        Gate("genus of the bare lattice", g.lattice_genus, f"E − V + 1 = {g.lattice_genus_expected}", True),
        Gate("components", g.components, "1", True),
        Gate("open edges after reading the STL back", g.bad_edges_after_stl, "0", True),
        Gate("inner shells with the inlet plugged", g.inner_shells, "1", True),
        Gate(
            "cavity's volume against its formula [%]", round(100 * g.inner_volume_error, 3), "within 1", True
        ),
        Gate("volume of resin [mm³]", round(g.volume_mm3, 1), "reported", True),
    ]


def _mesh_figures(study: Study) -> dict[str, Any]:
    if study.quality is None:
        return {}
    return {name.replace("_", " "): value for name, value in attrs.asdict(study.quality).items()}


def _pictures(study: Study) -> tuple[SideView | None, list[Picture]]:
    from ...report.render import png
    from ...report.unit_pictures import motion, portrait, side_view, unit_parts

    if study.solid is None or study.context.hurried:
        return None, []
    d = study.job.unit.dimensions
    parts = unit_parts(d, study.solid.vertices, study.solid.triangles)
    name = study.context.summary.get("chosen")
    window = next((w for w in study.windows if w.name == name), None)
    path = study.anchors[list(window.indices)] if window else study.anchors[:0]
    radius = max(d.inclusion_radius, d.waveguide_section / 2)
    with_sensor = f", with the sensor along {name}" if window else ""
    pictures = [
        Picture(
            png(portrait(parts, study.anchors, path, radius)),
            f"The printable unit cut open{with_sensor}.",
            "Bellows of six chambers inside a lattice of struts, cut along the plane of bending.",
        )
    ]
    study.progress.update(0.25)
    if study.trajectory is not None and study.mesh is not None:
        states = sorted(study.trajectory.solved, key=lambda s: s.pressure_MPa)
        shown = [states[0], min(states, key=lambda s: abs(s.pressure_MPa)), states[-1]]
        shown = list({state.pressure_MPa: state for state in shown}.values())
        texts = []
        for state in shown:
            angle = study.bending_angle_deg(state.u) + 0.0
            words = f"{state.pressure_kPa:g} kPa: {angle:.1f}°"
            texts.append((state.u, words, f"The analysis mesh at {words}."))
        pictures += motion(study.mesh, texts, beside=study.job.obstacles)
    study.progress.update(0.5)
    view = side_view(parts, study.anchors, path, radius)
    study.progress.update(0.65)
    return view, pictures


def _painted(study: Study, field: str, low: float, least: float, word: str) -> PaintedStates | None:
    """The states of least and largest pressure painted by a field from `low` on; None without such a field.

    least: smallest extent of the scale above `low`; word: name of the field.
    """
    from ...report.heatmaps import field_colors
    from ...report.unit_pictures import motion

    if study.trajectory is None or study.context.hurried:
        return None
    try:
        played = read_motion(study.folder)
    except InputError:
        # It stopped before its motion was written.
        return None
    if any(field not in found for found in played.fields.values()):
        return None
    ends = int(played.state_kPa.argmin()), int(played.state_kPa.argmax())
    shown = [k for k in dict.fromkeys(ends) if study.trajectory.solved[k].loaded]
    painted = {name: played.fields[name][field] for name in REGIONS}
    shown = [k for k in shown if any((values[k] > low).any() for values in painted.values())]
    if not shown:
        return None
    # Single nodes where a strut meets the wall are no reason to darken the rest.
    every = np.concatenate([values[shown].ravel() for values in painted.values()])
    top = max(low + least, float(np.quantile(every[every > low], 0.999)))
    texts, colors = [], []
    outside = field == CONTACT_PRESSURE
    for k in shown:
        words = f"{played.state_kPa[k]:g} kPa"
        texts.append((played.model_a[k], words, f"The deformed unit at {words}, coloured by {word}."))
        by_region = {}
        # Struts would hide the creases where walls meet.
        for name in ("membrane",) if outside else REGIONS:
            region = REGIONS[name]
            by_region[region] = np.ones((len(played.mesh.nodes), 3))
            by_region[region][played.surfaces[name].node] = field_colors(painted[name][k], low, top)
        colors.append(by_region)
    return PaintedStates(motion(played.mesh, texts, colors=colors, outside=outside), top)


def _search_picture(study: Study) -> Picture | None:
    """Picture of the lattice's best path in the unit cut open, on the side where it is in view."""
    from ...report.render import png
    from ...report.unit_pictures import portrait, unit_parts

    if study.search is None or study.solid is None or study.context.hurried:
        return None
    d = study.job.unit.dimensions
    best = study.search.solved[0]
    side = -1.0 if best.points[:, 0].sum() < 0 else 1.0
    parts = unit_parts(d, study.solid.vertices, study.solid.triangles)
    radius = max(d.inclusion_radius, d.waveguide_section / 2)
    return Picture(
        png(portrait(parts, study.anchors, best.points * [side, 1.0, 1.0], radius)),
        f"The best path of the lattice, {best.name}, before the unit cut open; its mirror image is "
        "equivalent.",
        "The unit cut along its plane of bending, and the path of the sensor through its lattice.",
    )


def _files(study: Study) -> dict[str, str]:
    solids = sorted(p.name for p in study.folder.glob("unit_*.stl"))
    return FILES | dict.fromkeys(solids, "printable unit with that waveguide, mm")
