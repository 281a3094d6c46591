"""Functions of modules that load the solver, and words that these and their nodes share."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

GOALS = ("largest", "smallest")


def of_orders(name: str, module: str = "orders") -> Callable[..., Any]:
    """A function of `orders` or a sibling module, imported on the first call."""
    return lambda *given: getattr(import_module(f".{module}", __package__), name)(*given)
