"""Compression of N x N x N cells of the paper's lattice between plates, as tables.

    python benchmarks/specimen.py size [--cells 1 2 3 4 6]     initial modulus against the periodic cell's
    python benchmarks/specimen.py mesh [--cells 2]             the same and the stress at 40 %, by mesh
    python benchmarks/specimen.py curve [--cells 3]            moduli by procedure, and where curves end

Neo-Hookean resin of 2.5 MPa. Stresses and moduli in kPa.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from circumstances import circumstances

from mu_addon.design.parameters import load_preset
from mu_addon.design.strut_cell import strut_cell
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.compression import STRAINS, compress
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.homogenize.specimen import block_specimen
from mu_addon.homogenize.stress_strain_curve import PROCEDURES, moduli, modulus

FRICTIONS = ("slide", "stick")
MODULUS_MPa = 2.5
# So small that the secant is the tangent.
FIRST = 1e-4


def head(*columns):
    print("| " + " | ".join(columns) + " |\n" + "| --- " * len(columns) + "|")


def row(*values):
    print("| " + " | ".join(v if isinstance(v, str) else f"{v:.4g}" for v in values) + " |", flush=True)


class Cell:
    """A preset's cell, its mesh and how to press blocks of it."""

    def __init__(self, options, per_diameter=None, poisson=None):
        cell = strut_cell(load_preset(options.preset))
        per_diameter = per_diameter or options.per_diameter
        settings = CellMeshSettings(per_diameter=per_diameter, order=options.order)
        self.mesh = mesh_cell(cell, settings, options.cache)
        self.materials = cell_materials(cell, self.mesh, MODULUS_MPa, poisson or options.poisson[0])
        self.periodic_kPa = 1e3 * effective_tensor(self.mesh, self.materials).E100

    def pressed(self, cells, friction, strains, **how):
        start = time.perf_counter()
        found = compress(block_specimen(self.mesh, cells, self.materials), strains, friction, **how)
        return found, time.perf_counter() - start


def kPa(found, state=-1):
    """Nominal stress in kPa."""
    return 1e3 * found.states[state].force_N / found.specimen.side_mm**2


def size(options):
    cell = Cell(options)
    head("N", "unknowns", "slide", "over periodic", "stick", "over periodic", "s each")
    for cells in options.cells or (1, 2, 3, 4):
        values, seconds = [], []
        for friction in FRICTIONS:
            found, s = cell.pressed(cells, friction, [FIRST], stability=False)
            young = kPa(found) / FIRST
            values += [young, young / cell.periodic_kPa]
            seconds.append(s)
        row(f"{cells}", f"{3 * len(found.specimen.mesh.nodes)}", *values, sum(seconds) / len(seconds))
    row("periodic", "", cell.periodic_kPa, 1.0, "", "", "")


def mesh(options):
    (cells,) = options.cells or (2,)
    head("elements a diameter", "elements of the octant", "friction", "periodic E", "initial E",
         "stress at 40 %", "s")  # fmt: skip
    for per_diameter in (1.0, 1.5, 2.0, 3.0, 4.0):
        cell = Cell(options, per_diameter)
        for friction in FRICTIONS:
            found, s = cell.pressed(cells, friction, STRAINS, stability=False)
            count = f"{len(cell.mesh.tets)}"
            tangent = 1e3 * modulus(found.curve, "initial tangent")
            row(f"{per_diameter:g}", count, friction, cell.periodic_kPa, tangent, kPa(found), s)


def curve(options):
    (cells,) = options.cells or (3,)
    reasons = []
    head("nu", "friction", "periodic E", *PROCEDURES, "valid to %", "s")
    for poisson in options.poisson:
        cell = Cell(options, poisson=poisson)
        for friction in FRICTIONS:
            found, s = cell.pressed(cells, friction, STRAINS)
            read = moduli(found.curve)
            values = [1e3 * read[p] if p in read else "" for p in PROCEDURES]
            row(f"{poisson:g}", friction, cell.periodic_kPa, *values, 100 * found.valid_to_strain, s)
            reasons.append(f"nu {poisson:g}, {friction}: {found.why}.")
            if options.points:
                row("", "strain %", *(f"{100 * state.strain:g}" for state in found.states))
                row("", "stress", *(kPa(found, k) for k in range(len(found.states))))
    print("\n" + "\n".join(reasons))


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("what", choices=("size", "mesh", "curve"))
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--cells", type=int, nargs="+")
    options.add_argument("--per-diameter", type=float, default=CellMeshSettings().per_diameter)
    options.add_argument("--order", type=int, default=2)
    options.add_argument("--poisson", type=float, nargs="+", default=[0.45])
    options.add_argument("--points", action="store_true", help="the curves' points too")
    options.add_argument("--cache", type=Path, help="folder for meshes")
    given = options.parse_args()
    print(circumstances() + "\n")
    with tempfile.TemporaryDirectory() as folder:
        given.cache = given.cache or Path(folder)
        {"size": size, "mesh": mesh, "curve": curve}[given.what](given)


if __name__ == "__main__":
    main()
