"""The paper's bending ranges by the resolved and the homogenised unit, for several walls and print offsets.

    python -m benchmarks.resolved.paper_bending FOLDER [--walls 0.5 0.6 0.7 0.9] [--offsets 0 0.12 0.17]
        [--presets mu-1.0x] [--refine 0.7] [--models resolved homogenised] [--sides suction pressure]

A wall is nominal, in mm at scale 1; an offset moves every surface of the print outward by as many mm, in the
plane and along the build axis alike. The resolved unit with walls and struts that touch (`self_contact`), the
homogenised one with the lattice's modulus that the paper measured at that scale. Both sides of a range are
runs of their own, suction and pressure, each in a folder below FOLDER: a run that was stopped goes on there.
Angles are those of the tip's plane in degrees, seconds of processor time.

The paper's ranges over -20 to 50 kPa: -50 to 45, -65 to 50 and -65 to 55 degrees at 0.75x, 1.0x and 1.5x.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import attrs

from mu_addon.design.parameters import Unit, load_preset
from mu_addon.errors import MuError
from mu_addon.meshing.settings import FIDELITIES, RESOLVED, MeshSettings
from mu_addon.usecases.simulate_and_place.job import Job

from .running import angles_deg, outward, print_heading, print_row, run_study

SIDES = {"suction": (-5.0, -10.0, -15.0, -20.0), "pressure": (10.0, 20.0, 35.0, 50.0)}


def printed_unit(preset: str, wall_mm: float, offset_mm: float) -> Unit:
    """The preset with a wall in mm at scale 1, printed with an offset in mm."""
    unit = load_preset(preset)
    return attrs.evolve(
        unit,
        chambers=attrs.evolve(unit.chambers, wall_mm=wall_mm),
        print=attrs.evolve(unit.print, offset_xy_mm=offset_mm, offset_z_mm=offset_mm),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--presets", nargs="*", default=["mu-1.0x"])
    parser.add_argument("--walls", type=float, nargs="*", default=[0.5, 0.6, 0.7, 0.9])
    parser.add_argument("--offsets", type=float, nargs="*", default=[0.0, 0.12, 0.17])
    parser.add_argument("--models", nargs="*", choices=FIDELITIES, default=FIDELITIES)
    parser.add_argument("--sides", nargs="*", choices=SIDES, default=list(SIDES))
    parser.add_argument("--refine", type=float, default=0.7)
    options = parser.parse_args()
    print_heading(["preset", "wall mm", "offset mm", "model", "kPa", "deg", "s"])
    for name in options.presets:
        for offset in options.offsets:
            for wall in options.walls:
                for model in options.models:
                    for side in options.sides:
                        row = [name, f"{wall:g}", f"{offset:g}", model]
                        protocol = outward(SIDES[side])
                        resolved = model == RESOLVED
                        folder = (
                            options.folder / f"{name}-{wall:g}-{offset:g}-{model}-{options.refine:g}-{side}"
                        )
                        began = time.process_time()
                        try:
                            job = Job(
                                printed_unit(name, wall, offset),
                                protocol,
                                MeshSettings(fidelity=model, refine=options.refine),
                                times=len(protocol.pressure_kPa),
                                stages=("design", "simulate"),
                                self_contact=resolved,
                                mesh_check=False,
                            )
                            angle = angles_deg(run_study(job, folder)[1])
                        except MuError as why:
                            print_row([*row, side, why, f"{time.process_time() - began:.0f}"])
                            continue
                        shown = [f"{p:g}" for p in SIDES[side]], [f"{angle[p]:.2f}" for p in SIDES[side]]
                        print_row([*row, *map(", ".join, shown), f"{time.process_time() - began:.0f}"])


if __name__ == "__main__":
    main()
