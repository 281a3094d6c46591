"""Struts of other lattices as beams against the same meshes solid.

    python -m benchmarks.resolved.kinds [--kinds cross octet ...] [--chambers 3] [--pressure 10]

Units of `mu-1.0x` with that lattice, without a waveguide, refine 0.5, without contact: the bending angle.
Nothing is fitted to them: rigid zones come from one solid cell, three elements to a diameter.
"""

from __future__ import annotations

import tempfile
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.table import circumstances, options_of, print_head
from mu_addon.design.lattice_kinds import LatticeKind, constant, register, sin_squared
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import RESOLVED, SOLID, MeshSettings
from mu_addon.resolved.printed_mesh import mesh_printed

CORNERS = list(product((0.0, 1.0), repeat=3))
FACES = [tuple(0.5 + 0.5 * s * (axis == k) for k in range(3)) for axis in range(3) for s in (-1, 1)]
CENTRE = [(0.5, 0.5, 0.5)]
_OCTET = [*CORNERS, *FACES]
_NEIGHBOURS = [
    (a, b)
    for a in range(len(_OCTET))
    for b in range(a)
    if abs(np.linalg.norm(np.subtract(_OCTET[a], _OCTET[b])) - np.sqrt(0.5)) < 1e-9
]
KINDS = (
    LatticeKind("cross", CENTRE + FACES, [(0, k) for k in range(1, 7)], constant),
    LatticeKind("diagonals and cross", CENTRE + CORNERS + FACES, [(0, k) for k in range(1, 15)], sin_squared),
    LatticeKind("octet", _OCTET, _NEIGHBOURS, sin_squared),
)


def angle(kind: LatticeKind, chambers: int, fidelity: str, kPa: float, folder: Path) -> tuple[float, int]:
    """Bending angle in degrees at a pressure, and the number of unknowns."""
    unit = load_preset("mu-1.0x").evolve(kind=register(kind).name, count=chambers, seats=False)
    mesh = mesh_printed(unit, MeshSettings(fidelity=fidelity, refine=0.5), cache=folder)
    solver = Equilibrium(Model(mesh), materials_of(unit, mesh))
    state = solver.reach(kPa / 1000.0, [solver.at_zero_pressure()])
    return bending_angle_deg(mesh, state.u), len(solver.model.free)


def main() -> None:
    """Print a row a kind."""
    parser = options_of(__doc__)
    parser.add_argument("--kinds", nargs="*", default=[k.name for k in KINDS])
    parser.add_argument("--chambers", type=int, default=3)
    parser.add_argument("--pressure", type=float, default=10.0, help="kPa")
    options = parser.parse_args()
    print(circumstances() + "\n")
    print_head("lattice", "beams, deg", "solid, deg", "unknowns", "of solids")
    with tempfile.TemporaryDirectory() as name:
        for kind in KINDS:
            if kind.name in options.kinds:
                row = [
                    angle(kind, options.chambers, fidelity, options.pressure, Path(name))
                    for fidelity in (RESOLVED, SOLID)
                ]
                (by_beams, few), (by_solids, many) = row
                print(f"| {kind.name} | {by_beams:.3f} | {by_solids:.3f} | {few} | {many} |", flush=True)


if __name__ == "__main__":
    main()
