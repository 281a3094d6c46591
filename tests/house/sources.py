"""The package's modules, parsed once for all who look through them."""

import ast
from functools import cache
from pathlib import Path

SOURCES = sorted((Path(__file__).resolve().parents[2] / "mu_addon").rglob("*.py"))


@cache
def nodes(path):
    """Every node of a module's syntax tree."""
    return list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
