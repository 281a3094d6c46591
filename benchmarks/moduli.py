"""The paper's lattice moduli at three scales from struts and resin: nominal, and with one print offset.

    python -m benchmarks.moduli [--out DIR]

Scales 0.75, 1.0 and 1.5 are one lattice but for the offset (mu_addon/homogenize/offset_response.py), so every
test is run once for each of some offsets. The offset and the resin are fitted to 0.75x and 1.5x; 1.0x is held
out. DIR keeps meshes, moduli.json and moduli.svg.
"""

from __future__ import annotations

import time
from pathlib import Path

import attrs
import numpy as np

from benchmarks.offset_fit import fit_offset
from benchmarks.table import circumstances, options_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.strut_cell import relative_density, strut_cell
from mu_addon.errors import InputError
from mu_addon.files import write_json, write_text
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.compression import compress
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.homogenize.offset_response import OffsetResponse
from mu_addon.homogenize.specimen import block_specimen
from mu_addon.homogenize.stress_strain_curve import modulus
from mu_addon.report.plots import BY_LENGTH, CHOSEN, INK, QUIET, WIDTH, canvas

SCALES = (0.75, 1.0, 1.5)
MEASURED_kPa = (21.70, 18.34, 16.38)
SPREAD_kPa = (0.35, 1.86, 1.21)
# Of the lattice at scale 1; an offset o at scale s is o/s here.
OFFSETS_mm = (-0.05, 0.0, 0.05, 0.1, 0.2, 0.3)
RESIN_MPa = 2.5
POISSON = 0.45
# Coarse, since blocks of many cells are large: the endless lattice's modulus is 0.5 % below a fine mesh's.
MESH = CellMeshSettings(per_diameter=1.0)
TESTS = {
    "periodic": "endless lattice",
    "slide 3": "3 x 3 x 3 cells, plates slide",
    "stick 3": "3 x 3 x 3 cells, plates hold",
    "stick 2": "2 x 2 x 2 cells, plates hold",
}
COLORS = (BY_LENGTH[1], BY_LENGTH[3], BY_LENGTH[0], CHOSEN)


def moduli_of(cell, cache):
    """Initial modulus in MPa of a printed cell's endless lattice along an axis, and of blocks."""
    mesh = mesh_cell(cell, MESH, cache)
    materials = cell_materials(cell, mesh, RESIN_MPa, POISSON)
    found = {"periodic": effective_tensor(mesh, materials).E100}
    for name in list(TESTS)[1:]:
        friction, cells = name.split()
        test = compress(block_specimen(mesh, int(cells), materials), (0.005,), friction)
        found[name] = modulus(test.curve, "initial tangent")
    return found


def responses(cell, cache):
    """Every test's response to an offset."""
    values = {name: [] for name in TESTS}
    density = []
    for offset in OFFSETS_mm:
        printed = attrs.evolve(cell, offset_xy_mm=offset, offset_z_mm=offset)
        start = time.perf_counter()
        for name, found in moduli_of(printed, cache).items():
            values[name].append(found / RESIN_MPa)
        density.append(relative_density(printed))
        values_text = ", ".join(f"{n} {1e3 * RESIN_MPa * v[-1]:.3g} kPa" for n, v in values.items())
        print(f"offset {offset:+.2f} mm: {values_text}; {time.perf_counter() - start:.0f} s", flush=True)
    return {name: OffsetResponse(OFFSETS_mm, v, density) for name, v in values.items()}


def table(response):
    """Rows of one test: each hypothesis with its resin, offset and moduli in kPa at the scales."""
    rows = [("nominal size", RESIN_MPa, 0.0, response.modulus_MPa(SCALES, 0.0, RESIN_MPa))]
    fitted = [SCALES[0], SCALES[2]]
    data = [np.array([v[0], v[2]]) / 1e3 for v in (MEASURED_kPa, SPREAD_kPa)]
    for name, resin in (("one offset, resin 2.5 MPa", RESIN_MPa), ("one offset, resin free", None)):
        try:
            fit = fit_offset(response, fitted, *data, resin_MPa=resin)
        except InputError as error:
            print(f"{name}: {error.what}")
            continue
        rows.append(
            (name, fit.resin_MPa, fit.offset_mm, response.modulus_MPa(SCALES, fit.offset_mm, fit.resin_MPa))
        )
        print(f"{name}: offset {fit.low95_mm:.3f} to {fit.high95_mm:.3f} mm (95 %), chi2 {fit.chi2:.3g}")
    return rows


def chart(tables):
    """Modulus against scale: measured, at nominal size (dotted) and with one offset, resin 2.5 MPa."""
    with canvas(1.5 * WIDTH, 3.0) as (figure, svg):
        axes = figure.add_axes((0.10, 0.15, 0.52, 0.81))
        axes.errorbar(
            SCALES,
            MEASURED_kPa,
            SPREAD_kPa,
            fmt="o",
            color=INK,
            capsize=4,
            label="measured (paper)",
            zorder=5,
        )
        for (name, rows), color in zip(tables.items(), COLORS, strict=True):
            (_, _, _, nominal), (_, _, offset, E) = rows[:2]
            axes.plot(SCALES, 1e3 * np.asarray(nominal), ":", color=color, linewidth=1.4)
            words = f"{TESTS[name]},\n{offset:.2f} mm thicker a side"
            axes.plot(SCALES, 1e3 * np.asarray(E), "-", color=color, linewidth=1.8, label=words)
        axes.plot([], [], ":", color=QUIET, label="the same at nominal size")
        axes.set(xlabel="scale", ylabel="modulus [kPa]", ylim=(0, None), xticks=SCALES)
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), fontsize=7.5, labelspacing=0.8)
    return svg()


def main():
    parser = options_of(__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/moduli"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cell = strut_cell(load_preset("mu-1.0x"))
    found = responses(cell, options.out / "cache")
    tables = {}
    for name, response in found.items():
        print(f"\n{TESTS[name]}")
        tables[name] = table(response)
        for hypothesis, resin, offset, E in tables[name]:
            values = "  ".join(f"{1e3 * e:6.2f}" for e in E)
            print(f"  {hypothesis:28s} resin {resin:5.2f} MPa  offset {offset:6.3f} mm", end="  ")
            print(f"E {values} kPa")
    print(f"\nmeasured: {MEASURED_kPa} +- {SPREAD_kPa} kPa")
    kept = {
        "circumstances": circumstances(),
        "offsets_mm": OFFSETS_mm,
        "modulus_over_resin": {n: r.modulus.tolist() for n, r in found.items()},
        "density": found["periodic"].density.tolist(),
        "table": {n: [(h, r, o, list(map(float, E))) for h, r, o, E in rows] for n, rows in tables.items()},
    }
    write_json(options.out / "moduli.json", kept)
    write_text(options.out / "moduli.svg", chart(tables))


if __name__ == "__main__":
    main()
