"""Bending angles of resolved and homogenised units, of the tip's cap and of all that lies in its plane.

    python -m benchmarks.resolved.against_homogenised [--chambers 3 6] [--pressure -15 -10 -5 5 10 20 30 50]
        [--refine 1] [--models homogenised resolved]

Homogenised: the preset's one modulus for the lattice. A homogenised tip is one block, so that its plane is
mostly lattice; a printed one is a cap and ends of struts.
"""

from __future__ import annotations

import argparse
import time

import attrs

from mu_addon.design.parameters import load_preset
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.resolved.printed_mesh import mesh_of

from .convergence import angles

PRESSURES_KPA = (-15.0, -10.0, -5.0, 5.0, 10.0, 20.0, 30.0, 50.0)
MODELS = "homogenised", "resolved"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chambers", type=int, nargs="*", default=[3, 6])
    parser.add_argument("--pressure", type=float, nargs="*", default=PRESSURES_KPA, metavar="kPa")
    parser.add_argument("--refine", type=float, default=1.0)
    parser.add_argument("--models", nargs="*", choices=MODELS, default=MODELS)
    options = parser.parse_args()
    preset = load_preset("mu-1.0x")
    columns = ["chambers", "model", "tip", "unknowns", *(f"{p:g} kPa" for p in options.pressure), "s"]
    print("| " + " | ".join(columns) + " |\n" + "| --- " * len(columns) + "|", flush=True)
    for chambers in options.chambers:
        unit = attrs.evolve(preset, chambers=attrs.evolve(preset.chambers, count=chambers))
        for name in options.models:
            began = time.perf_counter()
            mesh = mesh_of(unit, MeshSettings(refine=options.refine, fidelity=name))
            parts = ("cap", "plane")
            found = angles(mesh, unit.printed, options.pressure, materials_of(unit, mesh), parts)
            seconds = time.perf_counter() - began
            for part in parts:
                cells = [f"{found[p][part]:.2f}" if p in found else "-" for p in options.pressure]
                unknowns = 3 * (len(mesh.nodes) - len(mesh.tied))
                row = [chambers, name, part, unknowns, *cells, f"{seconds:.0f}"]
                print("| " + " | ".join(map(str, row)) + " |", flush=True)


if __name__ == "__main__":
    main()
