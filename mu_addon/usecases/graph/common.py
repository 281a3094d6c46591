"""What several kinds of nodes share: settings, and functions of modules that load the solver."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from ...graph.definition import FILE, Setting
from ...meshing.settings import FIDELITY as FIDELITY_OF_MANY
from ...meshing.settings import ORDER as ORDER_OF_ELEMENTS
from ...meshing.settings import REFINE as REFINEMENT
from ...meshing.settings import SELF_CONTACT as SELF_CONTACT_OF_MANY
from ...meshing.settings import STUDY_FIDELITY, STUDY_SELF_CONTACT
from ..simulate_and_place import settings as study

FIDELITY, SELF_CONTACT = Setting(STUDY_FIDELITY), Setting(STUDY_SELF_CONTACT)
# Of nodes that solve a unit tens of times, or in time.
QUICK_FIDELITY, QUICK_SELF_CONTACT = Setting(FIDELITY_OF_MANY), Setting(SELF_CONTACT_OF_MANY)
SELF_FRICTION, TIMES = Setting(study.SELF_FRICTION), Setting(study.TIMES)
ORIENTATION = Setting(study.ORIENTATION)
PROTOCOL = Setting(study.PROTOCOL, FILE)
ORDER, REFINE = Setting(ORDER_OF_ELEMENTS), Setting(REFINEMENT)
QUICK_TIMES = Setting(study.TIMES._replace(default=7))
QUICK_REFINE = Setting(REFINEMENT._replace(default=0.5))


def of_orders(name: str, module: str = "orders") -> Callable[..., Any]:
    """A function of `orders`, or of another module beside it, which is imported on the first call."""
    return lambda *given: getattr(import_module(f".{module}", __package__), name)(*given)
