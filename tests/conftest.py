"""Two processes run the tests side by side, a file each at a time; `-n 0` runs them in one, to debug."""

from __future__ import annotations

import os

# Read when numpy is loaded, and by every process that a test starts: one core each, also where a test runs
# alone, since threads that wait for each other on small systems only spin.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")
