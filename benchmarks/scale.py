"""Seconds and memory from 20k to 500k unknowns.

    python benchmarks/scale.py [--body unit chamber] [--size 1.24 0.6] [--keep DIR]

Each size runs alone in a child process, whose peak memory is told; meshes are made beforehand, and kept in
a folder with --keep. "step" is one equilibrium from rest to 1 kPa.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from circumstances import circumstances
from compare import unit_problem
from peers.chamber import chamber
from peers.problem import Problem

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest

# Refinements of the unit and element sizes (mm) of the chamber, all of order 2.
BODIES = {
    "unit": (lambda size: unit_problem(size, 2, 1.0), (0.6, 1.0, 1.4, 2.0, 2.6)),
    "chamber": (lambda size: chamber(size, 2), (1.85, 1.24, 0.95, 0.75, 0.6)),
}
HEAD = (
    "size",
    "unknowns",
    "model s",
    "analyse s",
    "factor s",
    "solve s",
    "tangent s",
    "residual s",
    "step s",
)
HEAD += ("step's factors and solves", "peak GB")
PRESSURE_MPA = 1e-3


def timed(call):
    start = time.perf_counter()
    answer = call()
    return time.perf_counter() - start, answer


def child(path):
    """Everything measured at one size, as JSON on the last line."""
    problem = Problem.load(path)
    materials = Materials.neo_hooke(problem.modulus_MPa, problem.poisson)
    model_s, model = timed(lambda: Model(problem.mesh))
    u, parameters = rest(problem.mesh).u, model.parameters(materials)
    for call in (model.tangent, model.residual):
        call(u, PRESSURE_MPA, parameters)
    tangent_s, values = timed(lambda: model.tangent(u, PRESSURE_MPA, parameters))
    residual_s, force = timed(lambda: model.residual(u, PRESSURE_MPA, parameters))
    analyse_s, factor = timed(lambda: model.factor)
    factor_s, _ = timed(lambda: factor.factor(values))
    b = force.ravel()[model.free]
    solve_s, _ = timed(lambda: factor.solve(b))
    step_s, states = timed(lambda: Equilibrium(model, materials).path([PRESSURE_MPA], rest(problem.mesh)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    figures = {
        "unknowns": len(model.free),
        "seconds": [model_s, analyse_s, factor_s, solve_s, tangent_s, residual_s, step_s],
        "cost": [states[-1].factorisations, states[-1].iterations],
        "peak": peak,
    }
    print(json.dumps(figures))


def exponents(unknowns, columns):
    """Slope of each column in the unknowns, both in logarithms."""
    x = np.log(unknowns)
    return [np.polyfit(x, np.log(column), 1)[0] for column in columns]


def scan(body, chosen, folder):
    make, sizes = BODIES[body]
    print(f"\n{body}, order 2\n\n| " + " | ".join(HEAD) + " |\n" + "| --- " * len(HEAD) + "|", flush=True)
    found = []
    for size in chosen or sizes:
        path = folder / f"{body}_{size:g}.npz"
        if not path.exists():
            make(size).save(path)
        command = [sys.executable, __file__, "--child", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{body} {size:g}:\n{done.stderr[-3000:]}")
        one = json.loads(done.stdout.splitlines()[-1])
        found.append(one)
        cells = [f"{size:g}", one["unknowns"], *(f"{s:.3g}" for s in one["seconds"])]
        cells += [" and ".join(map(str, one["cost"])), f"{one['peak']:.2f}"]
        print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    if len(found) > 1:
        unknowns = [one["unknowns"] for one in found]
        slopes = exponents(unknowns, [*zip(*(one["seconds"] for one in found), strict=True)])
        slope_of_peak = exponents(unknowns, [[one["peak"] for one in found]])[0]
        cells = ["exponent", "", *(f"{s:.2f}" for s in slopes), "", f"{slope_of_peak:.2f}"]
        print("| " + " | ".join(cells) + " |")


def main():
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2])
        return
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--body", nargs="+", choices=BODIES, default=list(BODIES))
    options.add_argument("--size", nargs="+", type=float, help="refinements of the unit, mm of the chamber")
    options.add_argument("--keep", type=Path)
    given = options.parse_args()
    print(circumstances())
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for body in given.body:
            scan(body, given.size, folder)


if __name__ == "__main__":
    main()
