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
    "design": "UnitStudy",
    "design-experiments": "DesignExperiments",
    "diagnose": "Diagnose",
    "export": "Export",
    "fit-material": "FitMaterial",
    "grip": "Grip",
    "homogenize": "Homogenize",
    "import": "Import",
    "measure": "Measure",
    "optimize": "Optimize",
    "place": "UnitStudy",
    "simulate": "UnitStudy",
    "specimens": "Specimens",
    "sweep": "Sweep",
    "track": "Track",
}
"""Class by name of its command; its module has the same name, unless it has several commands."""
_MODULES = dict.fromkeys(("design", "simulate", "place"), "unit_ranking")


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    module = _MODULES.get(name, f"{name.replace('-', '_')}{'_' * iskeyword(name)}")
    found: type[Study] = getattr(import_module(f".{module}", __name__), STUDIES[name])
    return found
