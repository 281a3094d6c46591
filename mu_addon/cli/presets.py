"""`presets`: the shipped units and grippers."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `presets`."""
    commands.add_parser(
        "presets",
        help="List the shipped presets: units, and grippers for `grip`.",
        epilog="example: run.py presets",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Put every preset's name and size into the summary."""
    from ..design.gripper import gripper_names, load_gripper
    from ..design.parameters import load_preset, preset_names

    for name in preset_names():
        d = load_preset(name).dimensions
        context.summary[name] = f"cell {d.cell:g} mm, {d.count} chambers, {d.height:g} mm long"
    for name in gripper_names():
        gripper = load_gripper(name)
        context.summary[name] = f"two fingers {gripper.unit.name}, {gripper.fingers.gap_mm:g} mm apart"
    context.console_summary = lambda summary: [
        f"{name:12s} {summary[name]}" for name in (*preset_names(), *gripper_names())
    ]
