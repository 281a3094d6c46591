"""The subcommands of the command line, a module each or for several that share their options.

Each has `add(commands)`, which adds its parser and may import nothing heavy, and `run(options, context)`,
which makes a use case's job of the options and starts it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

_BY_PAGE = {
    "design": ("presets", "design"),
    "print": ("check", "export", "specimens"),
    "simulate": ("simulate", "homogenize"),
    "sense": ("place",),
    "runs": ("resume", "compare"),
    "search": ("sweep", "optimize", "graph"),
    "assemblies": ("grip", "chain"),
    "measure": ("fit-material", "import", "track", "diagnose", "design-experiments"),
    "bench": ("ports", "stream", "record", "replay", "calibrate"),
}
PAGES = {name: page for page, names in _BY_PAGE.items() for name in names}
"""Page of the guide on each command, in the order in which --help lists them; further studies come after."""

_MODULES = dict.fromkeys(("ports", "record", "replay"), "stream")
"""Modules of commands that share one; each of its functions has its command's name, except a shared `run`."""


class Command(NamedTuple):
    """`add(commands)` adds a command's parser; `run(options, context)` starts its job."""

    add: Callable[[Any], None]
    run: Callable[[Any, Any], None]


def _command(name: str) -> Command:
    from ..studies import STUDIES, study

    if name in STUDIES and (study(name).example or study(name).commands):
        from .studies import command_of

        return Command(*command_of(name))
    module = import_module(f".{_MODULES.get(name, name)}", __name__)
    add, run = (getattr(module, f"{what}_{name}", None) or getattr(module, what) for what in ("add", "run"))
    return Command(add, run)


def all_commands() -> dict[str, Command]:
    """Every subcommand by its name; a study without an example is none."""
    from ..studies import STUDIES, study

    others = (name for name in STUDIES if name not in PAGES and study(name).example)
    return {name: _command(name) for name in (*PAGES, *others)}
