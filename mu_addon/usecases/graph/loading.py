"""Functions from modules that load the solver, imported on the first call and not to list nodes."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any


def of_orders(name: str, module: str = "orders") -> Callable[..., Any]:
    """A function of `orders`, or of another module beside it, loaded when it is called."""
    return lambda *given: getattr(import_module(f".{module}", __package__), name)(*given)
