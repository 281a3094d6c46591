"""Settings of a study, used by the job, the command line, nodes and Blender.

No solver or array library is loaded: the command line's --help reads this module.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..design.quantity import described
from ..design.settings import ORIENTATION as HUNG
from ..design.settings import SOLVER
from ..meshing.settings import REFINE
from ..placement.settings import OF_LATTICE

STAGES = ("design", "simulate", "place")
"""Stages in order of need; a study has the first, the first two or all."""
PROTOCOL = described(
    "protocol",
    "",
    "pressure protocol, CSV with the columns time_s,pressure_kPa; empty: the shipped grasp protocol",
)
TIMES = described("times", 13, "number of time samples of the protocol", low=2, high=1001, group=SOLVER)
STATIONS = described(
    "stations", 51, "number of stations along the backbone", low=2, high=10_001, group=SOLVER
)
WORKERS = described("workers", 2, "number of worker processes; results do not depend on it", low=1, high=256)
MESH_CHECK = described(
    "mesh_check",
    True,
    "solve a second mesh, from which the mesh uncertainty of the ranking is estimated",
    group=SOLVER,
)
PATHS = described(
    "paths",
    "windows",
    "candidate paths: windows of consecutive anchors; graph adds every path through the lattice, bent ones "
    "included",
    choices=("windows", "graph"),
)
ALL_PATHS = described(
    "all_paths",
    False,
    "solve every path at every pressure; else a path is left, with a lower bound, once it certainly deviates "
    "more than the best",
    group=SOLVER,
)
UNDER_PRESSURE = described(
    "under_pressure", False, "leave out the protocol's suction: the unit is then at rest", group=SOLVER
)
QUICK = described(
    "quick",
    False,
    "quick ranking: states under pressure alone, on a mesh of at most 0.35 in refinement, without mesh check",
)
QUICK_REFINE = 0.35
CHECKS = described(
    "checks",
    100,
    "largest number of paths of the lattice solved by the full model",
    low=2,
    high=100_000,
    group=OF_LATTICE,
)
SELF_FRICTION = described(
    "self_friction",
    0.0,
    "Coulomb friction coefficient of walls and struts on each other, with self-contact; above 0 the motion "
    "is solved in time order",
    low=0,
    high=5,
    group=SOLVER,
)
ORIENTATION = HUNG._replace(text=f"{HUNG.text}; it has an effect only with gravity in the extended model")
ESTIMATED = "J_hat_estimated_mm"
"""Key of summary.json for estimates of J_hat by path, before any is solved."""


def left_out(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """What the figures of a quick ranking leave out, as text; empty for another study.

    tables: of study.toml, by stage.
    """
    motion, ranking = tables.get("simulate", {}), tables.get("place", {})
    if not motion.get(UNDER_PRESSURE.name):
        return ""
    coarse = motion["mesh"]["refine"] < REFINE.default
    unchecked = not ranking.get(MESH_CHECK.name, True)
    words = "under pressure alone", "coarse mesh" * coarse, "no mesh check" * unchecked
    return ", ".join(filter(None, words))
