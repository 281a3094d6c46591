"""Settings of candidate paths: their lengths and bends.

No array library is loaded: the command line's --help reads this module.
"""

from __future__ import annotations

import math

from ..design.quantity import described

OF_LATTICE = "paths through the whole lattice"
"""Group of settings of --paths graph."""
# A window of h anchors is h - 1 cells long, so the source paper's h >= 3 is 2 cells.
SHORTEST = described(
    "shortest_cells", 2.0, "length of the shortest path, in cells", low=0.01, high=1000.0, group=OF_LATTICE
)
LONGEST = described(
    "longest_cells",
    math.inf,
    "length of the longest path, in cells; inf: no limit",
    low=0.01,
    high=math.inf,
    group=OF_LATTICE,
)
# Assumed, since the paper's paths are straight: 75 degrees allows the zigzag from one half-diagonal to a
# neighbouring one (70.5) and refuses a step across from one along the axis (90).
BEND = described(
    "bend_deg", 75.0, "largest bend of a path at a node, in degrees", low=0.01, high=180.0, group=OF_LATTICE
)
