"""Every answer that is known, on several meshes of each element: docs/engineering/verification.md.

    python -m benchmarks.verification [--cases cook beam ...] [--meshes 2]

The cases are those of tests/fem, which hold each of them to a bound on small meshes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from benchmarks.table import circumstances, options_of, print_head, print_row
from mu_addon.errors import ConvergenceError

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.fem import cases, land, manufactured

ELEMENTS = {
    "linear": (1, {}),
    "quadratic": (2, {}),
    "quadratic, mean dilatation": (2, {"mean_dilatation": True}),
}


def table(head, rows):
    """Print a Markdown table row by row, as the rows come."""
    print_head(*head)
    for row in rows:
        print_row(*row)
    print()


def rate(errors, sizes):
    """Order of convergence of the last two errors, as text."""
    if len(errors) < 2:
        return ""
    return f"{np.log(abs(errors[-2] / errors[-1])) / np.log(sizes[-1] / sizes[-2]):.1f}"


def convergence(case, elements, meshes):
    """Rows of one case: element, cells, unknowns, value, error, order of convergence, seconds."""
    for name in elements:
        order, options = ELEMENTS[name]
        errors, sizes = [], case.sizes[order][:meshes]
        for k, size in enumerate(sizes):
            try:
                answer = case.answer(size, order, **options)
            except ConvergenceError as why:
                yield name, str(size), "", why.what, "", "", ""
                break
            errors.append(case.error(answer))
            yield (
                name,
                str(size),
                str(answer.unknowns),
                f"{answer.value:.4f}",
                f"{100 * errors[-1]:+.2g}",
                rate(errors, sizes[: k + 1]),
                f"{answer.seconds:.1f}",
            )


def compressibility(kappas, size=4):
    """Rows that show what a finite bulk modulus does to an incompressible answer on one mesh."""
    for title, solve in (("beam", land.beam), ("ellipsoid, inside", land.ventricle)):
        yield title, *(f"{solve(size, 2, kappa=kappa)[0]:.4f}" for kappa in kappas)


def orders(field, elements, meshes):
    """Rows of a manufactured solution: element, cells, errors and their orders."""
    for name in elements:
        order, options = ELEMENTS[name]
        sizes = (2, 4, 8)[:meshes]
        found = []
        for k, size in enumerate(sizes):
            found.append(manufactured.errors(*manufactured.solve(size, order, field, **options), field))
            l2, h1 = zip(*found, strict=True)
            row = (f"{l2[-1]:.2e}", rate(l2, sizes[: k + 1]), f"{h1[-1]:.2e}", rate(h1, sizes[: k + 1]))
            yield name, str(size), *row


def main():
    known = cases.cases()
    options = options_of(__doc__)
    options.add_argument("--cases", nargs="+", default=[*known, "manufactured", "kappa"])
    options.add_argument("--elements", nargs="+", choices=ELEMENTS, default=list(ELEMENTS))
    options.add_argument("--meshes", type=int, default=4, help="how many of a case's meshes, coarse to fine")
    given = options.parse_args()
    print(circumstances() + "\n")
    head = ("element", "cells", "unknowns", "value", "error %", "order", "s")
    for name, case in known.items():
        if name in given.cases:
            print(f"### {case.title}\n\n{case.quantity}: {case.known:.6g} ({case.source})\n")
            table(head, convergence(case, given.elements, given.meshes))
    if "manufactured" in given.cases:
        for title, field in (("nu = 0.3", manufactured.WAVES), ("nu = 0.4999", manufactured.SHEARS)):
            print(f"### Manufactured solution, {title}\n")
            table(
                ("element", "cells", "L2, mm", "order", "H1", "order"),
                orders(field, given.elements, given.meshes),
            )
    if "kappa" in given.cases:
        kappas = (1.0, 3.0, 10.0)
        print("### Bulk modulus in MPa of Land's problems, quadratic elements\n")
        table(("problem, 4 cells", *(f"{k:g}" for k in kappas)), compressibility(kappas))


if __name__ == "__main__":
    main()
