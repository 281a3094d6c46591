"""Settings of an export, used by the job, the command line and the node."""

from __future__ import annotations

from ...design.quantity import described
from ...design.settings import QUALITY as FACETS
from ...design.settings import USUAL_RESIN

FORMATS = ("stl", "3mf", "3mf-beams", "step", "txt")
QUALITY = FACETS._replace(default="export")
RESIN = described("resin", "", f"resin: a material of the library or a TOML file; empty: {USUAL_RESIN}")
