"""Every job, declared once, a file each: `STUDIES` has the name of each, of its command, node and module."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from keyword import iskeyword
from pkgutil import iter_modules

from ..run.study import Study

_OF_ALL = ("inputs", "use_case")
STUDIES = tuple(m.name.rstrip("_").replace("_", "-") for m in iter_modules(__path__) if m.name not in _OF_ALL)


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    module = import_module(f".{name.replace('-', '_')}{'_' * iskeyword(name)}", __name__)
    found: type[Study] = next(kind for kind in vars(module).values() if getattr(kind, "name", "") == name)
    return found
