"""Convergence and cost of a lattice cell's effective moduli, and what beams say.

    python benchmarks/cell.py [--preset mu-1.0x] [--modulus 2.5] [--poisson 0.45] [--levels 2 3 4 6]

Meshes are made anew. The limit is that of a straight line through E against the 2/3rd power of 1 / elements,
the square of an element's size: pytetwild's meshes are not refinements of one another, and a higher order is
not seen past their scatter and the creases where struts merge.
"""

from __future__ import annotations

import argparse
import time

import attrs
import numpy as np

from mu_addon.design.lattice_kinds import BODY_CENTRED, STRAIGHT
from mu_addon.design.parameters import load_preset
from mu_addon.design.strut_cell import relative_density, strut_cell
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.elasticity import Elasticity, effective_tensor
from mu_addon.homogenize.stretch import StretchSettings, stretch_lattice
from tests.homogenize.cells import body_centred_by_beams


def moduli(e):
    return np.array([e.E100, e.E110, e.E111, e.C44, e.bulk]) * 1e3


def row(name, e):
    values = " | ".join(f"{v:.4g}" for v in moduli(e))
    ratios = f"{e.nu100:.4f} | {e.zener:.2f} | {e.cubic_error:.4f}"
    return f"{name} | {e.relative_density:.5f} | {values} | {ratios} |"


def levels(cell, modulus, poisson, sizes):
    print(
        "| per diameter | tets | nodes | mesh s | tensor s | density | E100 kPa | E110 | E111 | C44 | K "
        "| nu100 | Zener | cubic error |\n" + "| --- " * 14 + "|"
    )
    counts, found = [], []
    for size in sizes:
        start = time.perf_counter()
        mesh = mesh_cell(cell, CellMeshSettings(per_diameter=size))
        meshed = time.perf_counter()
        e = effective_tensor(mesh, cell_materials(cell, mesh, modulus, poisson), (cell.half_mm,) * 3)
        done = time.perf_counter()
        name = (
            f"| {size:g} | {len(mesh.tets)} | {len(mesh.nodes)} | {meshed - start:.1f} | {done - meshed:.1f}"
        )
        print(row(name, e), flush=True)
        counts.append(len(mesh.tets))
        found.append(moduli(e))
    design = np.stack([np.ones(len(counts)), np.array(counts) ** (-2 / 3)], axis=1)
    limit = np.linalg.lstsq(design, np.array(found), rcond=None)[0][0]
    print("| limit | | | | | | " + " | ".join(f"{v:.4g}" for v in limit) + " | | | |")
    for size, values in zip(sizes, found, strict=True):
        error = " | ".join(f"{100 * v:+.2f} %" for v in values / limit - 1)
        print(f"| error at {size:g} | | | | | | {error} | | | |")
    if cell.kind in (BODY_CENTRED, STRAIGHT):
        beams = Elasticity(body_centred_by_beams(cell, modulus, poisson), relative_density(cell))
        print(row("| beams, rigid joints | | | |", beams), flush=True)


def large(cell, modulus, poisson):
    start = time.perf_counter()
    mesh = mesh_cell(cell)
    materials = cell_materials(cell, mesh, modulus, poisson)
    meshed = time.perf_counter()
    tests = [StretchSettings(strains=tuple(np.linspace(-0.4, 0.4, 17)), confined=c) for c in (False, True)]
    found = [stretch_lattice(mesh, materials, (cell.half_mm,) * 3, t) for t in tests]
    print(
        f"\nfinite strain on {len(mesh.tets)} elements: {(time.perf_counter() - meshed) / 2:.0f} s a test of "
        f"16 points, {meshed - start:.0f} s for the mesh\n"
    )
    print(
        "| strain | "
        + " | ".join(f"{s:g}" for s in np.round(found[0].curve.strain, 6))
        + " |\n"
        + "| --- " * (len(found[0].points) + 1)
        + "|"
    )
    for name, f in zip(("free", "confined"), found, strict=True):
        print(f"| {name}, kPa | " + " | ".join(f"{1e3 * s:.4g}" for s in f.curve.stress_MPa) + " |")
        print("| lateral stretch | " + " | ".join(f"{s:.4g}" for s in f.curve.lateral.mean(axis=1)) + " |")
        print(f"\n{name}: {f.stopped or 'runs to its ends'}\n", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--modulus", type=float, default=2.5, help="of the resin, MPa")
    options.add_argument("--poisson", type=float, default=0.45)
    options.add_argument("--offset", type=float, default=None, help="of every surface, mm")
    options.add_argument("--levels", type=float, nargs="+", default=[2.0, 3.0, 4.0, 6.0])
    options.add_argument("--stretch", action="store_true", help="also the cell at finite strain")
    given = options.parse_args()
    cell = strut_cell(load_preset(given.preset))
    if given.offset is not None:
        cell = attrs.evolve(cell, offset_xy_mm=given.offset, offset_z_mm=given.offset)
    struts = f"struts {2 * cell.junction_radius_mm:g} to {2 * cell.midspan_radius_mm:g} mm"
    resin = f"resin {given.modulus:g} MPa, nu {given.poisson:g}"
    print(f"{given.preset}: {cell.kind.name}, cell {cell.size_mm:g} mm, {struts}, {resin}\n")
    levels(cell, given.modulus, given.poisson, given.levels)
    if given.stretch:
        large(cell, given.modulus, given.poisson)


if __name__ == "__main__":
    main()
