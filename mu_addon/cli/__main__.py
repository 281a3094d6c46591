"""Entry point of a child run, which ends with its parent: `python -m mu_addon.cli resume FOLDER --json`."""

from __future__ import annotations

import os
import sys

from ..run.processes import limit_memory
from .main import main
from .watched import run_watched

if __name__ == "__main__":
    limit_memory(int(os.environ.get("MU_MEMORY_MB", "0")))
    line = sys.argv[1:]
    sys.exit(run_watched(line, lambda: main(line), ends_with_input=True))
