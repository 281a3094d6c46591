"""What a study shows of its ranking of paths: parts of its report, terminal, summary and files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..fem.bending_angle import TipSection
from ..fem.trajectory import Trajectory
from ..files import write_npz
from ..meshing.mesh import Mesh
from ..report import heatmaps, plots
from ..report.motion_files import FOLDER, write_path, write_sensitivity
from ..report.plots import label, signed
from ..report.results import LatticePath, Picture, RankingResult
from ..report.results import Path as ShownPath
from ..report.vtk import write_fields
from ..run.parts import (
    Beside,
    Chart,
    Fact,
    File,
    Part,
    Pictures,
    Sentence,
    Table,
    Warn,
    csv,
    echo,
    listed,
    recorded,
)
from . import graph_search, light
from .charts import delta_name, delta_picture, front_chart, response_chart
from .compared_pressures import PathCheck, Standing
from .graph_search import Predicted, Sensitivity, unstable_at
from .path_motion import PathMotion
from .place_stages import Light, NamedMotion, SearchOutcome, Uncertainty
from .ranking import COLUMNS, Ranking

if TYPE_CHECKING:
    from ..design.solid import Solid

MAP = "sensitivity.vtu"


def paths_of(study: Any) -> list[ShownPath]:
    """The candidate paths as they are shown."""
    return [ShownPath(w.name, w.start, w.length) for w in study.windows]


def result_of(ranking: Ranking) -> RankingResult:
    """A ranking as charts take it, of the solved paths."""
    from ..placement.deviation import rank

    found = [*ranking.deviations.values()]
    j_hat = np.array([d.J_hat for d in found])
    return RankingResult(
        delta=np.array([d.delta for d in found]),
        j_hat=j_hat,
        j_cont=np.array([d.J_cont for d in found]),
        rank=[int(r) for r in rank(j_hat)],
        chosen=ranking.chosen,
        tied=ranking.tied,
        uncertainty_mm=ranking.uncertainty_mm,
        at_least_mm=ranking.at_least_mm,
    )


def _solved(study: Any, ranking: Ranking) -> list[ShownPath]:
    return [path for path in paths_of(study) if path.name in ranking.deviations]


def answer_parts(
    study: Any, solid: Solid, ranking: Ranking | None, motion: Trajectory | None
) -> Iterator[Part]:
    """The path to take, its figures, and the unit with it."""
    paths = paths_of(study)
    if ranking is not None:
        best = next(path for path in paths if path.name == ranking.chosen)
        without = f" ({study.left_out})" if study.left_out else ""
        J = ranking.J_hat_mm
        yield Sentence(
            f"Put the sensor along {label(best.name)}, anchors {best.anchors}: of {len(paths)} candidates it "
            f"has the smallest mean deviation, {J[best.name]:.3f} mm{without}.",
            answer=True,
            strong=label(best.name),
        )
        if ranking.tied:
            within = f" ({ranking.uncertainty_mm:.3f} mm)" if ranking.uncertainty_mm is not None else ""
            yield Sentence(
                "Within the mesh uncertainty it is tied with "
                f"{listed([label(n) for n in ranking.tied])}; they "
                f"differ by less than the uncertainty{within}."
            )
        yield from _key_figures(ranking, motion)
        equal = f", tied with {', '.join(ranking.tied)}" if ranking.tied else ""
        yield from echo(f"best path: {best.name}, J_hat {J[best.name]:.4f} mm{equal}{without}")
        if ranking.at_least_mm:
            bounds = ", ".join(f"{name} {bound:.3f}" for name, bound in ranking.at_least_mm.items())
            yield from echo(f"not solved further, J_hat at least [mm]: {bounds}; --all-paths solves them")
    chosen = ranking.chosen if ranking else ""
    yield Beside([_section(study, solid, ranking), Pictures(partial(_portrait, study, solid, chosen))])


def _key_figures(ranking: Ranking, motion: Trajectory | None) -> Iterator[Part]:
    J = sorted(ranking.J_hat_mm.items(), key=lambda one: one[1])
    yield Fact("mean deviation Ĵ", J[0][1], f"{J[0][1]:.3f} mm")
    if len(J) > 1:
        yield Fact("runner-up", J[1][1], f"{label(J[1][0])}, {J[1][1]:.3f} mm")
    if ranking.at_least_mm:
        least = min(ranking.at_least_mm.values())
        yield Fact(f"{len(ranking.at_least_mm)} others", least, f"at least {least:.3f} mm")
    elif len(J) > 1:
        yield Fact("worst", J[-1][1], f"{label(J[-1][0])}, {J[-1][1]:.3f} mm")
    if motion is not None:
        tip = TipSection.of(motion.mesh)
        for k in (int(np.argmin(motion.pressure_kPa)), int(np.argmax(motion.pressure_kPa))):
            angle = tip.angle_deg(motion.states[k].u)
            yield Fact(f"bends at {motion.pressure_kPa[k]:g} kPa", angle, f"{angle:.1f}°")


def _parts(study: Any, solid: Solid) -> tuple[Any, Array, float]:
    """Parts of the unit's pictures, anchors (n, 3) and radius of a path in mm."""
    from ..design.anchors import anchor_points
    from ..report.unit_pictures import unit_parts

    d = study.unit.dimensions
    radius = max(d.inclusion_radius, d.waveguide_section / 2)
    return unit_parts(d, solid.vertices, solid.triangles), anchor_points(study.unit), radius


def _along(study: Any, anchors: Array, chosen: str) -> Array:
    window = next((w for w in study.windows if w.name == chosen), None)
    return anchors[list(window.indices)] if window else anchors[:0]


def _section(study: Any, solid: Solid, ranking: Ranking | None) -> Chart:
    paths, chosen = paths_of(study), ranking.chosen if ranking else ""
    means = []
    if ranking is not None:
        J, bounds = ranking.J_hat_mm, ranking.at_least_mm
        means = [f"{J[p.name]:.3f}" if p.name in J else f"≥ {bounds[p.name]:.3f}" for p in paths]

    def draw() -> str:
        from ..report.unit_pictures import side_view

        parts, anchors, radius = _parts(study, solid)
        view = side_view(parts, anchors, _along(study, anchors, chosen), radius)
        return plots.unit_with_paths(view, paths, chosen, means)

    sensor = f" and the sensor along {label(chosen)}" if chosen else ""
    through = next((f" {p.anchors}" for p in paths if p.name == chosen), "")
    return Chart(
        draw,
        "Left: the unit cut open along the plane in which it bends, inlet below, with anchors P1 to "
        f"P{study.unit.chambers.count}{sensor}. Right: every candidate path at its true height"
        + (", with its mean deviation in mm." if ranking else "."),
        "Section of the unit, and the candidate paths"
        + (f"; the chosen path {chosen} runs through anchors{through}." if chosen else "."),
    )


def _portrait(study: Any, solid: Solid, chosen: str) -> list[tuple[str, Picture]]:
    from ..report.render import png
    from ..report.unit_pictures import portrait

    parts, anchors, radius = _parts(study, solid)
    image = png(portrait(parts, anchors, _along(study, anchors, chosen), radius))
    with_sensor = f", with the sensor along {chosen}" if chosen else ""
    alt = "Bellows of six chambers inside a lattice of struts, cut along the plane of bending."
    return [("unit.png", Picture(image, f"The printable unit cut open{with_sensor}.", alt))]


def ranking_parts(study: Any, ranking: Ranking, motion: Trajectory) -> Iterator[Part]:
    """Every path's deviation, in files, charts and a table."""
    paths, result = paths_of(study), result_of(ranking)
    yield csv("deviation.csv", COLUMNS, ranking.rows(study.candidate_paths))
    arrays = {
        "delta_mm": result.delta,
        "path": np.array([*ranking.deviations]),
        "time_s": study.samples.time_s,
        "pressure_kPa": study.samples.supplied_kPa,
        "station": np.linspace(0, 1, study.stations),
    }
    yield File("delta.npz", lambda path: write_npz(path, arrays), of=arrays)
    yield recorded("J_hat_mm", ranking.J_hat_mm)
    yield recorded("J_cont_mm", {n: d.J_cont for n, d in ranking.deviations.items()})
    yield recorded("J_hat_at_least_mm", ranking.at_least_mm)
    yield recorded("chosen", ranking.chosen)
    yield recorded("mesh_uncertainty_mm", ranking.uncertainty_mm)
    yield recorded("tied_with_chosen", ranking.tied)
    yield from (Warn(f"Paths are not compared {where}.") for where in ranking.not_reached)
    over = (
        "the compared part of the pressure cycle"
        if not ranking.compared.all()
        else "the whole pressure cycle"
    )
    if study.left_out:
        over = "the pressure cycle, with rest in place of suction, so that it is less than in a full ranking"
    yield Sentence(
        "Ĵ is the mean distance between the unit with the sensor and the unit without it, over the line "
        f"of anchors and {over}. Smaller is better."
    )
    if ranking.at_least_mm:
        yield Sentence(
            "A path marked ≥ was solved no further once its deviation certainly exceeded that of the best "
            "paths: Ĵ is a mean of distances, so that the part already solved bounds it from below."
        )
    tied = f" Hatched: tied with {label(ranking.chosen)}." if ranking.tied else ""
    size = ranking.uncertainty_mm
    whiskers = f" Whiskers: ± {size:.3f} mm mesh uncertainty." if size is not None else ""
    pale = " Pale: lower bound." if ranking.at_least_mm else ""
    bars = Chart(
        partial(plots.ranking, result, _solved(study, ranking)),
        f"Mean deviation of every path, best first.{tied}{whiskers}{pale}",
        f"Bar chart of the mean deviation; {ranking.chosen} is best.",
    )
    rows, ranks = [], ranking.rank
    for path in paths:
        if path.name in ranking.at_least_mm:
            figures = ["", f"≥ {ranking.at_least_mm[path.name]:.4f}", ""]
        else:
            d = ranking.deviations[path.name]
            figures = [str(ranks.get(path.name, "")), f"{d.J_hat:.4f}", f"{d.J_cont:.4f}"]
        rows.append([label(path.name), path.anchors, *figures])
    best = [n for n, path in enumerate(paths) if path.name == ranking.chosen]
    head = [("path", ""), ("anchors", "line"), ("rank", "n"), ("Ĵ [mm]", "n"), ("J cont [mm]", "n")]
    every = Table("Every path. J cont: root mean square instead of mean.", head, rows, best)
    yield Beside([bars, every])
    yield Pictures(partial(_panel_pictures, ranking, motion), shown=False)


def _panel_pictures(ranking: Ranking, motion: Trajectory) -> list[tuple[str, Picture]]:
    """Pictures of the paths' deviations for panels."""
    found = ranking.deviations
    top = max((float(np.nanmax(d.delta)) for d in found.values()), default=0.0)
    return [
        (f"{FOLDER}/{delta_name(name)}", delta_picture(name, d.delta, motion.time_s, top))
        for name, d in found.items()
    ]


def contest_doubts(standing: Standing, check: PathCheck | None) -> Iterator[Part]:
    """Warnings of candidates that were solved otherwise, or not to their end."""
    yield from (Warn(f"No deviation is known of {path}.") for path in standing.ended)
    if check is not None and not check.independent:
        yield Warn(
            "A candidate started from Model A's states does not lie on its own equilibrium path from "
            f"rest (difference {check.difference_mm:.2g} mm), so every candidate was solved "
            "from rest."
        )


def uncertainty_doubts(found: Uncertainty) -> Iterator[Part]:
    """Warning of a mesh uncertainty that is not known."""
    if found.why:
        yield Warn(found.why)


def estimate_parts(study: Any, J_mm: Mapping[str, float]) -> Iterator[Part]:
    """Estimated deviations, as long as no path is solved."""
    if not J_mm:
        return
    anchors = {path.name: path.anchors for path in paths_of(study)}
    yield Sentence(
        "No path was solved yet. Estimated by the linear response of the unit under pressure; exact ones "
        "differ by some 5 to 40 %, and paths close to each other may change places."
    )
    head = [("path", ""), ("anchors", "line"), ("estimated Ĵ [mm]", "n")]
    rows = [[label(name), anchors[name], f"{J:.2f}"] for name, J in J_mm.items()]
    yield Table("Estimated mean deviation, least first.", head, rows)


def search_parts(study: Any, solid: Solid, found: SearchOutcome, predicted: Predicted) -> Iterator[Part]:
    """The best paths of the whole lattice."""
    best, solved = found.best, found.paths[: found.checked]
    yield csv("paths.csv", graph_search.COLUMNS, graph_search.rows(found.paths))
    yield recorded(
        "search",
        {
            "paths": found.count,
            "checked": found.checked,
            "risk_that_an_unchecked_one_is_better": found.risk,
            "best": {
                "name": best.name,
                "points_mm": best.points.tolist(),
                "length_mm": best.length_mm,
                "J_hat_mm": best.j_hat,
                "predicted_J_hat_mm": best.predicted_mm,
            },
        },
    )
    yield from echo(
        f"whole-lattice search: {best.name}, J_hat {best.j_hat:.4f} mm, {best.length_mm:.1f} mm long; "
        f"{found.checked} of {found.count} paths solved by the full model"
    )
    if words := unstable_at(predicted.unstable_kPa, "The ranking of paths leaves"):
        yield Warn(words)
    if not found.complete:
        yield Warn(
            f"After {study.checks} full solutions, the probability that an unsolved path is better than "
            f"the best one is up to {found.risk:.0%}: increase --checks."
        )
    if found.unprintable:
        yield Warn(
            f"{found.unprintable} paths that the search found are left out: no waveguide can be "
            "printed along them."
        )
    certain = f"less than {max(found.risk, 1e-3):.1%}" if found.risk < 0.5 else f"up to {found.risk:.0%}"
    yield Sentence(
        f"Of {found.count} paths through nodes of the lattice, bent paths included, {best.name} has the "
        f"smallest deviation: {best.j_hat:.3f} mm. All were ranked by a reduced model; the {len(solved)} "
        "below were solved by the full model. The probability that another path is better is "
        f"{certain}, if the reduced model is as accurate for the others as for these. Paths marked “best for "
        "their length” are Pareto-optimal in deviation and length.",
        strong=best.name,
    )
    yield Pictures(partial(_search_picture, study, solid, best))
    head = [
        ("path", ""), ("length [mm]", "n"), ("Ĵ [mm]", "n"), ("predicted [mm]", "n"),
        ("best for its length", ""), ("nodes (x y z) [mm]", ""),
    ]  # fmt: skip
    rows = [
        [
            p.name,
            f"{p.length_mm:.1f}",
            f"{p.j_hat:.4f}",
            f"{p.predicted_mm:.4f}",
            "yes" if p.on_front else "",
            "; ".join(" ".join(f"{c:g}" for c in np.round(point, 2)) for point in p.points),
        ]
        for p in solved
    ]
    yield Table("Paths solved by the full model", head, rows, [0])


def _search_picture(study: Any, solid: Solid, best: LatticePath) -> list[tuple[str, Picture]]:
    """Picture of the lattice's best path in the unit cut open, on the side where it is in view."""
    from ..report.render import png
    from ..report.unit_pictures import portrait

    parts, anchors, radius = _parts(study, solid)
    side = -1.0 if best.points[:, 0].sum() < 0 else 1.0
    image = png(portrait(parts, anchors, best.points * [side, 1.0, 1.0], radius))
    caption = (
        f"The best path of the lattice, {best.name}, before the unit cut open; its mirror image is "
        "equivalent."
    )
    alt = "The unit cut along its plane of bending, and the path of the sensor through its lattice."
    return [("", Picture(image, caption, alt))]


def light_parts(found: Light, ranking: Ranking) -> Iterator[Part]:
    """The light signal along every path."""
    s, o, chosen = found.signals, found.signals.optics, ranking.chosen
    yield csv("signals.csv", light.COLUMNS, light.rows(s))
    yield recorded("light", light.figures(s))
    for name, why in found.without.items():
        yield Warn(f"The light signal along {name} is not available: {why}.")
    index = s.names.index(chosen) if chosen in s.names else 0
    mine = s.responses[index]
    low, high = mine.monotonic_deg
    way = "rises" if mine.sensitivity_per_deg < 0 else "falls"
    yield Sentence(
        f"Along {label(s.names[index])} the light at the detector changes by "
        f"{100 * abs(mine.sensitivity_per_deg):.2f} ± {100 * s.errors_per_deg[index]:.2f} % per degree "
        f"around rest, and {way} without a turn from {signed(f'{low:.0f}')} to {high:.0f} degrees. The "
        "light along each path follows a law fitted to traced rays; its error is "
        f"{100 * s.law.rms:.0f} %. Two effects oppose each other: in a bend, light follows the outer "
        "side, away from wells on the inner side; a stretched bar deforms at its wells and loses light "
        "there. The optical constants of the resin are assumed, because no published values were found: "
        f"index {o.index:g}, attenuation {o.attenuation_per_mm:g} per mm, wall slopes {o.roughness:g}.",
        strong=label(s.names[index]),
    )
    front = (
        "The line joins the Pareto-optimal paths: no path has both a smaller deviation and a larger signal."
        + ("" if all(s.solved) else " Rings: at least so large a deviation.")
    )
    caption = (
        "Chosen path in colour; dots: ray tracing through the bent waveguide, bars: two standard errors."
    )
    yield Beside(
        [
            Chart(partial(front_chart, s, chosen), front, "deviation against sensitivity"),
            Chart(partial(response_chart, s, chosen), caption, "light against angle"),
        ]
    )
    head = [
        ("path", ""), ("Ĵ [mm]", "n"), ("signal [%/deg]", "n"), ("±", "n"), ("monotonic from [deg]", "n"),
        ("to [deg]", "n"), ("light at rest [%]", "n"), ("Pareto-optimal", ""),
    ]  # fmt: skip
    rows = [
        [
            label(name),
            f"{'' if s.solved[k] else '≥ '}{s.j_hat[k]:.4f}",
            signed(f"{100 * r.sensitivity_per_deg:.2f}"),
            f"{100 * s.errors_per_deg[k]:.2f}",
            signed(f"{r.monotonic_deg[0]:.1f}"),
            f"{r.monotonic_deg[1]:.1f}",
            f"{100 * s.at_rest[k]:.1f}",
            {True: "yes", False: "", None: "open"}[s.front[k]],
        ]
        for k, (name, r) in enumerate(zip(s.names, s.responses, strict=True))
    ]
    yield Table(
        "Deviation and signal of every path", head, rows, [n for n, x in enumerate(s.names) if x == chosen]
    )
    if s.differential:
        names, slope = s.differential[0]
        yield Sentence(
            f"As a differential pair, {listed([label(n) for n in names])} differ by "
            f"{100 * abs(slope):.2f} % per degree more than alone; a common change of light, such as "
            "warming of the source, cancels."
        )
    best = {len(names): names for names, _ in reversed(s.sets)}
    for size, word in ((2, "pairs"), (3, "triples")):
        if size in best:
            yield Sentence(
                f"Of all {word} {listed([label(n) for n in best[size]])} together determine the "
                "distribution of bending along the unit best."
            )


def sensitivity_parts(found: Sensitivity, mesh: Mesh) -> Iterator[Part]:
    """Files of the sensitivity map."""
    if words := unstable_at(found.unstable_kPa, "The sensitivity map leaves"):
        yield Warn(words)
    if not len(found.dJ_mm):
        return
    fields = {
        "dJ_by_relative_stiffening_mm": found.dJ_mm,
        "dJ_by_modulus_mm_per_MPa": found.dJ_mm / found.modulus_MPa,
        "modulus_MPa": found.modulus_MPa,
    }

    def write(path: Path) -> None:
        write_fields(path, mesh, fields)
        write_sensitivity(path.parent, mesh, found.dJ_mm / found.modulus_MPa)

    yield File(MAP, write, of=(mesh, found.dJ_mm))
    yield recorded("sensitivity", {"file": MAP, "largest_mm": float(found.dJ_mm.max())})


def path_motion_parts(motions: Mapping[str, PathMotion], best: NamedMotion | None) -> Iterator[Part]:
    """Files of the paths' motion, for display."""
    every = {**motions, **({best.name: best.motion} if best and best.motion else {})}
    for name, one in every.items():

        def write(path: Path, name: str = name, one: PathMotion = one) -> None:
            write_path(path.parent.parent, name, one.pressure_kPa, one.difference_mm, **one.fields)

        yield File(f"{FOLDER}/{name}.npz", write, of=(one.pressure_kPa, one.difference_mm))


def heatmap_parts(ranking: Ranking) -> Iterator[Part]:
    """A map of the deviation over length and time for each path."""
    found = ranking.deviations
    top = max(float(np.nanmax(d.delta)) for d in found.values())
    partly = "" if ranking.compared.all() else " Empty rows are not compared."
    yield Sentence(
        "One map per path. Horizontal: length [%], from inlet to tip. Vertical: time [%] of the pressure "
        f"cycle. All maps share one colour scale, in the square root of Δ; the chosen path is framed.{partly}"
    )
    bar = f"Colour scale from 0 to {top:.2f} mm."
    yield Chart(partial(heatmaps.color_bar, top), "", bar, kind="bar")
    yield Beside(
        [
            Chart(
                partial(heatmaps.heatmap, d.delta, top, name == ranking.chosen),
                f"{label(name)}: {d.J_hat:.3f} mm",
                f"Deviation of {name} over length and time, at most {np.nanmax(d.delta):.2f} mm.",
                kind="best" if name == ranking.chosen else "",
            )
            for name, d in found.items()
        ],
        across=4,
    )


def marginal_parts(study: Any, ranking: Ranking) -> Iterator[Part]:
    """Mean deviation along the unit and over time."""
    delta, solved = result_of(ranking).delta, _solved(study, ranking)
    yield Sentence("Colour: number of anchors; dashes: first anchor; thick orange line: chosen path.")
    yield Beside(
        [
            Chart(
                partial(plots.marginal, np.nanmean(delta, axis=1), solved, ranking.chosen, "length"),
                "Deviation along the length, averaged over time.",
                "Mean deviation of every path against length.",
            ),
            Chart(
                partial(plots.marginal, delta.mean(axis=2), solved, ranking.chosen, "time"),
                "Deviation over time, averaged over the length.",
                "Mean deviation of every path against time.",
            ),
        ]
    )
