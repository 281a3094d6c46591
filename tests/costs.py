"""What tests cost, in seconds of processor time: the longest files go first, and what takes long is `slow`.

`python -m pytest --measure` writes costs.csv anew, for the files that ran: one line a test or fixture
(FILE::NAME) of more than a second, with what its child processes took. Nothing depends on the figures but
order and mark.
"""

import csv
import os
from collections import Counter
from pathlib import Path

import pytest

TABLE = Path(__file__).with_name("costs.csv")
SLOW_S = 1.0

elsewhere = 0.0
"""Seconds that a process which is still there took for tests; see `blender.session`."""


def processor_time():
    """Seconds of this process and of its children that have ended."""
    return sum(os.times()[:4]) + elsewhere


class Order:
    """Long files first, so that none is left over for one process at the end; long tests are `slow`."""

    def __init__(self, costs):
        self.slow = set(costs)
        self.by_file = Counter()
        for name, seconds in costs.items():
            self.by_file[name.partition("::")[0]] += seconds

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, items):
        for item in items:
            file = item.nodeid.partition("::")[0]
            if item.get_closest_marker("nightly") or self.slow & {
                item.nodeid,
                *(f"{file}::{fixture}" for fixture in item.fixturenames),
            }:
                item.add_marker("slow")
        items.sort(key=lambda item: -self.by_file[item.nodeid.partition("::")[0]])


class Measure:
    """Adds up the costs in each process; the first one writes the table."""

    def __init__(self, config):
        self.config, self.costs = config, Counter()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        before = processor_time()
        try:
            return (yield)
        finally:
            file = request.node.nodeid.partition("::")[0]
            self.costs[f"{file}::{fixturedef.argname}"] += processor_time() - before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        before = processor_time()
        try:
            return (yield)
        finally:
            self.costs[item.nodeid] += processor_time() - before

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node):
        self.costs.update(getattr(node, "workeroutput", {}).get("costs", {}))

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self):
        if hasattr(self.config, "workeroutput"):
            self.config.workeroutput["costs"] = dict(self.costs)

    def pytest_unconfigure(self):
        if not hasattr(self.config, "workeroutput"):
            write(self.costs)


def read():
    """Seconds by FILE::NAME."""
    with TABLE.open(newline="", encoding="utf-8") as file:
        return {row["name"]: float(row["seconds"]) for row in csv.DictReader(file)}


def write(costs):
    """The table, longest first. What it has of files that did not run stays, and of fixtures of a session."""
    ran = {name.partition("::")[0] for name in costs} - {""}
    costs = {name: s for name, s in read().items() if name.partition("::")[0] not in ran} | dict(costs)
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["seconds", "name"])
        for name, seconds in sorted(costs.items(), key=lambda cost: (-cost[1], cost[0])):
            if seconds >= SLOW_S:
                rows.writerow([f"{seconds:.1f}", name])
