"""The subcommands of the command line, a module each or for several that share their options.

Each has `add(commands)`, which adds its parser and may import nothing heavy, and `run(options, context)`,
which makes a use case's job of the options and starts it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

# In the order in which --help lists them, further studies after these; a module's name is its command's, with
# _ for -, and a trailing _ for a keyword of Python.
NAMES = (
    "presets",
    "design",
    "check",
    "export",
    "specimens",
    "simulate",
    "place",
    "resume",
    "compare",
    "sweep",
    "optimize",
    "graph",
    "homogenize",
    "grip",
    "chain",
    "fit_material",
    "import_",
    "track",
    "diagnose",
    "design_experiments",
    "ports",
    "stream",
    "record",
    "replay",
    "calibrate",
)


_MODULES = dict.fromkeys(("ports", "record", "replay"), "stream")
"""Modules of commands that share one; each of its functions has its command's name, except a shared `run`."""


class Command(NamedTuple):
    """`add(commands)` adds a command's parser; `run(options, context)` starts its job."""

    add: Callable[[Any], None]
    run: Callable[[Any, Any], None]


def _command(name: str) -> Command:
    from ..studies import STUDIES, study

    command = name.rstrip("_").replace("_", "-")
    if command in STUDIES and (study(command).example or study(command).commands):
        from .studies import command_of

        return Command(*command_of(command))
    module = import_module(f".{_MODULES.get(name, name)}", __name__)
    add, run = (getattr(module, f"{what}_{name}", None) or getattr(module, what) for what in ("add", "run"))
    return Command(add, run)


def all_commands() -> dict[str, Command]:
    """Every subcommand by its name; a study without an example is none."""
    from ..studies import STUDIES, study

    found = {name.rstrip("_").replace("_", "-"): _command(name) for name in NAMES}
    return found | {name: _command(name) for name in STUDIES if name not in found and study(name).example}
