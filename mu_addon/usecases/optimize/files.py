"""Files of an optimisation's folder. Nothing heavy is imported: Blender's window writes its inputs."""

from __future__ import annotations

from ...optimization.settings import BODY, HEADER, RESIN, UNIT
from ...run.folder import FolderLayout

DESIGN, MODEL = "design.toml", "model.toml"
TABLE, REPORT, FRONT = "designs.csv", "report.html", "front.png"
LAYOUT = FolderLayout(
    DESIGN,
    HEADER,
    results=(TABLE, REPORT, FRONT, "proposed-*.toml", "proposed-*.png"),
    optional=(UNIT, RESIN, "resin-*.toml", BODY, MODEL),
)
