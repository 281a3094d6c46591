"""Blender's door to the core: this version installs and registers, its panels are not there yet.

Until they are, the core is used from the command line (`headless/run.py`) or imported as a library.
"""


def register() -> None:
    """Called by Blender when the extension is enabled; this version adds nothing to its interface."""


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
