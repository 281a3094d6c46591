"""The subcommands of the command line, a module each.

Each has `add(commands)`, which adds its parser and may import nothing heavy, and `run(options, context)`,
which makes a use case's job of the options and starts it.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

# In the order in which --help lists them; a module's name is its command's, with _ for -, and a trailing _
# for a keyword of Python.
NAMES = (
    "presets",
    "design",
    "check",
    "export",
    "specimens",
    "simulate",
    "place",
    "resume",
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


def all_commands() -> dict[str, ModuleType]:
    """Every subcommand's module by the subcommand's name."""
    return {name.rstrip("_").replace("_", "-"): import_module(f".{name}", __name__) for name in NAMES}
