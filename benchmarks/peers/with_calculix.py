"""CalculiX: writes the input file, runs `ccx`, reads the displacements back.

A pressure on element faces (P) follows the deformed face under NLGEOM. Displacements come back with
seven digits.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time

import numpy as np

from mu_addon.meshing.mesh import TET_FACES

from .problem import Result
from .process import Absent, answer

# The corner opposite to each of CalculiX's faces, 1-2-3, 1-4-2, 2-4-3, 3-4-1.
_FACE_OPPOSITE = np.array([4, 3, 1, 2])

# CalculiX takes a residual below 1e-6 for zero, whatever the unit. Forces here are some mN: told in N they
# pass as converged too early, so stresses go in as Pa and forces come out in micronewton.
STRESS = 1e6

# Largest residual over the average force and largest correction over the increment, instead of 0.005 and
# 0.01; the rest closes the ways round them.
CONTROLS = "1.e-6,1.e-5,0.01,,1.e-6,1.e-9,1.e-3,1.e-12"


def write_input(problem, path, controls=CONTROLS):
    """The .inp file of a problem: the same steps, law, supports and loads."""
    mesh = problem.mesh
    kind = "C3D4" if mesh.order == 1 else "C3D10"
    with path.open("w") as out:
        out.write(f"** {problem.name}; mm, micronewton, Pa\n*NODE, NSET=ALL\n")
        table = np.column_stack([np.arange(1, len(mesh.nodes) + 1), mesh.nodes])
        np.savetxt(out, table, fmt="%d, %.12e, %.12e, %.12e")
        groups = problem.groups()
        for i, (_, _, elements) in enumerate(groups):
            out.write(f"*ELEMENT, TYPE={kind}, ELSET=G{i}\n")
            np.savetxt(out, np.column_stack([elements + 1, mesh.tets[elements] + 1]), fmt="%d", delimiter=",")
        for i, (mu, kappa, _) in enumerate(groups):
            out.write(
                f"*MATERIAL, NAME=M{i}\n*HYPERELASTIC, NEO HOOKE\n"
                f"{mu * STRESS / 2:.15g}, {2 / (kappa * STRESS):.15g}\n"
            )
            out.write(f"*SOLID SECTION, ELSET=G{i}, MATERIAL=M{i}\n")
        out.write("*BOUNDARY\n")
        for node, component in np.argwhere(problem.fixed()):
            out.write(f"{node + 1}, {component + 1}, {component + 1}\n")
        out.write("*STEP, NLGEOM, INC=1000\n*STATIC, DIRECT\n")
        out.write(f"{1 / len(problem.pressures_MPa):.15g}, 1.\n")
        if controls:
            out.write(f"*CONTROLS, PARAMETERS=FIELD\n{controls}\n")
        out.write("*DLOAD\n")
        for element, face in zip(*faces_of(mesh, mesh.cavity_corners), strict=True):
            out.write(f"{element + 1}, P{face}, {problem.pressures_MPa[-1] * STRESS:.15g}\n")
        out.write("*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*END STEP\n")


def faces_of(mesh, triangles):
    """Element and CalculiX's number, (f,) each, of faces of the mesh by their corners (f, 3)."""
    faces = np.sort(mesh.tets[:, :4][:, TET_FACES].reshape(-1, 3), axis=1)
    count = len(mesh.nodes)

    def keys(sorted_):
        return (sorted_[:, 0].astype(np.int64) * count + sorted_[:, 1]) * count + sorted_[:, 2]

    of_all = keys(faces)
    order = np.argsort(of_all)
    at = order[np.searchsorted(of_all[order], keys(np.sort(triangles, axis=1)))]
    # TET_FACES lists the face opposite to each corner in turn.
    number = np.empty(4, int)
    number[_FACE_OPPOSITE - 1] = np.arange(1, 5)
    return at // 4, number[at % 4]


def read_displacements(path, nodes):
    """Displacements (n, 3) in mm of the last increment in a .dat file."""
    text = path.read_text().rsplit("displacements", 1)[1].split("\n", 1)[1]
    table = np.array(text.split(), dtype=float).reshape(-1, 4)
    u = np.zeros((nodes, 3))
    u[table[:, 0].astype(int) - 1] = table[:, 1:]
    return u


def solve(problem, folder, controls=CONTROLS, name="tight controls"):
    ccx = shutil.which("ccx")
    if ccx is None:
        raise Absent("ccx is not on the path; on Debian: apt-get install calculix-ccx")
    start = time.perf_counter()
    job = folder / ("calculix_tight" if controls else "calculix_default")
    write_input(problem, job.with_suffix(".inp"), controls)
    ready = time.perf_counter()
    done = subprocess.run([ccx, "-i", job.name], cwd=folder, capture_output=True, text=True, check=False)
    end = time.perf_counter()
    if "Job finished" not in done.stdout:
        raise RuntimeError(f"ccx did not finish:\n{done.stdout[-3000:]}")
    newton = sum(int(row.split()[3]) for row in job.with_suffix(".sta").read_text().splitlines()[2:])
    version = re.search(r"Version (\S+)", subprocess.run([ccx, "-v"], capture_output=True, text=True).stdout)
    u = read_displacements(job.with_suffix(".dat"), len(problem.mesh.nodes))
    unknowns = int((~problem.fixed()).sum())
    label = f"CalculiX {version[1] if version else '?'}, {name}"
    return Result(label, ready - start, end - ready, unknowns, newton, u)


if __name__ == "__main__":
    answer(solve)
