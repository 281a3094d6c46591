"""Every job, declared once, a file each: `STUDIES` has the name of each, of its command, node and module."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from keyword import iskeyword
from pkgutil import iter_modules

from ..run.study import Study

_OF_ALL = (
    "inputs",
    "parameter_study",
    "unit_comparison",
    "unit_runs",
    "unit_inputs",
    "unit_motion",
    "unit_ranking",
    "starting",
)
_OF_A_UNIT = {"design": "unit_ranking", "simulate": "unit_ranking", "place": "unit_ranking"}
"""Module of a study of several commands, by each."""
_FOUND = (m.name.rstrip("_").replace("_", "-") for m in iter_modules(__path__) if m.name not in _OF_ALL)
STUDIES = tuple(sorted((*_OF_A_UNIT, *_FOUND)))


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    own = f"{name.replace('-', '_')}{'_' * iskeyword(name)}"
    module = import_module(f".{_OF_A_UNIT.get(name, own)}", __name__)
    kinds = (one for one in vars(module).values() if isinstance(one, type) and issubclass(one, Study))
    found: type[Study] = next(one for one in kinds if name in (getattr(one, "name", ""), *one.commands))
    return found
