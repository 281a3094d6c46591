"""Every job, declared once: a file each, and a line in `STUDIES`."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from keyword import iskeyword

from ..run.study import Study

STUDIES = {
    "calibrate": "Calibrate",
    "chain": "Chain",
    "check": "Check",
    "design-experiments": "DesignExperiments",
    "export": "Export",
    "fit-material": "FitMaterial",
    "grip": "Grip",
    "homogenize": "Homogenize",
    "import": "Import",
    "measure": "Measure",
    "optimize": "Optimize",
    "specimens": "Specimens",
    "sweep": "Sweep",
    "track": "Track",
}
"""Class by name: of its command, its node and its module."""


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    module = import_module(f".{name.replace('-', '_')}{'_' * iskeyword(name)}", __name__)
    found: type[Study] = getattr(module, STUDIES[name])
    return found
