"""Settings shared by many jobs: facets, friction, printer, orientation, the usual resin and unit."""

from __future__ import annotations

from .quantity import described

USUAL_RESIN = "elastic-50a-v1"
PRESET = "mu-1.0x"
"""Unit where none is given."""
SOLVER = "mesh and solver"
"""Group of advanced settings of many jobs."""
UP = (0.0, 0.0, 1.0)
"""Usual build direction in the unit's frame: inlet toward the platform."""
QUALITY = described(
    "quality", "interactive", "facet resolution of the printable surface", choices=("interactive", "export")
)
FINE = QUALITY._replace(default="export")
"""The quality of what is to be printed."""
PRINTER = described(
    "printer", "form-4-elastic-50a", "limits of the printer and its resin: a shipped name or a TOML file"
)
# Published coefficients of dry elastomers on hard plastics; the cautious end is taken.
FRICTION = described(
    "friction",
    0.5,
    "Coulomb friction coefficient between unit and body, assumed: dry elastomers on hard plastics mostly "
    "have 0.5 to 1 and above",
    low=0.0,
    high=5.0,
)
ORIENTATION = described(
    "orientation_deg",
    0.0,
    "orientation of the unit, degrees about x; 0: hanging, tip down; 90: level",
    low=-360.0,
    high=360.0,
)
