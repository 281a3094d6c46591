"""Settings that many jobs share, stated once: facets of a solid, and the resin where none is named."""

from __future__ import annotations

from .quantity import described

USUAL_RESIN = "elastic-50a-v1"
QUALITY = described(
    "quality", "interactive", "facet resolution of the printable surface", choices=("interactive", "export")
)
