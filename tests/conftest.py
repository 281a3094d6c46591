"""Two processes run the tests side by side, a file each at a time; `-n 0` runs them in one, to debug."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

from . import costs, nightly

pytest_plugins = ["tests.light_law"]

# Tests start hundreds of processes: each would compile the whole program anew, and each worker of pytest
# rewrite all assertions, which together takes as long as a third of the tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Read when numpy is loaded, and by every process that a test starts: one core each, also where a test runs
# alone, since threads that wait for each other on small systems only spin.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# Kernels are compiled once for all processes: Blender's have a HOME of their own, where Warp would find none.
# Warp builds beside and renames, and names a kernel by its source: processes may share the folder.
os.environ.setdefault("WARP_CACHE_PATH", str(Path(__file__).resolve().parents[1] / ".pytest_cache" / "warp"))

# The same examples each time and no limit of time: what fails is the code, on a machine of any speed.
# `--hypothesis-profile search` draws new ones.
unhurried = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("tests", derandomize=True, **unhurried)
settings.register_profile("search", **unhurried)
settings.load_profile("tests")


def pytest_addoption(parser):
    parser.addoption("--measure", action="store_true", help="write what each test costs into tests/costs.csv")


def pytest_configure(config):
    config.pluginmanager.register(costs.Order(costs.read()))
    if config.getoption("--measure"):
        config.pluginmanager.register(costs.Measure(config))
    if config.option.markexpr == "nightly" and not hasattr(config, "workerinput"):
        config.pluginmanager.register(nightly.Night())
