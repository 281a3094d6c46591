"""Struts as beams against struts as solids, in bodies that nothing was fitted to.

    python -m benchmarks.body.beams [--body NAME ...] [--refine 1] [--solid-refine 1.4]

Each body is three chambers of mu-1.0x changed in one thing, without contact. A row gives its tip's angle and
how far its tip moves, with beams or with solid struts on a finer mesh, unknowns and processor seconds.
"""

from __future__ import annotations

import time

import attrs
import numpy as np

from benchmarks.table import circumstances, options_of, print_head, print_row
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.fem.bending_angle import TipSection
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings

PRESSURES_KPA = -10.0, -5.0, 5.0, 10.0, 20.0, 40.0


def bodies():
    """Units by name."""
    unit = load_preset("mu-1.0x")
    base = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))

    def struts(factor):
        lattice = base.lattice
        return attrs.evolve(
            base,
            lattice=attrs.evolve(
                lattice,
                junction_diameter_mm=factor * lattice.junction_diameter_mm,
                midspan_diameter_mm=factor * lattice.midspan_diameter_mm,
            ),
        )

    def wall(mm):
        return attrs.evolve(base, chambers=attrs.evolve(base.chambers, wall_mm=mm))

    small = load_preset("mu-0.75x")
    return {
        "as preset": base,
        "wall 0.6 mm": wall(0.6),
        "wall 1.3 mm": wall(1.3),
        "struts x 0.7": struts(0.7),
        "struts x 1.3": struts(1.3),
        "graded, 0.8 to 1.2": attrs.evolve(base, grading=attrs.evolve(base.grading, base=0.8, tip=1.2)),
        "scale 0.75": attrs.evolve(small, chambers=attrs.evolve(small.chambers, count=3)),
        "four chambers": attrs.evolve(base, chambers=attrs.evolve(base.chambers, count=4)),
    }


def motion(unit, refine, solid):
    """Angles in degrees and tips' ways in mm by pressure in kPa, unknowns, and seconds."""
    began = time.process_time()
    mesh = mesh_printed(unit, MeshSettings(refine=refine), solid=solid)
    model = Model(mesh, threads=1)
    solver = Equilibrium(model, materials_of(unit, mesh))
    tip, found = TipSection.of(mesh), {}
    for sign in (-1.0, 1.0):
        states = [solver.at_zero_pressure()]
        for kPa in sorted((p for p in PRESSURES_KPA if p * sign > 0), key=abs):
            try:
                states.append(solver.reach(kPa * 1e-3, states))
            except MuError as why:
                print(f"{kPa:g} kPa: {why}", flush=True)
                break
            u = states[-1].u
            way = np.linalg.norm(np.average(u[tip.nodes], axis=0, weights=tip.area))
            found[kPa] = tip.angle_deg(u), float(way)
    return found, len(model.free), time.process_time() - began


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--body", nargs="*", default=list(bodies()), choices=list(bodies()))
    parser.add_argument("--refine", type=float, default=1.0)
    parser.add_argument("--solid-refine", type=float, default=1.4)
    options = parser.parse_args()
    print(f"{circumstances()}: angle in degrees, off by / tip's way off by\n")
    print_head("body", "struts", "unknowns", "s", *(f"{p:g} kPa" for p in PRESSURES_KPA))
    for name in options.body:
        unit, reference = bodies()[name], {}
        for solid, refine in ((True, options.solid_refine), (False, options.refine)):
            found, unknowns, seconds = motion(unit, refine, solid)
            reference = reference or found
            cells = []
            for kPa in PRESSURES_KPA:
                if kPa not in found:
                    cells.append("")
                    continue
                angle, way = found[kPa]
                words = f"{angle:.3f}"
                if found is not reference and kPa in reference:
                    off = [100 * (a / b - 1) for a, b in zip((angle, way), reference[kPa], strict=True)]
                    words += f" {off[0]:+.1f} / {off[1]:+.1f} %"
                cells.append(words)
            print_row(
                name,
                f"{'solid' if solid else 'beams'}, refine {refine:g}",
                unknowns,
                f"{seconds:.0f}",
                *cells,
            )


if __name__ == "__main__":
    main()
