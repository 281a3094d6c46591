"""Settings of a parameter study, used by its file, the command line and the node."""

from __future__ import annotations

from ...design.quantity import described
from ...design.settings import USUAL_RESIN
from ...simulate_and_place.settings import STAGES
from ...simulate_and_place.settings import WORKERS as PROCESSES

METHODS = GRID, LATIN_HYPERCUBE, SOBOL = ("grid", "latin_hypercube", "sobol")
MOST_POINTS = 100_000
LAST_STAGE = described("stages", "simulate", "last stage that every study is run to", choices=STAGES)
METHOD = described("method", SOBOL, "how points are chosen", choices=METHODS)
POINTS = described("points", 16, "number of points; a grid has that of its steps", low=2, high=MOST_POINTS)
SEED = described("seed", 0, "seed of a method that draws", low=0, high=2**31)
LIMITS = "limits of a study"
MEMORY = described(
    "memory_MB", 4000, "largest memory of a study", unit="MB", low=300, high=10_000_000, group=LIMITS
)
MINUTES = described("minutes", 60.0, "longest time of a study", unit="min", low=0.01, high=1e5, group=LIMITS)
RESIN = described("resin", USUAL_RESIN, "material whose density gives the mass")
WORKERS = PROCESSES._replace(
    text="number of studies run in parallel on this machine; results do not depend on it"
)
ADD = described("add", 0, "number of points to add to the study", low=0, high=MOST_POINTS)
