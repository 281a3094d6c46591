"""Every job, declared once, a file each: `STUDIES` has the name of each, of its command, node and module."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from keyword import iskeyword
from pkgutil import iter_modules

from ..run.study import Study

_ELSEWHERE = dict.fromkeys(("design", "simulate", "place"), ".unit_ranking") | {"graph": "..nodes.tree_study"}
"""Module of a study that is in no file of its name here."""
_SHARED = (
    "inputs",
    "parameter_study",
    "starting",
    "unit_comparison",
    "unit_inputs",
    "unit_motion",
    "unit_ranking",
    "unit_runs",
)
"""Modules here that are no study of their name."""
_OWN = (m.name.rstrip("_").replace("_", "-") for m in iter_modules(__path__) if m.name not in _SHARED)
STUDIES = tuple(sorted((*_ELSEWHERE, *_OWN)))


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    own = f".{name.replace('-', '_')}{'_' * iskeyword(name)}"
    module = import_module(_ELSEWHERE.get(name, own), __name__)
    kinds = (one for one in vars(module).values() if isinstance(one, type) and issubclass(one, Study))
    found: type[Study] = next(one for one in kinds if name in (getattr(one, "name", ""), *one.commands))
    return found
