"""Settings shared by many jobs: facets of a solid, friction, printer, the default resin."""

from __future__ import annotations

from .quantity import described

USUAL_RESIN = "elastic-50a-v1"
QUALITY = described(
    "quality", "interactive", "facet resolution of the printable surface", choices=("interactive", "export")
)
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
