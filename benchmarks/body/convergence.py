"""How a printed unit's bending angle depends on its mesh: sizes of wall and struts, one by one or together.

    python -m benchmarks.body.convergence [--sizes MERIDIAN HOOP THROUGH RINGS LAYERS] [--refine 1 ...]
        [--chambers 3] [--pressure -10 -5 5 10 20 40] [--tie-from 0]

Each mesh is one row: the angle of the tip's cap and seconds. `--tie-from`: nodes of struts are tied from
this depth in mm below the wall's outside on.
"""

from __future__ import annotations

import time

import attrs
import numpy as np

from benchmarks.table import options_of, print_head, print_row
from mu_addon.body.lattice import clearance, struts
from mu_addon.body.printed_mesh import Sizes, tied, wall_mesh
from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model

from .tip import tip_section

PRESSURES_KPA = (-10.0, -5.0, 5.0, 10.0, 20.0, 40.0)


def printed_unit(chambers=3, preset="mu-1.0x"):
    """A preset with another number of chambers."""
    unit = load_preset(preset)
    return attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=chambers))


def resin(mesh, modulus_MPa=2.5, poisson=0.45):
    """One neo-Hookean resin throughout."""
    count = len(mesh.tets)
    return Materials.neo_hooke(np.full(count, modulus_MPa), np.full(count, poisson))


def angles(mesh, d, pressures_kPa, materials, parts=("cap",), threads=1):
    """Angles {kPa: {part: deg}} from rest outward on either side, with the seconds of each under "s"."""
    sections = {part: tip_section(mesh, d, part) for part in parts}
    solver = Equilibrium(Model(mesh, threads=threads), materials)
    found = {}
    for sign in (-1.0, 1.0):
        states = [solver.at_zero_pressure()]
        for kPa in sorted((p for p in pressures_kPa if p * sign > 0), key=abs):
            began = time.perf_counter()
            try:
                states.append(solver.reach(kPa * 1e-3, states))
            except MuError as why:
                print(f"{kPa:g} kPa: {why}", flush=True)
                break
            read = {part: section.angle_deg(states[-1].u) for part, section in sections.items()}
            found[kPa] = {**read, "s": time.perf_counter() - began}
    return found


def main() -> None:
    parser = options_of(__doc__)
    default = attrs.astuple(Sizes())
    parser.add_argument("--sizes", type=float, nargs=5, action="append", metavar="SIZE", default=None)
    parser.add_argument("--refine", type=float, nargs="*", default=[1.0])
    parser.add_argument("--chambers", type=int, default=3)
    parser.add_argument("--pressure", type=float, nargs="*", default=PRESSURES_KPA, metavar="kPa")
    parser.add_argument("--tie-from", type=float, default=0.0, metavar="mm")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    d = attrs.evolve(load_preset("mu-1.0x").printed, count=options.chambers)
    names = "meridian", "hoop", "through", "rings", "layers", "unknowns", "mesh s"
    columns = [*names, *(f"{p:g} kPa" for p in options.pressure), "loads s"]
    print_head(*columns)
    for given in options.sizes or [default]:
        for refine in options.refine:
            sizes = Sizes(*given[:2], *map(int, given[2:])).refined(refine)
            began = time.perf_counter()
            lattice = struts(d, sizes.rings, sizes.layers)
            clear = clearance(d, lattice.nodes) + options.tie_from
            mesh = tied(wall_mesh(d, sizes), lattice, clear)
            meshed = time.perf_counter() - began
            found = angles(mesh, d, options.pressure, resin(mesh), threads=options.threads)
            cells = [f"{v:.3g}" for v in attrs.astuple(sizes)]
            cells += [f"{3 * (len(mesh.nodes) - len(mesh.tied))}", f"{meshed:.1f}"]
            cells += [f"{found[p]['cap']:.3f}" if p in found else "-" for p in options.pressure]
            cells.append(f"{sum(v['s'] for v in found.values()):.0f}")
            print_row(*cells)


if __name__ == "__main__":
    main()
