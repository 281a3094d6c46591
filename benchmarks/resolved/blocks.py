"""Blocks of n x n x n cells of swept struts against the moduli of the endless lattice.

    python -m benchmarks.resolved.blocks [--cells 2 3 4 6 8] [--rings 1] [--layers 5]

Tension along z: plates that slide, free sides, which soften a small block. Shear: all outer faces moved as a
uniform shear moves them, which stiffens a small block. Both must approach E[100] and C44 of the homogenised
cell, whose mesh is another one (pytetwild's), as 1/n. Small strain; resin 1 MPa, Poisson's ratio 0.45.
"""

from __future__ import annotations

import argparse
import time

import attrs
import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.design.strut_cell import strut_cell
from mu_addon.fem.model import Model
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.compression import compress
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.homogenize.specimen import block_specimen
from mu_addon.resolved.strut import strut_mesh

RESIN_MPa, POISSON = 1.0, 0.45
# Of nominal strain; the curve is straight there to 1e-4.
_STRAIN = 1e-4


def sheared(specimen):
    """Stress over strain in MPa of a block whose outer faces move as a uniform shear xz has it."""
    mesh, half = specimen.mesh, specimen.side_mm / 2
    x, y, z = mesh.nodes.T
    held = np.zeros(mesh.nodes.shape, bool)
    held[(mesh.nodes == half).any(axis=1)] = True
    # Odd across x and z, even across y.
    held[x == 0, 1:] = True
    held[z == 0, :2] = True
    held[y == 0, 1] = True
    affine = np.zeros_like(mesh.nodes)
    affine[:, 0], affine[:, 2] = z / 2, x / 2
    whole = attrs.evolve(mesh, symmetry=(), tip=mesh.tip[:0])
    model = Model(whole, held, threads=1)
    m = model.parameters(specimen.materials)
    none = np.zeros_like(mesh.nodes)
    model.factor.factor(model.tangent(none, 0.0, m))
    # Strains so small that the force is linear; from the affine field the rest gives way.
    scale = 1e-6
    force = model.residual(scale * affine, 0.0, m) / scale
    step = model.factor.solve(force.ravel()[model.free])
    u = affine.copy()
    u.ravel()[model.free] -= step
    energy = 0.5 * float((model.residual(scale * u, 0.0, m) / scale * u).sum())
    return 2.0 * energy / half**3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="*", default=[2, 3, 4, 6, 8])
    parser.add_argument("--rings", type=int, default=1)
    parser.add_argument("--layers", type=int, default=5)
    parser.add_argument("--reference", type=float, default=4.0, help="Elements to a strut's diameter.")
    options = parser.parse_args()
    unit = load_preset("mu-1.0x")
    cell, d = strut_cell(unit), unit.printed

    def told(name, mesh):
        began = time.perf_counter()
        found = effective_tensor(mesh, cell_materials(cell, mesh, RESIN_MPa, POISSON))
        print(
            f"{name}: E[100] {1e3 * found.E100:.4f}, C44 {1e3 * found.C44:.4f}, C11 {1e3 * found.C11:.4f} "
            f"of a thousandth of the resin's; {len(mesh.tets)} elements, {time.perf_counter() - began:.1f} s",
            flush=True,
        )
        return found

    reference = told("pytetwild's octant", mesh_cell(cell, CellMeshSettings(per_diameter=options.reference)))
    for rings, layers in sorted({(1, 5), (1, 8), (2, 8), (2, 16), (options.rings, options.layers)}):
        told(f"swept octant, {rings} rings, {layers} layers", strut_mesh(d, rings, layers))
    mesh = strut_mesh(d, options.rings, options.layers)
    materials = cell_materials(cell, mesh, RESIN_MPa, POISSON)
    print("\n| cells a side | E / E[100] - 1 % | C44 / C44 - 1 % | s |\n| --- | --- | --- | --- |")
    rows = []
    for cells in options.cells:
        began = time.perf_counter()
        block = block_specimen(mesh, cells, materials)
        pulled = compress(block, (_STRAIN,), "slide", threads=1, stability=False).curve
        E = -float(pulled.stress_MPa[0]) / _STRAIN
        rows.append([cells, E / reference.E100, sheared(block) / reference.C44])
        offs = " | ".join(f"{100 * (v - 1):+.2f}" for v in rows[-1][1:])
        print(f"| {cells} | {offs} | {time.perf_counter() - began:.0f} |", flush=True)
    if len(rows) > 1:
        (n, *a), (k, *b) = rows[-2:]
        limit = [(k * q - n * p) / (k - n) for p, q in zip(a, b, strict=True)]
        print("| endless, by 1/n | " + " | ".join(f"{100 * (v - 1):+.2f}" for v in limit) + " | |")


if __name__ == "__main__":
    main()
