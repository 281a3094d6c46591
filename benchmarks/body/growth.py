"""How the cost of beams and of solid struts grows with the lattice's cells, from the mesh to a load step.

    python -m benchmarks.body.growth [--cells 3x4x3 3x4x6 3x4x20 5x4x20] [--refine 1]

Cells across x, across y and along the unit, which has one chamber a cell. A half of `mu-1.0x` with so many,
without contact. Seconds are of processor time of one thread; a load step is from rest to -1 kPa, memory the
process's largest so far, so list sizes from small to large.
"""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from typing import Any

import attrs

from benchmarks.table import options_of, print_head, print_row
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import Unit, load_preset
from mu_addon.errors import MuError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.unit_ranking import UnitStudy

STEP_KPA = -1.0


def unit_of(cells: str) -> Unit:
    """The preset with cells given as "3x4x6": across x, across y, along."""
    across_x, across_y, along = map(int, cells.split("x"))
    preset = load_preset("mu-1.0x")
    lattice = attrs.evolve(preset.lattice, cells_x=across_x, cells_y_plus=across_y - 2)
    chambers = attrs.evolve(preset.chambers, count=along)
    return attrs.evolve(preset, lattice=lattice, chambers=chambers)


def seconds(call: Callable[[], Any]) -> tuple[float, Any]:
    """Processor seconds of a call, and what it returns."""
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--cells", nargs="*", default=["3x4x3", "3x4x6", "3x4x20", "5x4x20"])
    parser.add_argument("--refine", type=float, default=1.0)
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    columns = ["mesh", "order and analysis", "tangent", "factorisation", "solution", "load step"]
    print_head("struts", "cells", "unknowns", *(f"{name} s" for name in columns), "factorisations", "GB")
    for name in ("beams", "solid"):
        for cells in options.cells:
            try:
                print_row(name, cells, *costs(unit_of(cells), name == "solid", options.refine))
            except MuError as why:
                print_row(name, cells, why)


def costs(unit: Unit, solid: bool, refine: float) -> list[str]:
    """Cells of a row of the table: unknowns, seconds, factorisations of the load step, gigabytes."""
    settings = MeshSettings(refine=refine)
    job = UnitStudy(unit=unit, mesh=settings, stages=("design", "simulate"), mesh_check=False)
    meshed, mesh = seconds(lambda: mesh_printed(unit, settings, solid=solid))
    model = job.mechanics.model(mesh, threads=1)
    equilibrium = Equilibrium(model, job.mechanics.materials(mesh), job.mechanics.newton)
    assembled, values = seconds(lambda: equilibrium.rest_tangent)
    once, _ = seconds(lambda: model.factor.factor(values))
    factorised, _ = seconds(lambda: model.factor.factor(values))
    right = model.residual(mesh.nodes * 0.0, STEP_KPA * 1e-3, equilibrium.parameters).ravel()[model.free]
    solved, _ = seconds(lambda: model.factor.solve(right))
    rest = equilibrium.at_zero_pressure()
    stepped, state = seconds(lambda: equilibrium.reach(STEP_KPA * 1e-3, [rest]))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    times = [meshed, once - factorised, assembled, factorised, solved, stepped]
    shown = [f"{t:.2f}" for t in times]
    return [str(len(model.free)), *shown, str(state.factorisations), f"{memory:.1f}"]


if __name__ == "__main__":
    main()
