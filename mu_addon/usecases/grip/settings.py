"""Settings of a grasp, used by the job, the command line, the node and Blender."""

from __future__ import annotations

from ...design.quantity import described
from ...meshing.settings import REFINE as REFINEMENT

REFINE, COARSE_REFINE = REFINEMENT._replace(default=0.5), 0.4
CUBES = described(
    "cubes_mm",
    "12.5 25",
    "side lengths in mm of the cubes to grasp",
)
SIDES = tuple(map(float, CUBES.default.split()))
DENSITY = described(
    "density_g_per_ml", 1.24, "density of the cubes; solid PLA is assumed", unit="g/ml", low=0.001, high=25.0
)
BEYOND = described(
    "beyond_mm",
    3.0,
    "distance of the cubes' centre beyond the tips at rest",
    unit="mm",
    low=-50.0,
    high=50.0,
)
COARSE = described("coarse", False, "quick, less accurate run: coarser mesh, longer time steps")
