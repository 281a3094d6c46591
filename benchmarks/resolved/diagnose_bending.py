"""The diagnosis of the paper's bending ranges with the printed body, walls and struts that touch, as base.

    python -m benchmarks.resolved.diagnose_bending FOLDER [--refine 0.5] [--finer 0.7] [--pressures 9]
        [--effects NAME ...] [--workers 1]

As `diagnose assets/examples/paper-bending`, on a coarser mesh, at fewer
pressures and for chosen effects, which that command does not offer. Simulations are kept in FOLDER and found
again there.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from mu_addon.evidence.unit_fem import KNOWN, UnitSettings
from mu_addon.measured import read_folder
from mu_addon.meshing.settings import RESOLVED, MeshSettings
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.usecases.diagnose.job import Job
from mu_addon.usecases.diagnose.run import USE_CASE

DATA = Path(__file__).parents[2] / "assets" / "examples" / "paper-bending"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--refine", type=float, default=0.5)
    parser.add_argument("--finer", type=float, default=0.7)
    parser.add_argument("--pressures", type=int, default=9)
    parser.add_argument("--effects", nargs="*", choices=KNOWN, default=KNOWN)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    settings = UnitSettings(
        mesh=MeshSettings(fidelity=RESOLVED, refine=options.refine),
        finer=MeshSettings(fidelity=RESOLVED, refine=options.finer),
        pressures=options.pressures,
        effects=tuple(options.effects),
        self_contact=True,
        workers=options.workers,
    )
    job = Job(read_folder(DATA), settings=settings)
    context = RunContext(Progress())
    USE_CASE.start(job, options.folder, context)
    print(json.dumps(context.summary, indent=1, default=str))


if __name__ == "__main__":
    main()
