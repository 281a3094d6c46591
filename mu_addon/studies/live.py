"""Live bending of a unit, in a process that a window asks for shapes."""

from __future__ import annotations

from pathlib import Path

import attrs

from ..live_bending.requests import ASKED, BENT, CELLS, REQUEST
from ..run.context import RunContext
from ..run.study import Study


@attrs.frozen(kw_only=True, eq=False)
class Live(Study):
    """Bend a unit while it is designed. Its process has no fixed inputs: they come with each request."""

    name = "live"
    header = "# Shapes of a unit while it is designed."
    streams = True
    page = ""
    files = {
        REQUEST: "the latest request",
        BENT: "its answer",
        ASKED: "studies that are asked for",
        CELLS: "meshes",
        "shape-*": "motions that were found",
    }

    def work(self, folder: Path, context: RunContext) -> None:
        """Answer requests until the process ends."""
        from ..live_bending.run import answer

        answer(folder)
