"""Settings of a homogenisation, used by the job, the command line and the node."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...design.quantity import described
from ...meshing.settings import REFINE as REFINEMENT

if TYPE_CHECKING:
    from ...homogenize.compression import Friction

FRICTIONS: tuple[Friction, ...] = ("slide", "stick")
BOTH, NONE = "both", "none"
RESIN = described(
    "resin",
    "",
    "material of the struts: one of the library or a TOML file; empty: that of the unit's membrane",
)
CELLS = described("cells", 3, "number of cells along each side of the specimen", low=1, high=12)
FRICTION = described(
    "friction",
    BOTH,
    "contact of the specimen with the plates: frictionless (slide), bonded (stick) or both",
    choices=(BOTH, *FRICTIONS),
)
# The node's, which leaves the specimen out by the same setting.
SPECIMEN = FRICTION._replace(name="specimen", choices=(*FRICTION.choices, NONE))
STRAIN = described("strain", 0.4, "largest nominal compressive strain", low=0.01, high=0.8)
REFINE = REFINEMENT._replace(
    text="mesh refinement: the cell's element size is divided by it", low=0.3, high=4.0
)
