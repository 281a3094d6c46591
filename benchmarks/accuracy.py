"""Seconds to 1 % of the converged answer, with linear and quadratic elements, here and elsewhere.

    python benchmarks/accuracy.py [--body chamber unit] [--codes ours with_felupe with_calculix_default]

First the answer on finer and finer meshes of either order; the finest quadratic one
counts as converged. Then each code on the coarsest mesh from which on an order stays within 1 %.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from circumstances import circumstances
from compare import unit_problem
from peers.chamber import chamber
from peers.process import run

from mu_addon.fem.bending_angle import bending_angle_deg

GOAL = 0.01


def largest(problem, u):
    return float(np.linalg.norm(u, axis=1).max())


def angle(problem, u):
    return bending_angle_deg(problem.mesh, u)


# Body: what is read, its unit, how it is made of a size and an order, and the sizes by order.
BODIES = {
    "chamber": (
        largest,
        "largest displacement, mm",
        # Stiffness by element centre moves by some percent from mesh to mesh: here it is uniform.
        lambda size, order: chamber(size, order, uniform_MPa=0.1),
        {1: (2.0, 1.4, 0.9, 0.59, 0.45), 2: (3.0, 2.0, 1.5, 1.24, 0.95, 0.75)},
    ),
    "unit": (
        angle,
        "bending angle at 20 kPa, degrees",
        lambda size, order: unit_problem(size, order, 20.0),
        {1: (0.7, 1.0, 1.6, 2.4), 2: (0.35, 0.5, 0.7, 1.0)},
    ),
}


def first_within(answers, goal):
    """Index of the coarsest mesh from which on every answer is within 1 %; None if there is none."""
    good = np.abs(np.array(answers) / goal - 1) < GOAL
    bad = np.flatnonzero(~good)
    first = bad[-1] + 1 if len(bad) else 0
    return int(first) if first < len(answers) else None


def study(body, codes, folder):
    read, unit, make, sizes = BODIES[body]
    problems = {order: [make(size, order) for size in sizes[order]] for order in (1, 2)}
    found = {order: [run("ours", p, folder) for p in problems[order]] for order in (1, 2)}
    answers = {
        order: [read(p, r.u) for p, r in zip(problems[order], found[order], strict=True)] for order in (1, 2)
    }
    goal = answers[2][-1]
    print(f"\n{body}: {unit}; converged: {goal:.4f} (finest of order 2)\n")
    print("| order | size | tetrahedra | unknowns | answer | off by | steps s |\n" + "| --- " * 7 + "|")
    for order in (1, 2):
        for size, problem, result, answer in zip(
            sizes[order], problems[order], found[order], answers[order], strict=True
        ):
            off = f"{100 * (answer / goal - 1):+.2f} %"
            print(
                f"| {order} | {size:g} | {len(problem.mesh.tets)} | {result.unknowns} | {answer:.4f} | {off} "
                f"| {result.solve_s:.2f} |",
                flush=True,
            )
    print("\n| code | order | unknowns | steps s to 1 % |\n| --- | --- | --- | --- |")
    for order in (1, 2):
        first = first_within(answers[order], goal)
        at = problems[order][first if first is not None else -1]
        for code in codes:
            if first is None and code != "ours":
                continue
            result = run(code, at, folder)
            if result is None:
                continue
            reached = f"{result.solve_s:.2f}"
            if first is None:
                reached = f"not reached in {reached} s"
            print(f"| {result.code} | {order} | {result.unknowns} | {reached} |", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--body", nargs="+", choices=BODIES, default=list(BODIES))
    options.add_argument("--codes", nargs="+", default=["ours", "with_felupe", "with_calculix_default"])
    given = options.parse_args()
    print(circumstances())
    with tempfile.TemporaryDirectory() as scratch:
        for body in given.body:
            study(body, given.codes, Path(scratch))


if __name__ == "__main__":
    main()
