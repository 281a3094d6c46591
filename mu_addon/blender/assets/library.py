"""The node groups as an asset library of the user's, written by the Blender that will read it.

One that came in the archive would be of one Blender's format and nodes; this one fits the Blender at hand.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...errors import OutputError
from ...files import write_text
from ..preview import nodes
from ..shared.compat import user_folder

NAME = "Monolithic Units"
FILE = "mu-nodes.blend"
CATALOGUES = "blender_assets.cats.txt"


def write() -> Path:
    """Write every node group and the catalogue into the user's folder; returns the folder. OutputError."""
    folder = user_folder("assets")
    before = set(bpy.data.node_groups)
    groups = {nodes.group(name) for name in nodes.GROUPS}
    beside, target = folder / f".{FILE}", folder / FILE
    try:
        bpy.data.libraries.write(str(beside), groups, fake_user=True, compress=True)
        beside.replace(target)
    except (OSError, RuntimeError) as error:
        raise OutputError(
            f"cannot write the node groups: {error}", str(target), "check the folder"
        ) from error
    finally:
        # What this file does not use is not left in it.
        for tree in groups - before:
            bpy.data.node_groups.remove(tree)
    write_text(folder / CATALOGUES, f"VERSION 1\n\n{nodes.CATALOGUE}:{NAME}:{NAME.replace(' ', '-')}\n")
    return folder


def listed() -> Any | None:
    """The entry of the user's asset libraries that shows the folder, or None."""
    folder = user_folder("assets").resolve()
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((entry for entry in libraries if entry.path and Path(entry.path).resolve() == folder), None)


def add() -> Path:
    """Write the groups and list their folder among the user's asset libraries. Raises OutputError."""
    folder = write()
    if listed() is None:
        bpy.context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(folder))
    return folder


def remove() -> None:
    """Take the folder out of the user's asset libraries, and the files out of the folder."""
    entry = listed()
    if entry is not None:
        bpy.context.preferences.filepaths.asset_libraries.remove(entry)
    for name in (FILE, CATALOGUES):
        (user_folder("assets") / name).unlink(missing_ok=True)
