"""What homogenising costs, by how many cells lie across the section: angle, stiffness, J_hat and ranking.

    python -m benchmarks.resolved.cells_across [--plus 2 3 4 6] [--wide] [--chambers 4] [--models ...]

Units with more cells on the +y side (4 to 8 across in y; with --wide as many in x as make the section nearest
to square), resolved and homogenised with the preset's one modulus for the lattice. Stiffness is that of the
tip against a force along y, without pressure. J_hat of each window of anchors over 0, -5 and 10 kPa; of the
homogenised unit by the rule that converges with the mesh.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import attrs
import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.fem.bending_angle import TipSection
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import FIDELITIES, MeshSettings
from mu_addon.usecases.simulate_and_place.job import Job

from .running import angles_deg, print_heading, print_row, run_study

PRESSURES_KPA = (0.0, -5.0, 10.0)
# Small beside what bends the unit: its stiffness at rest.
FORCE_N = 1e-3


def lateral_stiffness(study) -> float:
    """Force over deflection in N/mm of the whole tip along y, without pressure."""
    model = study.job.model(study.mesh)
    tip = TipSection.of(study.mesh)
    share = tip.area / tip.area.sum()
    load = np.zeros_like(study.mesh.nodes)
    # Half of the body carries half of the force.
    load[tip.nodes, 1] = 0.5 * FORCE_N * share
    model.load = load
    state = Equilibrium(model, study.job.materials(study.mesh), study.job.newton).at_zero_pressure()
    return FORCE_N / float(share @ state.u[tip.nodes, 1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plus", type=int, nargs="*", default=[2, 3, 4, 6])
    parser.add_argument("--wide", action="store_true")
    parser.add_argument("--chambers", type=int, default=4)
    parser.add_argument("--refine", type=float, default=1.0)
    parser.add_argument("--models", nargs="*", choices=FIDELITIES, default=FIDELITIES)
    options = parser.parse_args()
    preset = load_preset("mu-1.0x")
    chambers = attrs.evolve(preset.chambers, count=options.chambers)
    protocol = Protocol(np.arange(float(len(PRESSURES_KPA))), np.array(PRESSURES_KPA))
    angles = [f"{p:g} kPa, deg" for p in PRESSURES_KPA if p]
    print_heading(["cells x, y", "model", "unknowns", *angles, "tip N/mm", "J_hat mm", "best first", "s"])
    for plus in options.plus:
        across = 2 + plus
        wide = 2 * ((across - 1) // 2) + 1 if options.wide else preset.lattice.cells_x
        lattice = attrs.evolve(preset.lattice, cells_x=wide, cells_y_plus=plus)
        waveguide = attrs.evolve(preset.waveguide, row=plus)
        unit = attrs.evolve(preset, chambers=chambers, lattice=lattice, waveguide=waveguide)
        for name in options.models:
            began = time.perf_counter()
            mesh = MeshSettings(fidelity=name, refine=options.refine)
            job = Job(unit, protocol, mesh, times=len(PRESSURES_KPA), mesh_check=False, workers=1)
            with tempfile.TemporaryDirectory() as folder:
                try:
                    study, summary = run_study(job, Path(folder))
                except MuError as why:
                    print_row([f"{wide}, {across}", name, why])
                    continue
                angle = angles_deg(summary)
                J = summary["J_hat_mm"]
                ranked = sorted(J, key=J.get)
                row = [f"{wide}, {across}", name, study.solver["unknowns"]]
                row += [f"{angle[p]:.2f}" for p in PRESSURES_KPA if p]
                row += [f"{lateral_stiffness(study):.4g}", ", ".join(f"{J[n]:.4f}" for n in sorted(J))]
                row += [" ".join(ranked), f"{time.perf_counter() - began:.0f}"]
            print_row(row)


if __name__ == "__main__":
    main()
