"""Two processes run the tests side by side, a file each at a time; `-n 0` runs them in one, to debug."""

from __future__ import annotations

import gc
import os
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from . import costs, nightly

pytest_plugins = ["tests.clogged_chamber", "tests.finished_ranking", "tests.light_law"]

# Else each process that a test starts would compile the program anew, half a second, and each of pytest's
# rewrite all assertions: 20 s instead of 5 to collect.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Read when numpy is loaded, and by every process that a test starts: one core each, also where a test runs
# alone, since threads that wait for each other on small systems only spin.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def kernels():
    """Folder of Warp's compiled kernels: the user's, for all clones, or this clone's where that is read-only.

    To compile all that tests use takes two minutes of processor time. Warp builds beside and renames, and
    names a kernel by its source, so that processes may share it. Blender's have a HOME of their own.
    """
    shared = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mu_addon-tests" / "warp"
    with suppress(OSError):
        shared.mkdir(parents=True, exist_ok=True)
        if os.access(shared, os.W_OK):
            return shared
    return Path(__file__).resolve().parents[1] / ".pytest_cache" / "warp"


os.environ.setdefault("WARP_CACHE_PATH", str(kernels()))

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


@pytest.hookimpl(trylast=True)
def pytest_collection_finish():
    """What was collected stays to the end, and garbage is looked for less often: it took 4 % of all time."""
    gc.freeze()
    gc.set_threshold(10_000, 10, 50)
