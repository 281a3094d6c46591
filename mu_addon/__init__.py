"""Entry points of the Blender extension: `register` and `unregister`; elsewhere a plain package."""

import importlib
from typing import Any

__version__ = "0.1.0"


def register() -> None:
    """Called by Blender when the extension is enabled; a second call changes nothing."""
    _blender().register()


def unregister() -> None:
    """Called by Blender when the extension is disabled; a second call changes nothing."""
    _blender().unregister()


def _blender() -> Any:
    # By name: importing a part of the core must not import Blender's side.
    return importlib.import_module(".blender", __package__)
