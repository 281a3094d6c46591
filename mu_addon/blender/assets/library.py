"""Presets and node groups as an asset library of the user's, written by the Blender that will read it.

An archive's library would be in one Blender's format and nodes; this one fits the running Blender. A preset
is an object: dropped into a scene it is a unit. A resin is a material, a printer a box of its build volume:
dropped on a unit they set its parameters, see `dropped`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...design.section_picture import section_pixels
from ...errors import MuError, OutputError
from ...files import write_text
from ..preview import nodes
from ..shared.compat import user_folder
from ..unit import object as unit_object
from ..unit import presets
from .group_pictures import group_pixels
from .resins_and_printers import names_of_all, pixels_of, printers, resins

NAME = "Monolithic Units"
FILE, UNITS_FILE, MADE_FILE = "mu-nodes.blend", "mu-units.blend", "mu-resins-and-printers.blend"
RESINS_CATALOGUE, PRINTERS_CATALOGUE = (
    "b0c2a1de-52c3-4f0f-9c0e-1f1f5a7a3e10",
    "c7f6b5aa-0d52-4a0b-8f57-6e2c1f3b9d42",
)
UNITS_CATALOGUE = "2d1c1c0e-8d0f-4b5e-9a55-6f6c2f0f4a10"
CATALOGUES = "blender_assets.cats.txt"
_PIXELS = 128
_OWN = ", your own"
"""Suffix of the title of a user's preset with the name of a shipped one."""


def write() -> Path:
    """Write presets, node groups and catalogues into the user's folder; return it. Raises OutputError."""
    folder = user_folder("assets")
    before, materials = set(bpy.data.node_groups), set(bpy.data.materials)
    groups = {nodes.group(name) for name in nodes.GROUPS}
    try:
        for group in groups:
            _picture(group, group_pixels(group.name, _PIXELS))
        _write(folder / FILE, groups)
        titles = _titles()
        with _set_aside({*titles.values(), *names_of_all()}):
            _write_units(folder / UNITS_FILE, titles)
            _write_resins_and_printers(folder / MADE_FILE)
    finally:
        # Unused data are not left in this file.
        for tree in set(bpy.data.node_groups) - before:
            bpy.data.node_groups.remove(tree)
        for material in set(bpy.data.materials) - materials:
            bpy.data.materials.remove(material)
    named = {nodes.CATALOGUE: NAME, UNITS_CATALOGUE: f"{NAME}/Presets"}
    named |= {RESINS_CATALOGUE: f"{NAME}/Resins", PRINTERS_CATALOGUE: f"{NAME}/Printers"}
    lines = [f"{uuid}:{path}:{path.replace(' ', '-').replace('/', '-')}" for uuid, path in named.items()]
    write_text(folder / CATALOGUES, "\n".join(["VERSION 1", "", *lines, ""]))
    return folder


def _titles() -> dict[str, str]:
    """Title of every preset in the asset browser, by its name."""
    titles: dict[str, str] = {}
    for name in presets.names():
        title = name.removeprefix(presets.USER)
        titles[name] = f"{title}{_OWN}" if title in titles.values() else title
    return titles


@contextmanager
def _set_aside(names: set[str]) -> Iterator[None]:
    """Rename this file's objects, meshes and materials of these names temporarily.

    Names are unique in a file: with a unit of that name in it, the preset would be "mu-1.0x.001".
    """
    kinds = bpy.data.objects, bpy.data.meshes, bpy.data.materials
    named = [(d, d.name) for kind in kinds for d in kind if d.library is None and d.name in names]
    try:
        for d, name in named:
            d.name = f"{name} aside"
        yield
    finally:
        for d, name in named:
            d.name = name


def _write_units(target: Path, titles: dict[str, str]) -> None:
    """Write every preset as an object that is an asset. Raises OutputError."""
    context = bpy.context
    active, selected = context.view_layer.objects.active, list(context.selected_objects)
    roots = []
    try:
        for name, title in titles.items():
            try:
                unit = presets.load(name)
            except MuError:
                continue  # a user's file that is no valid preset; loading it reports why
            root = unit_object.create(context, unit)
            roots.append(root)
            root.name = root.data.name = title
            root.asset_mark()
            root.asset_data.catalog_id = UNITS_CATALOGUE
            root.asset_data.description = (
                f"Monolithic Unit, {unit.chambers.count} chambers, scale {unit.scale:g}"
            )
            _picture(root, section_pixels(unit, _PIXELS))
        # The node groups of the units are saved too, and are assets of the other file.
        with nodes.no_assets():
            _write(target, set(roots))
    finally:
        for root in roots:
            unit_object.delete(root)
        for obj in selected:
            obj.select_set(True)
        context.view_layer.objects.active = active


def _write_resins_and_printers(target: Path) -> None:
    """Write every shipped resin and printer as an asset. Raises OutputError."""
    catalogues = {RESINS_CATALOGUE: resins(), PRINTERS_CATALOGUE: printers()}
    made = [data for group in catalogues.values() for data in group]
    try:
        for catalogue, group in catalogues.items():
            for data in group:
                data.asset_data.catalog_id = catalogue
                _picture(data, pixels_of(data, _PIXELS))
        _write(target, set(made))
    finally:
        for data in made:
            if isinstance(data, bpy.types.Material):
                bpy.data.materials.remove(data)
            else:
                bpy.data.meshes.remove(data.data)


def _picture(data: Any, pixels: np.ndarray[Any, Any]) -> None:
    """Set the preview (_PIXELS, _PIXELS, 4) of an asset in the asset browser."""
    preview = data.preview_ensure()
    preview.image_size = (_PIXELS, _PIXELS)
    preview.image_pixels_float.foreach_set(pixels.astype(np.float32).ravel())


def _write(target: Path, data: set[Any]) -> None:
    beside = target.with_name(f".{target.name}")
    try:
        bpy.data.libraries.write(str(beside), data, fake_user=True, compress=True)
        beside.replace(target)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"cannot write the assets: {error}", str(target), "check the folder") from error


def listed() -> Any | None:
    """Entry of the user's asset libraries for the folder, or None."""
    folder = user_folder("assets").resolve()
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((entry for entry in libraries if entry.path and Path(entry.path).resolve() == folder), None)


def add() -> Path:
    """Write the assets and list their folder among the user's asset libraries. Raises OutputError."""
    folder = write()
    if listed() is None:
        bpy.context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(folder))
    return folder


def remove() -> None:
    """Remove the folder from the user's asset libraries, and the files from the folder."""
    entry = listed()
    if entry is not None:
        bpy.context.preferences.filepaths.asset_libraries.remove(entry)
    for name in (FILE, UNITS_FILE, MADE_FILE, CATALOGUES):
        (user_folder("assets") / name).unlink(missing_ok=True)
