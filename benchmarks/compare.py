"""Same as others: displacement fields of a coarse real unit from this package, CalculiX and felupe.

    python -m benchmarks.compare [--refine 0.5] [--order 1 2] [--pressure 5 20] [--keep DIR]

The half unit with its mirror plane, both regions' moduli, pressed inside. Fails where two fields differ by
more than 1e-4 of their norm. CalculiX takes the pressure of a quadratic face at three points, which do not
integrate it exactly; it is compared with this package's answer by either rule. --keep leaves the arrays
and the CalculiX input files in a folder.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.table import circumstances, options_of, print_head, print_row
from mu_addon.design.parameters import load_preset
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings

from .peers.problem import Problem
from .peers.process import run

AGREEMENT = 1e-4
STEP_KPA = 2.5
CODES = ("ours", "with_felupe_symmetric", "with_calculix")
HEAD = (
    "order",
    "unknowns",
    "kPa",
    "largest u mm",
    "felupe against ours",
    "CalculiX against ours, its face rule",
    "CalculiX against ours, exact rule",
)


def unit_problem(refine, order, pressure_kPa, preset="mu-1.0x"):
    """The half unit under a pressure reached in equal steps of at most 2.5 kPa."""
    unit = load_preset(preset)
    mesh = mesh_unit(unit, MeshSettings(refine=refine, order=order))
    material, lattice = unit.material, mesh.region == LATTICE
    steps = int(np.ceil(abs(pressure_kPa) / STEP_KPA))
    return Problem(
        f"{preset}, refine {refine:g}, order {order}",
        mesh,
        np.where(lattice, material.lattice_modulus_kPa, material.membrane_modulus_kPa) / 1e3,
        np.where(lattice, material.lattice_poisson, material.membrane_poisson),
        np.linspace(0, pressure_kPa * 1e-3, steps + 1)[1:],
    )


def difference(a, b):
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def main():
    options = options_of(__doc__)
    options.add_argument("--refine", type=float, default=0.5)
    options.add_argument("--order", nargs="+", type=int, choices=(1, 2), default=[1, 2])
    options.add_argument("--pressure", nargs="+", type=float, default=[5.0, 20.0], help="kPa")
    options.add_argument("--keep", type=Path)
    given = options.parse_args()
    print(circumstances())
    print()
    print_head(*HEAD)
    worst = 0.0
    with tempfile.TemporaryDirectory() as scratch:
        for order in given.order:
            for pressure in given.pressure:
                problem = unit_problem(given.refine, order, pressure)
                folder = (given.keep or Path(scratch)) / f"order{order}_{pressure:g}kPa"
                ours, felupe, calculix = (run(code, problem, folder) for code in CODES)
                cells = [order, ours.unknowns, f"{pressure:g}", f"{ours.largest_mm:.6f}"]
                cells.append(f"{difference(felupe.u, ours.u):.1e}" if felupe else "not run")
                worst = max(worst, difference(felupe.u, ours.u) if felupe else 0.0)
                if calculix:
                    same_rule = run("ours_calculix_rule", problem, folder) if order == 2 else ours
                    apart = difference(calculix.u, same_rule.u)
                    worst = max(worst, apart)
                    cells += [f"{apart:.1e}", f"{difference(calculix.u, ours.u):.1e}"]
                else:
                    cells += ["not run"] * 2
                print_row(*cells)
    if worst > AGREEMENT:
        sys.exit(f"a field differs by {worst:.1e}, more than {AGREEMENT:g}")


if __name__ == "__main__":
    main()
