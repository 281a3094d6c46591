"""How stiff the printed solid's struts are as it meshes them: an eighth of a cell by the same steps.

    python -m benchmarks.printed_solid.octant [--edge 1.3 1.0 0.9 0.6]

E[100] and C44 of the endless lattice in kPa for a resin of 1 MPa and Poisson's ratio 0.45, and the volume.
"""

from __future__ import annotations

import argparse

import attrs
import numpy as np
from manifold3d import Manifold

from mu_addon.design.dimensions import Dimensions
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.solid import QUALITY, Facets, lattice_solid
from mu_addon.fem.materials import Materials
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.meshing.quality import element_volumes

from .__main__ import COARSE, arrays, curved, divided, filled
from .remesh import Reference, remesh


def octant(d: Dimensions, facets: Facets) -> Manifold:
    """The struts in an eighth of a cell, beside the axis, shifted to the origin."""
    low = d.bounds[2][0]
    box = Manifold.cube([d.cell / 2.0] * 3).translate([d.cell / 2.0, d.cell / 2.0, low])
    return (
        (lattice_solid(d, lattice_of(d), facets) ^ box).translate([-d.cell / 2.0, -d.cell / 2.0, -low])
    ).simplify(1e-3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edge", type=float, nargs="*", default=[1.3, 1.0, 0.9, 0.6])
    options = parser.parse_args()
    d = load_preset("mu-1.0x").dimensions
    drawn, fine = octant(d, COARSE), octant(d, QUALITY["interactive"])
    reference = Reference.of(*arrays(fine.refine_to_length(0.3)))
    planes = [(axis, plane) for axis in range(3) for plane in (0.0, d.cell / 2.0)]
    print("| edge mm | elements | volume / solid's | E[100] | C44 |\n| --- | --- | --- | --- | --- |")
    for edge in options.edge:
        nodes, tets = divided(*filled(*remesh(*arrays(drawn), edge, reference), edge))
        mesh = curved(nodes, tets, d, reference, planes)
        count = len(mesh.tets)
        mesh = attrs.evolve(mesh, symmetry=(), base=mesh.base[:0])
        found = effective_tensor(mesh, Materials.neo_hooke(np.full(count, 1.0), np.full(count, 0.45)))
        share = element_volumes(mesh).sum() / fine.volume()
        print(
            f"| {edge:g} | {count} | {share:.4f} | {1e3 * found.E100:.3f} | {1e3 * found.C44:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
