"""Every job, declared once, a file each: `STUDIES` has the name of each, of its command, node and module."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib import import_module
from keyword import iskeyword
from pkgutil import iter_modules
from typing import Any

from ..run.study import Study

_ELSEWHERE = dict.fromkeys(("design", "simulate", "place"), ".unit_ranking") | {"graph": "..nodes.graph"}
"""Module of a study that is in no file of its name here."""


def _names() -> Iterator[str]:
    """Names of the studies in files of their own, which declare the file's name; no file is run for that."""
    for module in iter_modules(__path__):
        name, finder = module.name.rstrip("_").replace("_", "-"), module.module_finder
        loader: Any = finder.find_spec(module.name).loader  # type: ignore[call-arg, union-attr]
        if f'\n    name = "{name}"\n' in loader.get_source(module.name):
            yield name


STUDIES = tuple(sorted((*_ELSEWHERE, *_names())))


@cache
def study(name: str) -> type[Study]:
    """The study of a command."""
    own = f".{name.replace('-', '_')}{'_' * iskeyword(name)}"
    module = import_module(_ELSEWHERE.get(name, own), __name__)
    kinds = (one for one in vars(module).values() if isinstance(one, type) and issubclass(one, Study))
    found: type[Study] = next(one for one in kinds if name in (getattr(one, "name", ""), *one.commands))
    return found
