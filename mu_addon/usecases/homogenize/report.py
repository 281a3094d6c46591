"""The report of a homogenisation: effective moduli, their method, and their validity."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ...files import write_bytes, write_text
from ...homogenize.elasticity import Elasticity
from ...homogenize.stress_strain_curve import DEFAULT, moduli
from ...meshing.mesh import Mesh
from ...report.html import cards, facts_table, figure, note, page, picture_figure, table
from ...report.results import Picture
from ...report.unit_pictures import skin
from ...run.versions import package_versions
from . import charts as pictures
from .charts import Line, kPa

if TYPE_CHECKING:
    from .run import Homogenisation

FILES = {
    "homogenize.toml": "inputs of this run",
    "unit.toml": "parameters of the unit",
    "effective.toml": "moduli of the lattice, and a law of its continuum",
    "tensor.csv": "effective elasticity, kPa, in Voigt's order with engineering shears",
    "cell.csv": "the periodic lattice in tension and compression along an axis",
    "cell.vtu": "analysis mesh of an eighth of a cell (ParaView)",
    "specimen.stl": "printable block of cells, nominal size, mm",
    "specimen_slide.csv": "the block between frictionless plates",
    "specimen_stick.csv": "the block between bonded plates",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}
FRICTION = {"slide": "frictionless plates", "stick": "bonded plates"}


def write_report(study: Homogenisation, stopped: str = "") -> None:
    """Write the pictures and report.html; `stopped`: why an incomplete run stopped."""
    with study.progress.stage("report"):
        versions = package_versions()
        study.context.summary["versions"] = versions
        write_text(study.folder / "report.html", report(study, versions, stopped))


def report(study: Homogenisation, versions: dict[str, str], stopped: str = "") -> str:
    """The whole report as HTML text, of all finished stages."""
    cell = study.job.cell
    sections = [
        ("cell", "The cell and its moduli", _moduli(study)),
        ("test", "Block between plates", _test(study)),
        ("law", "Lattice law for the analysis mesh", _law(study)),
        ("inputs", "Inputs", _inputs(study)),
        ("files", "Files of this run", facts_table("file", "content", _files(study))),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    title = f"From struts to moduli: the lattice of {study.job.unit.name}"
    subtitle = (
        f"Cell of {cell.size_mm:g} mm, {cell.kind.name}, struts of {2 * cell.junction_radius_mm:g} to "
        f"{2 * cell.midspan_radius_mm:g} mm, resin of {kPa(1e3 * study.job.resin.modulus_MPa)}"
    )
    return page(title, subtitle, note(study.warnings, stopped), _headline(study), sections)


def _headline(study: Homogenisation) -> str:
    e = study.elasticity
    if e is None:
        return ""
    html = (
        f'<p class="answer">Along its axes this lattice has a Young\'s modulus of <strong>'
        f"{kPa(1e3 * e.E100)}</strong>; along its struts it is {e.E111 / e.E100:.1f} times as stiff.</p>"
    )
    measured = study.job.unit.material.lattice_modulus_kPa
    sentences = []
    if study.tests:
        values = {f: 1e3 * moduli(t.curve).get(DEFAULT, np.nan) for f, t in study.tests.items()}
        listed = " and ".join(f"{kPa(v)} between {FRICTION[f]}" for f, v in values.items())
        n = study.job.cells
        sentences.append(f"A block of {n} x {n} x {n} cells has {listed} ({DEFAULT} of strain).")
    ratio = measured / (1e3 * e.E100)
    sentences.append(
        f"The unit's parameters say {kPa(measured)}, {ratio:.2g} times the prediction: "
        + (
            "they agree within 10 %."
            if 0.9 < ratio < 1.1
            else "resin, print offset or strut diameters differ from the values assumed here. The mass of a "
            "printed specimen shows which: see the computed mass below."
        )
    )
    facts = [
        ("relative density", f"{e.relative_density:.1%}"),
        (f"mass of {study.job.cells}³ cells", f"{study.context.summary['specimen_mass_g']:.3g} g"),
        ("E along an axis", kPa(1e3 * e.E100)),
        ("E along a strut", kPa(1e3 * e.E111)),
        ("Poisson's ratio", f"{e.nu100:.3f}"),
        ("Zener's ratio", f"{e.zener:.2f}"),
    ]
    return html + f"<p>{escape(' '.join(sentences))}</p>" + cards(facts)


def _moduli(study: Homogenisation) -> str:
    e, mesh = study.elasticity, study.mesh
    if e is None or mesh is None:
        return ""
    shown = "".join(picture_figure(picture) for picture in _cell_pictures(study, mesh, e))
    names = ("xx", "yy", "zz", "yz", "xz", "xy")
    rows = [
        ([a, *(f"{1e3 * c:.4g}" if c else "0" for c in row)], False)
        for a, row in zip(names, e.C, strict=True)
    ]
    return (
        f'<div class="pair">{shown}</div>'
        + table(
            "Effective elasticity of the periodic lattice, kPa.", [("", ""), *((n, "n") for n in names)], rows
        )
        + f"<p>A cubic tensor has three constants; this one is cubic to {e.cubic_error:.2%}, which is mesh "
        "error unless the print offset differs along z.</p>"
    )


def _cell_pictures(study: Homogenisation, mesh: Mesh, e: Elasticity) -> list[Picture]:
    if study.context.hurried:
        return []
    size = study.job.cell.size_mm
    made = {
        "cell.png": pictures.cell_picture(mesh.nodes, skin(mesh.tets), size, e.relative_density),
        "modulus.png": pictures.modulus_surface(e.C),
    }
    for name, picture in made.items():
        write_bytes(study.folder / name, picture.png)
    return list(made.values())


def _test(study: Homogenisation) -> str:
    if not study.tests:
        return ""
    lines = []
    rows = []
    for friction, found in study.tests.items():
        curve = found.curve
        side = curve.stretch <= 1
        lines.append(
            Line(
                FRICTION[friction],
                -curve.strain[side][::-1],
                -1e3 * curve.stress_MPa[side][::-1],
                found.valid_to_strain,
            )
        )
        for procedure, value in moduli(curve).items():
            needs = {"slope 0-40 %": 0.4, "secant at 40 %": 0.4, DEFAULT: 0.1}.get(procedure, 0.0)
            beyond = "beyond its validity" if needs > found.valid_to_strain + 1e-9 else ""
            rows.append(([procedure, FRICTION[friction], f"{1e3 * value:.3g}", beyond], procedure == DEFAULT))
    if study.stretched is not None:
        curve = study.stretched.curve
        side = curve.stretch <= 1
        lines.append(Line("periodic lattice", -curve.strain[side][::-1], -1e3 * curve.stress_MPa[side][::-1]))
    chart = figure(
        pictures.compression_chart(lines),
        "Nominal stress of the block and of the periodic lattice. Dot: end of the valid range, for the "
        "reason below; a test would not follow the dotted part.",
        "Nominal stress against compression.",
    )
    words = "".join(f"<p>Between {FRICTION[f]}: {escape(t.why)}.</p>" for f, t in study.tests.items())
    moduli_table = table(
        "Modulus by evaluation procedure. The paper does not give its procedure; the marked one is used "
        "here.",
        [("procedure", ""), ("plates", ""), ("modulus [kPa]", "n"), ("", "")],
        rows,
    )
    shown = "".join(picture_figure(p) for p in _specimen_pictures(study))
    n = study.job.cells
    return (
        f"<p>{n} x {n} x {n} cells, cut flat, between two rigid plates. Real plates lie between two bounds: "
        "frictionless and bonded.</p>"
        f'<div class="pair"><div>{chart}</div><div>{moduli_table}</div></div>{words}<div '
        f'class="triple">{shown}</div>'
    )


def _specimen_pictures(study: Homogenisation) -> list[Picture]:
    # Pictures take most of the time: a run that was asked to stop leaves them out.
    if study.context.hurried:
        return []
    found = study.tests.get("stick") or next(iter(study.tests.values()))
    mesh = found.specimen.mesh
    last = found.states[-1]
    middle = min(found.states, key=lambda s: abs(s.strain - last.strain / 2))
    states = [(s.strain, s.u) for s in (found.states[0], middle, last)]
    made = pictures.specimen_pictures(mesh.nodes, skin(mesh.tets), states, np.zeros(3))
    for (strain, _), picture in zip(states, made, strict=True):
        write_bytes(study.folder / f"specimen_{100 * strain:.0f}.png", picture.png)
    return made


def _law(study: Homogenisation) -> str:
    if study.fit is None or study.stretched is None:
        return ""
    fit = study.fit
    low, high = fit.stretch
    along = np.linspace(low, high, 121)
    stress, lateral = fit.uniaxial(along)
    law = {"strain": along - 1, "stress_kPa": 1e3 * stress, "lateral": lateral}
    charts = pictures.stretch_charts(study.stretched.curve, law)
    shown = "".join(
        figure(chart, caption, caption)
        for chart, caption in zip(
            charts,
            (
                "Stress along an axis.",
                "Lateral stretch: a foam law cannot follow the kinematics of the struts.",
            ),
            strict=True,
        )
    )
    rows = [
        (["E along an axis [kPa]", f"{1e3 * fit.cell_E_MPa:.4g}", f"{1e3 * fit.E_MPa:.4g}"], False),
        (["Poisson's ratio", f"{fit.cell_poisson:.3f}", f"{fit.poisson:.3f}"], False),
        (["C44 [kPa]", f"{1e3 * fit.cell_C44_MPa:.4g}", f"{1e3 * fit.C44_MPa:.4g}"], False),
    ]
    m = fit.misfit
    return (
        "<p>Compressible foam with separate parameters in tension and compression, in parallel with a "
        "cubic shear term that raises the shear modulus to the cell's. Valid for the lattice between "
        f"stretches of {low:g} and {high:g} along the axes; misfit (root mean square) {m.tension:.1%} of "
        f"the largest stress in tension, {m.compression:.1%} in compression, {m.lateral:.0%} of the largest "
        "lateral strain.</p>"
        f'<div class="pair">{shown}</div>'
        + table("At small strain.", [("", ""), ("cell", "n"), ("law", "n")], rows)
    )


def _inputs(study: Homogenisation) -> str:
    cell, resin = study.job.cell, study.job.resin
    facts = {
        "lattice": cell.kind.name,
        "cell [mm]": cell.size_mm,
        "strut at a junction [mm]": 2 * cell.junction_radius_mm,
        "strut at mid-span [mm]": 2 * cell.midspan_radius_mm,
        "print offset in the plane [mm]": cell.offset_xy_mm,
        "print offset along z [mm]": cell.offset_z_mm,
        "skin depth [mm]": cell.skin_depth_mm,
        "skin modulus over core modulus": cell.skin_factor,
        "resin": resin.name,
        "resin's Young's modulus [kPa]": 1e3 * resin.modulus_MPa,
        "resin's Poisson's ratio": resin.poisson,
        "resin's density [g/ml]": resin.density_g_per_ml,
    } | {f"mesh: {k}": v for k, v in study.context.summary.get("mesh", {}).items()}
    return facts_table("input", "value", facts)


def _files(study: Homogenisation) -> dict[str, str]:
    return {name: what for name, what in FILES.items() if (study.folder / name).exists()}
