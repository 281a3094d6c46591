"""`presets`: the units that come with the package."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..ending import Ending
    from ..progress import Progress
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `presets`."""
    commands.add_parser("presets", help="list the presets that come with the package")


def run(options: argparse.Namespace, progress: Progress, ending: Ending) -> None:
    """Put every preset's name and size into the summary."""
    from ...design.parameters import load_preset, preset_names

    for name in preset_names():
        d = load_preset(name).dimensions
        ending.summary[name] = f"cell {d.cell:g} mm, {d.count} chambers, {d.height:g} mm long"


def answer(summary: dict[str, Any]) -> list[str]:
    """A line for each preset."""
    return [f"{name:12s} {words}" for name, words in summary.items() if name.startswith("mu-")]
