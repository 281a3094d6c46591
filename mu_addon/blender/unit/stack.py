"""The core's steps for a unit in the scene: muted and shown ones, and values, cached by content hash."""

from __future__ import annotations

from typing import Any

from ...design.anchors import windows
from ...design.parameters import Unit
from ...design.steps import STEPS, Stack, Step, StepInputs
from . import envelope

STACK = Stack()
"""Values of every unit's steps, shared by units of one shape and by states before and after an undo."""

SHOWN = ("membranes", "struts", "anchors", "wells")
"""Steps that are shown by default."""


def fill(props: Any) -> None:
    """Add an entry for every step of the core to a unit's properties, in its order."""
    if [entry.name for entry in props.stack] == list(STEPS):
        return
    kept = {entry.name: (entry.muted, entry.shown) for entry in props.stack}
    props.stack.clear()
    for name in STEPS:
        entry = props.stack.add()
        entry.name = name
        entry.muted, entry.shown = kept.get(name, (False, name in SHOWN))


def muted(props: Any) -> frozenset[str]:
    """Names of the muted steps."""
    return frozenset(entry.name for entry in props.stack if entry.muted and can_be_muted(entry.name))


def can_be_muted(name: str) -> bool:
    """Return True if the core can do without that step."""
    return name in STEPS and bool(STEPS[name].muting)


def given(root: Any, unit: Unit, quality: str = "interactive") -> StepInputs:
    """Inputs of the steps of a unit in the scene; raises InputError for a body that does not fit."""
    # A unit of fewer chambers has fewer paths: the chosen one is kept until it exists again.
    path = root.mu_unit.path
    known = path in {window.name for window in windows(unit.chambers.count)}
    body = envelope.envelope_in(root, unit)
    return StepInputs(unit, path if known else "", muted(root.mu_unit), quality, body)


def own_parameters(step: Step) -> list[tuple[str, str]]:
    """(section, name) of a step's parameters."""
    return [(section, name) for section, name in (path.split(".") for path in step.own)]
