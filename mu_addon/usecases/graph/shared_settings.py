"""Settings that several kinds of nodes share, and functions of modules that load the solver."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from ...graph.definition import FILE, Setting
from ...meshing import settings as mesh
from ..simulate_and_place import settings as study

SELF_CONTACT = Setting(mesh.SELF_CONTACT)
SELF_FRICTION = Setting(study.SELF_FRICTION)
PROTOCOL = Setting(study.PROTOCOL, FILE)
QUICK_TIMES = Setting(study.TIMES._replace(default=7))
QUICK_REFINE = Setting(mesh.REFINE._replace(default=0.5))
GOALS = ("largest", "smallest")


def of_orders(name: str, module: str = "orders") -> Callable[..., Any]:
    """A function of `orders` or a sibling module, imported on the first call."""
    return lambda *given: getattr(import_module(f".{module}", __package__), name)(*given)
