"""Struts of other lattices as beams against the same meshes solid.

    python -m benchmarks.body.kinds [--kinds cross octet ...] [--chambers 3] [--pressure 10]

Units of `mu-1.0x` with that lattice, without a waveguide, refine 0.5, without contact: the bending angle.
Nothing is fitted to them: rigid zones come from one solid cell, three elements to a diameter.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import attrs

from benchmarks.table import circumstances, options_of, print_head
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.lattice_kinds import LatticeKind, sin_squared
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from tests.design.kinds import CORNERS, FACES, cross, custom, octet

NODES = [(0.5, 0.5, 0.5), *CORNERS, *FACES]
KINDS = (
    cross(),
    LatticeKind("diagonals and cross", NODES, [(0, k) for k in range(1, 15)], sin_squared),
    attrs.evolve(octet(), radius=sin_squared),
)


def angle(kind: LatticeKind, chambers: int, solid: bool, kPa: float, folder: Path) -> tuple[float, int]:
    """Bending angle in degrees at a pressure, and the number of unknowns."""
    unit = load_preset("mu-1.0x").evolve(**custom(kind), count=chambers, seats=False)
    mesh = mesh_printed(unit, MeshSettings(refine=0.5), cache=folder, solid=solid)
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
                    angle(kind, options.chambers, solid, options.pressure, Path(name))
                    for solid in (False, True)
                ]
                (by_beams, few), (by_solids, many) = row
                print(f"| {kind.name} | {by_beams:.3f} | {by_solids:.3f} | {few} | {many} |", flush=True)


if __name__ == "__main__":
    main()
