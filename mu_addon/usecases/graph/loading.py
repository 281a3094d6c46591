"""Functions of `orders`, which loads the solver: imported when one is called, not to list nodes."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any


def of_orders(name: str) -> Callable[..., Any]:
    """A function of `orders`, which is loaded when it is called."""
    return lambda *given: getattr(import_module(".orders", __package__), name)(*given)
