"""The diagnosis of the paper's bending ranges with the printed body, walls and struts that touch, as base.

    python -m benchmarks.body.diagnose_bending FOLDER [--unknown FILE] [--refine 0.5] [--finer 0.7]
        [--pressures 7] [--effects NAME ...] [--workers 1]

As `diagnose assets/examples/paper-bending`, on a coarser mesh, at fewer pressures and for chosen effects,
which that command does not offer. Simulations are kept in FOLDER and found again there. With unknown
parameters of the unit's shape it prints a row for each shape simulated, and for the best of each number of
cells: degrees from rest, bounds reached, and the misfit (chi squared of the paper's six ends, 2.5 degrees
each; the camera's zero and the modulus are fitted).
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import load_preset
from mu_addon.design.settings import PRESET
from mu_addon.diagnose.unknown import unknown_of
from mu_addon.evidence.unit_settings import KNOWN, UnitSettings
from mu_addon.measured import read_folder
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.studies.diagnose import Diagnose
from mu_addon.studies.starting import start

DATA = Path(__file__).parents[2] / "assets" / "examples" / "paper-bending"


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--unknown", type=Path)
    parser.add_argument("--refine", type=float, default=0.5)
    parser.add_argument("--pressures", type=int, default=7)
    parser.add_argument("--effects", nargs="*", choices=KNOWN, default=KNOWN)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    settings = UnitSettings(
        mesh=MeshSettings(refine=options.refine),
        pressures=options.pressures,
        # The ends are printed, not read off a gauge: no pressure beyond them.
        margin=0.0,
        effects=tuple(options.effects),
        discrepancy=0.0,
        self_contact=True,
        workers=options.workers,
    )
    unknown = unknown_of(options.unknown, load_preset(PRESET)) if options.unknown else None
    study = Diagnose(data=read_folder(DATA), settings=settings, unknown=unknown)
    context = RunContext(Progress())
    start(study.complete(), options.folder, context)
    if unknown is not None:
        print_shapes(context.summary.pop("unknown"))
    print(json.dumps(context.summary, indent=1, default=str))


def print_shapes(found: dict) -> None:
    """Rows of the shapes, the best first."""
    names = list(found["fitted"][0]["values"])
    print_head("shape", *names, "modulus factor", "at a bound", "-20 kPa", "50 kPa", "misfit")
    for of in ("fitted", "simulated"):
        for s in found[of]:
            low, high = (f"{angle - s['zero']:.1f}" for angle in list(s["predicted"].values())[:2])
            values = (f"{v:.3g}" for v in s["values"].values())
            found_at = f"{s['modulus']:.2f}", " ".join(s["ends"]), low, high, f"{s['misfit']:.0f}"
            print_row(of, *values, *found_at)


if __name__ == "__main__":
    main()
