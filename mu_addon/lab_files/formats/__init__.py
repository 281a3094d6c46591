"""Formats of laboratory files, one module each: `FORMATS` has every module's `read`.

It makes sheets of a file's content, None where the content is of another format. Those that read any text say
so by `TEXT`, and are asked after those that know their content by its bytes; the larger it is, the later.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules

from ..sheet import Content, Sheet

_MODULES = [import_module(f".{m.name}", __name__) for m in iter_modules(__path__)]
FORMATS: tuple[Callable[[Content], tuple[Sheet, ...] | None], ...] = tuple(
    module.read for module in sorted(_MODULES, key=lambda module: getattr(module, "TEXT", 0))
)
