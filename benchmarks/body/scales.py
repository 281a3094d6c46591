"""J of printed waveguides and angles, walls and struts touching, at several scales and on several meshes.

    python -m benchmarks.body.scales FOLDER [--presets mu-0.75x mu-1.0x mu-1.5x] [--refine 0.7 1]
        [--chambers 4] [--pressure -20 -10 20 40] [--without-contact]

Each row is a whole `place` of the printed unit, every window of anchors a candidate, kept in a folder of its
own below FOLDER: a run that was stopped goes on there. Seconds are of processor time; of a run that goes on,
those since.
"""

from __future__ import annotations

import time
from pathlib import Path

import attrs

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import load_preset
from mu_addon.errors import MuError
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.unit_ranking import UnitStudy

from .running import angles_deg, outward, run_study


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--presets", nargs="*", default=["mu-0.75x", "mu-1.0x", "mu-1.5x"])
    parser.add_argument("--refine", type=float, nargs="*", default=[0.7])
    parser.add_argument("--chambers", type=int, default=4)
    parser.add_argument("--pressure", type=float, nargs="*", default=[-20.0, -10.0, 20.0, 40.0])
    parser.add_argument("--without-contact", action="store_true")
    options = parser.parse_args()
    protocol = outward(options.pressure)
    pressures = [float(p) for p in protocol.pressure_kPa]
    angles = [f"{p:g} kPa, deg" for p in pressures if p]
    print_head("preset", "refine", "unknowns", *angles, "J_hat mm", "s")
    for name in options.presets:
        preset = load_preset(name)
        unit = attrs.evolve(preset, chambers=attrs.evolve(preset.chambers, count=options.chambers))
        for refine in options.refine:
            began = time.process_time()
            mesh = MeshSettings(refine=refine)
            touch = not options.without_contact
            job = UnitStudy(
                unit=unit,
                protocol=protocol,
                mesh=mesh,
                times=len(pressures),
                mesh_check=False,
                workers=1,
                self_contact=touch,
            )
            folder = options.folder / f"{name}-{options.chambers}-{refine:g}{'' if touch else '-passing'}"
            try:
                summary = run_study(job, folder)
            except MuError as why:
                print_row(name, f"{refine:g}", why)
                continue
            angle = angles_deg(summary)
            J = summary["J_hat_mm"]
            row = [name, f"{refine:g}", summary["solver"]["unknowns"]]
            row += [f"{angle[p]:.3f}" for p in pressures if p]
            row += [", ".join(f"{n} {J[n]:.4f}" for n in sorted(J, key=J.get))]
            row += [f"{time.process_time() - began:.0f}"]
            print_row(*row)


if __name__ == "__main__":
    main()
