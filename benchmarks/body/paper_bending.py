"""The paper's bending ranges by the printed body, for shapes that the paper does not print.

    python -m benchmarks.body.paper_bending FOLDER [--shapes "neck 20 mm" ...] [--presets mu-1.0x]
        [--refine 0.5] [--pressures -10 20 50]

Each shape changes the preset in what the paper leaves open, within the design's rules; lengths at scale 1.
Walls and struts may touch (`self_contact`). Suction and pressure are runs of their own, each in a folder
below FOLDER: a run that was stopped goes on there. Angles are those of the tip's plane in degrees, seconds of
processor time.

The paper's ranges over -20 to 50 kPa: -50 to 45, -65 to 50 and -65 to 55 degrees at 0.75x, 1.0x and 1.5x.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.unit_ranking import UnitStudy

from .running import angles_deg, outward, run_study

SHAPES: dict[str, dict[str, Any]] = {
    "as preset": {},
    "wall 0.6 mm": {"wall_mm": 0.6},
    "wall 0.5 mm": {"wall_mm": 0.5},
    "neck 10 mm": {"neck_diameter_mm": 10.0},
    "neck 16 mm": {"neck_diameter_mm": 16.0},
    "bladder's share 0.4": {"bladder_share": 0.4},
    "bladder's share 0.8": {"bladder_share": 0.8},
    "5 cells across x": {"cells_x": 5},
    "3 cells on +y": {"cells_y_plus": 3},
    "4 cells on +y": {"cells_y_plus": 4},
    "wall 0.5 mm, 3 cells on +y": {"wall_mm": 0.5, "cells_y_plus": 3},
    "wall 0.5 mm, 4 cells on +y": {"wall_mm": 0.5, "cells_y_plus": 4},
    "wall 0.5 mm, 3 cells on +y, neck 10 mm": {
        "wall_mm": 0.5,
        "cells_y_plus": 3,
        "neck_diameter_mm": 10.0,
    },
    "tip cap 2.5 mm": {"tip_cap_mm": 2.5},
    "mid-span 1.6 mm": {"midspan_diameter_mm": 1.6},
    "overcure 0.12 mm": {"offset_xy_mm": 0.12, "offset_z_mm": 0.12},
    "resin 1.2 MPa": {"membrane_modulus_kPa": 1200.0},
}


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--presets", nargs="*", default=["mu-1.0x"])
    parser.add_argument("--shapes", nargs="*", choices=SHAPES, default=list(SHAPES))
    parser.add_argument("--pressures", type=float, nargs="*", default=[-10.0, 20.0, 50.0])
    parser.add_argument("--refine", type=float, default=0.5)
    options = parser.parse_args()
    sides = [[p for p in options.pressures if p * sign > 0] for sign in (1, -1)]
    print_head("preset", "shape", "kPa", "deg", "s")
    for name in options.presets:
        for shape in options.shapes:
            for side in filter(None, sides):
                row = [name, shape]
                protocol = outward(side)
                folder = f"{name}-{shape}-{options.refine:g}-{side[0]:g}".replace(" ", "-")
                began = time.process_time()
                try:
                    job = UnitStudy(
                        unit=load_preset(name).evolve(**SHAPES[shape]),
                        protocol=protocol,
                        mesh=MeshSettings(refine=options.refine),
                        times=len(protocol.pressure_kPa),
                        stages=("design", "simulate"),
                        self_contact=True,
                        mesh_check=False,
                    )
                    angle = angles_deg(run_study(job, options.folder / folder))
                except MuError as why:
                    print_row(*row, why.what, "", f"{time.process_time() - began:.0f}")
                    continue
                shown = [f"{p:g}" for p in side], [f"{angle[p]:.2f}" for p in side]
                print_row(*row, *map(", ".join, shown), f"{time.process_time() - began:.0f}")


if __name__ == "__main__":
    main()
