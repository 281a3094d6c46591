"""A run as another's child, which ends with its parent: `python -m mu_addon.cli resume FOLDER --json`."""

from __future__ import annotations

import os
import sys

from ..run.processes import end_with_input, limit_memory
from .main import main

if __name__ == "__main__":
    end_with_input()
    limit_memory(int(os.environ.get("MU_MEMORY_MB", "0")))
    sys.exit(main(sys.argv[1:]))
