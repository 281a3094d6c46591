"""Settings of candidate paths: rules by which a sensor stiffens what it meets, and limits of paths.

No array library is loaded: the command line's --help reads this module.
"""

from __future__ import annotations

import math

from ..design.quantity import described

RULES = ("intersect", "volume_fraction")
BOTH = "both"
PRINTED = "printed"
"""Used in place of a rule: the waveguide itself, with wells and seats, in a mesh of the printed unit."""
RULE = described(
    "rule",
    BOTH,
    "inclusion rule of a homogenised unit: how the sensor stiffens the elements it intersects",
    choices=(BOTH, *RULES),
)
# A window of h anchors is h - 1 cells long, so the source paper's h >= 3 is 2 cells.
SHORTEST = described("shortest_cells", 2.0, "length of the shortest path, in cells", low=0.01, high=1000.0)
LONGEST = described(
    "longest_cells", math.inf, "length of the longest path, in cells; inf: no limit", low=0.01, high=math.inf
)
# Assumed, since the paper's paths are straight: 75 degrees allows the zigzag from one half-diagonal to a
# neighbouring one (70.5) and refuses a step across from one along the axis (90).
BEND = described("bend_deg", 75.0, "largest bend of a path at a node, in degrees", low=0.01, high=180.0)


def rules_of(rule: str | None) -> tuple[str, ...]:
    """The inclusion rules that a value of `RULE` stands for; of None, its default."""
    return RULES if rule in (None, BOTH) else (str(rule),)
