"""This package and its peers on the same mesh, law, load steps and tolerance: one table.

    python -m benchmarks.peers.run [--order 1 2] [--codes ours with_calculix] [--keep DIR]

Every code runs alone in its own process. Needs `pip install -e '.[benchmarks]'` for felupe, Debian's
calculix-ccx for CalculiX, and dolfinx for FEniCSx; one that is missing is left out, loudly.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.table import circumstances, options_of, print_head, print_row

from .chamber import chamber
from .ours import imbalance
from .process import run

CODES = (
    "ours",
    "with_felupe",
    "with_felupe_symmetric",
    "with_fenicsx",
    "with_calculix",
    "with_calculix_default",
)
HEAD = (
    "code",
    "set-up s",
    "steps s",
    "x ours",
    "linear systems",
    "largest u mm",
    "field against ours",
    "imbalance",
)


def table(problem, codes, folder, threads):
    print(
        f"\n{problem.name}: {len(problem.mesh.tets)} tetrahedra, {(~problem.fixed()).sum()} unknowns, ",
        end="",
    )
    print(f"{len(problem.pressures_MPa)} steps to {problem.pressures_MPa[-1] * 1e3:g} kPa\n")
    print_head(*HEAD)
    ours = None
    for code in codes:
        found = run(code, problem, folder, threads)
        if found is None:
            continue
        ours = ours or found
        difference = np.linalg.norm(found.u - ours.u) / np.linalg.norm(ours.u)
        row = (
            found.code,
            f"{found.set_up_s:.2f}",
            f"{found.solve_s:.2f}",
            f"{found.solve_s / ours.solve_s:.1f}",
            found.newton,
            f"{found.largest_mm:.6f}",
            f"{difference:.0e}",
            f"{imbalance(problem, found.u):.0e}",
        )
        print_row(*row)


def main():
    options = options_of(__doc__)
    options.add_argument("--order", nargs="+", type=int, choices=(1, 2), default=[1, 2])
    options.add_argument("--codes", nargs="+", choices=CODES, default=CODES)
    options.add_argument("--threads", type=int, default=2)
    options.add_argument("--keep", type=Path, help="folder for input files and fields")
    given = options.parse_args()
    print(f"{circumstances()}; {given.threads} threads each")
    print("SOFA is not run: neither pip nor Debian has it.")
    with tempfile.TemporaryDirectory() as scratch:
        for order in given.order:
            folder = (given.keep or Path(scratch)) / f"order{order}"
            table(chamber(order), given.codes, folder, given.threads)


if __name__ == "__main__":
    main()
