"""How the answers depend on the mesh: tip angle and J_hat on three or more refinements, as tables.

    python benchmarks/convergence.py angle [--refine 0.75 1 1.5 2]
    python benchmarks/convergence.py J [--refine 0.75 1 1.5]

J_hat is taken over seven instants of the grasp protocol (0, -20, 0, 20, 40, 20, 0 kPa).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress
from mu_addon.usecases.simulate_and_place.job import Job, grasp
from mu_addon.usecases.simulate_and_place.study import Study

PRESSURES = np.array([0.0, -10.0, -20.0, 0.0, 10.0, 20.0, 30.0, 40.0])


def job_of(preset, refine):
    return Job(
        load_preset(preset), grasp(), mesh=MeshSettings(refine=refine), times=7, stations=51, mesh_check=False
    )


def angles(preset, refines):
    print("| refine | nodes | unknowns | -20 kPa | 20 kPa | 40 kPa | s |\n" + "| --- " * 7 + "|")
    for refine in refines:
        job = job_of(preset, refine)
        with tempfile.TemporaryDirectory() as folder, run_to_end(Progress()) as context:
            mesh = Study(job, Path(folder), context).make_mesh()
        start = time.perf_counter()
        model = Model(mesh)
        path = simulate(Equilibrium(model, materials_of(job.unit, mesh)), np.arange(8.0), PRESSURES)
        found = {round(s.pressure_MPa * 1e3): bending_angle_deg(mesh, s.u) for s in path.solved}
        row = " | ".join(f"{found[p]:.3f}" for p in (-20, 20, 40))
        seconds = time.perf_counter() - start
        print(f"| {refine:g} | {len(mesh.nodes)} | {len(model.free)} | {row} | {seconds:.0f} |", flush=True)


def deviations(preset, refines):
    tables = {}
    for refine in refines:
        with tempfile.TemporaryDirectory() as folder, run_to_end(Progress()) as context:
            study = Study.open(job_of(preset, refine), Path(folder), context)
            study.make_mesh()
            study.simulate()
            study.place()
        tables[refine] = study.ranking.evaluations
        J = " | ".join(f"{study.ranking.J_hat_mm[w.name]:.4f}" for w in study.windows)
        print(f"| {refine:g} | {J} |", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("what", choices=("angle", "J"))
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--refine", type=float, nargs="+", default=[0.75, 1.0, 1.5])
    given = options.parse_args()
    (angles if given.what == "angle" else deviations)(given.preset, given.refine)


if __name__ == "__main__":
    main()
