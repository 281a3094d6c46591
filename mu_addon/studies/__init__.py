"""Every job, declared once: a file each, and a line in `STUDIES`."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from ..run.study import Study

STUDIES = {
    "calibrate": "Calibrate",
    "chain": "Chain",
    "check": "Check",
    "design-experiments": "DesignExperiments",
    "diagnose": "Diagnose",
    "export": "Export",
    "fit-material": "FitMaterial",
    "grip": "Grip",
    "homogenize": "Homogenize",
    "measure": "Measure",
    "optimize": "Optimize",
    "specimens": "Specimens",
    "sweep": "Sweep",
}
"""Class by name: of its command, its node and its module."""


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    found: type[Study] = getattr(import_module(f".{name.replace('-', '_')}", __name__), STUDIES[name])
    return found
