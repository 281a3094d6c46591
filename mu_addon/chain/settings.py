"""Settings of a chain, used by its file, the command line and the node."""

from __future__ import annotations

from ..design.quantity import described
from ..meshing.settings import REFINE as REFINEMENT

REFINE = REFINEMENT._replace(default=0.5)
GRAVITY = described("gravity", True, "apply the units' weight")
ORIENTATION = described(
    "orientation_deg",
    0.0,
    "orientation of the base about x; 0: hanging",
    unit="deg",
    low=-360.0,
    high=360.0,
)
TIP_MASS = described("tip_mass_g", 0.0, "mass at the middle of the tip", unit="g", low=0.0, high=1e5)
TIMES = described("times", 13, "number of time samples of the protocol", low=2, high=10_000)
PRESSURE_STEP = described(
    "pressure_step_kPa",
    10.0,
    "largest step of the pressures between which a joint is interpolated",
    unit="kPa",
    low=0.5,
    high=50.0,
)
LOADED = described("loaded", True, "learn from loaded states; without them a quick look")
