"""A study that takes a moment, run in Blender itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def run_here(study: Any, folder: Path) -> tuple[Any, list[dict[str, Any]]]:
    """Run a study in its folder; return its `Execution`, and the messages of its warnings. Raises MuError."""
    # Imported late: Blender starts without pools of processes.
    from ...run.context import RunContext
    from ...run.execution import Execution
    from ...run.progress import Progress

    messages: list[dict[str, Any]] = []
    work = Execution(study, folder, RunContext(Progress([messages.append])))
    work.run()
    return work, [message for message in messages if message["type"] == "warning"]
