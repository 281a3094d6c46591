"""Settings of a search for units, used by its file and Blender."""

from __future__ import annotations

from ..design.quantity import described
from ..design.settings import SOLVER
from ..meshing.settings import REFINE as REFINEMENT
from ..meshing.settings import SELF_CONTACT as KEPT_APART

DESIGN, UNIT, RESIN, BODY = "design.toml", "unit.toml", "resin.toml", "body.obj"
HEADER = "# The inputs of this optimisation; unit.toml beside it is the unit that it starts from."
"""Files of a design in a run's folder, and the first line of the first."""
FINER = 1.5
"""Refinement of a check's mesh over the search's, unless the file gives it."""
EVALUATIONS = described(
    "evaluations",
    40,
    "largest number of units simulated, those on the finer mesh not counted",
    low=1,
    high=100_000,
)
BATCH = described("batch", 1, "number of units simulated at a time", low=1, high=256)
SEED = described("seed", 0, "seed of the samples that the search draws", low=0, high=2**31)
WORKERS = described(
    "workers",
    1,
    "number of units simulated in parallel on this machine; the search depends on it",
    low=1,
    high=256,
)
REFINE = REFINEMENT._replace(default=0.5, group=SOLVER)
CHECK_REFINE = described(
    "check_refine",
    FINER * REFINE.default,
    "mesh refinement of the check of a proposed unit",
    low=REFINE.low,
    high=REFINE.high,
    group=SOLVER,
)
ROBUST = described(
    "robust", False, "ask for units that meet the targets within the uncertainty of mesh, print and resin"
)
SELF_CONTACT = KEPT_APART._replace(
    default=False, text="keep walls and struts from passing through each other, at several times the cost"
)
PRINT_TOLERANCE = described(
    "print_tolerance_mm", 0.05, "scatter of a printed wall from unit to unit", unit="mm", low=0.0, high=0.3
)
MODULUS_TOLERANCE = described(
    "modulus_tolerance",
    0.1,
    "scatter of the modulus from unit to unit, as a share",
    low=0.0,
    high=1.0,
)
