"""Lazy public face of a package: a name is imported when it is first asked for (PEP 562)."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any


def public_face(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package that exports names of its modules.

    package: its `__name__`. The exported names are those that its source imports for type checkers, under `if
    TYPE_CHECKING:`, so that they are stated once. A name must differ from every module's, which the import
    system would put in its place.
    """
    home = _imported_for_type_checkers(package)

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f".{home[name]}", package), name)

    return get, lambda: sorted(home), sorted(home)


def _imported_for_type_checkers(package: str) -> dict[str, str | None]:
    """Module by exported name. The loader gives the source, from a folder or a zip."""
    source = sys.modules[package].__spec__.loader.get_source(package)  # type: ignore[union-attr]
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            imports = [one for one in node.body if isinstance(one, ast.ImportFrom)]
            found.update({alias.name: one.module for one in imports for alias in one.names})
    return found
