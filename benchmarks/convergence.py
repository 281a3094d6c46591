"""How the bending angle of a homogenised unit depends on the mesh.

python -m benchmarks.convergence [--preset mu-1.0x] [--refine 0.7 1 1.4]
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings

PRESSURES = np.array([0.0, -10.0, -20.0, 0.0, 10.0, 20.0, 30.0, 40.0])


def main():
    options = options_of(__doc__)
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--refine", type=float, nargs="+", default=[0.7, 1.0, 1.4])
    given = options.parse_args()
    unit = load_preset(given.preset)
    print_head("refine", "nodes", "unknowns", "-20 kPa", "20 kPa", "40 kPa", "s")
    for refine in given.refine:
        mesh = mesh_unit(unit, MeshSettings(refine=refine))
        start = time.perf_counter()
        model = Model(mesh)
        path = simulate(Equilibrium(model, materials_of(unit, mesh)), np.arange(8.0), PRESSURES)
        found = {round(s.pressure_MPa * 1e3): bending_angle_deg(mesh, s.u) for s in path.solved}
        angles = [f"{found[p]:.3f}" for p in (-20, 20, 40)]
        seconds = time.perf_counter() - start
        print_row(f"{refine:g}", len(mesh.nodes), len(model.free), *angles, f"{seconds:.0f}")


if __name__ == "__main__":
    main()
