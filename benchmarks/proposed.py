"""A proposed unit by another code on a mesh of its own: felupe, after a mesher that no search uses.

    python benchmarks/proposed.py out/finger/proposed-1.toml [--pressure -10 30] [--mesher pytetwild]

The search and the check of its proposals mesh by gmsh, the membrane as a grid along its profile. Here
pytetwild fills the unit's surfaces with straight-sided tetrahedra, and felupe's elements, law and Newton's
method find the displacements; the tip's angle is read by a plane fitted to its end face. Both codes stand on
both meshes, so that code and mesh are told apart; felupe with an unsymmetric factorisation, as a Newton step
from the last pressure may meet an indefinite tangent. Needs `pip install -e '.[benchmarks]'`.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from circumstances import circumstances
from peers.problem import Problem
from peers.process import run

from mu_addon.design.parameters import Unit, read_unit
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE, Mesh
from mu_addon.meshing.settings import MeshSettings

STEP_KPA = 2.5


def problem_of(unit: Unit, mesh: Mesh, name: str, pressure_kPa: float) -> Problem:
    """The unit on a mesh under a pressure reached in equal steps of at most 2.5 kPa."""
    material, lattice = unit.material, mesh.region == LATTICE
    steps = int(np.ceil(abs(pressure_kPa) / STEP_KPA))
    return Problem(
        name,
        mesh,
        np.where(lattice, material.lattice_modulus_kPa, material.membrane_modulus_kPa) / 1e3,
        np.where(lattice, material.lattice_poisson, material.membrane_poisson),
        np.linspace(0, pressure_kPa * 1e-3, steps + 1)[1:],
    )


def plane_angle_deg(mesh: Mesh, u: np.ndarray) -> float:
    """Bending angle of the tip by the least-squares plane through its moved nodes: no code of ours in it."""
    y, z = (mesh.nodes[mesh.tip] + u[mesh.tip])[:, 1:].T
    return float(-np.degrees(np.arctan(np.polyfit(y, z, 1)[0])))


def main() -> None:
    """Print a row for each pressure, mesh and code."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("unit", type=Path, help="proposed-N.toml of an optimisation")
    options.add_argument("--pressure", type=float, nargs="+", default=[-10.0, 30.0])
    options.add_argument("--refine", type=float, default=0.75)
    options.add_argument("--order", type=int, default=2)
    options.add_argument("--mesher", nargs="+", default=["gmsh", "pytetwild"])
    options.add_argument("--keep", type=Path)
    given = options.parse_args()
    unit = read_unit(given.unit)
    if unit.grading.names:
        raise SystemExit("a graded lattice is not isotropic: give a unit without [grading]")
    print(circumstances())
    print("| kPa | mesh | unknowns | code | angle, ours | angle, plane of the tip |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.keep or Path(scratch)
        for mesher in given.mesher:
            settings = MeshSettings(refine=given.refine, order=given.order)
            mesh = mesh_unit(unit, settings, mesher=mesher, cache=folder)
            for pressure in given.pressure:
                problem = problem_of(unit, mesh, f"{mesher} {pressure:g} kPa", pressure)
                for code in ("ours", "with_felupe"):
                    found = run(code, problem, folder / f"{mesher}{pressure:g}")
                    if found is None:
                        continue
                    angles = bending_angle_deg(mesh, found.u), plane_angle_deg(mesh, found.u)
                    row = (
                        f"{pressure:g}",
                        mesher,
                        str(found.unknowns),
                        found.code,
                        *(f"{a:.3f}" for a in angles),
                    )
                    print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
