"""Moduli of periodic body-centred cells over their struts' diameters, and the polynomials fitted to them.

    python -m benchmarks.grading [--rings 3] [--layers 18]

Prints every cell, the coefficients of `fem/graded_lattice.py`, the largest misfit, and cells between those of
the fit on a finer mesh.
"""

from __future__ import annotations

import attrs
import numpy as np

from benchmarks.table import options_of
from mu_addon.design import load_preset
from mu_addon.fem.graded_lattice import RANGE, design_matrix
from mu_addon.fem.materials import Materials
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.resolved.strut import strut_mesh

JUNCTIONS = np.geomspace(RANGE[0], 0.3, 9)
SWELLS = (1.0, 1.15, 4.0 / 3.0, 1.6, 2.0)
WIDEST = RANGE[1]
NAMES = ("E100", "C12", "C44")


def cell(junction: float, midspan: float, rings: int, layers: int) -> tuple[float, float, float]:
    """E100, C12 and C44 of a cell of edge 1 and resin of modulus 1; its struts' diameters."""
    d = attrs.evolve(
        load_preset("mu-1.0x").dimensions, cell=1.0, junction_diameter=junction, midspan_diameter=midspan
    )
    mesh = strut_mesh(d, rings, layers)
    count = len(mesh.tets)
    found = effective_tensor(mesh, Materials.neo_hooke(np.ones(count), np.full(count, 0.45)))
    return found.E100, float(found.C[0, 1]), found.C44


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--rings", type=int, default=3)
    parser.add_argument("--layers", type=int, default=18)
    options = parser.parse_args()
    places = [(x, q * x) for x in JUNCTIONS.tolist() for q in SWELLS if q * x <= WIDEST]
    values = []
    print("junction/U  midspan/U  E100  C12  C44  (of the resin's modulus)")
    for place in places:
        values.append(cell(*place, options.rings, options.layers))
        print("{:.4f}  {:.4f}  {:.5e}  {:.5e}  {:.5e}".format(*place, *values[-1]), flush=True)
    A = design_matrix(*np.array(places).T)
    logs = np.log(values)
    found = np.linalg.lstsq(A, logs, rcond=None)[0]
    for name, column in zip(NAMES, found.T, strict=True):
        print(name, [round(float(c), 5) for c in column])
    misfit = np.abs(np.expm1(A @ found - logs)).max(axis=0)
    print("largest misfit", dict(zip(NAMES, misfit.round(4).tolist(), strict=True)))
    for place in ((0.06, 0.08), (0.12, 0.16), (0.2, 0.25), (0.18, 0.3)):
        fine = np.array(cell(*place, options.rings + 1, options.layers + 6))
        own = np.exp(design_matrix(*np.array([place]).T) @ found)[0]
        print("{:.3f}  {:.3f}  finer over fitted".format(*place), (fine / own).round(4).tolist(), flush=True)


if __name__ == "__main__":
    main()
