"""Shipped resins and printers as assets: their data in a file, and their pictures."""

from __future__ import annotations

import json
from typing import Any

import bpy
import numpy as np

from ...arrays import Array
from ...design.assets import asset_names
from ...design.printing.printer import load_printer
from ..preview import materials, skeletons
from ..shared import scene_units
from ..unit.envelope import arrays_in
from ..unit.resins import parameters as resin_parameters
from .dropped import PRINTER, RESIN
from .surface_picture import surface_pixels


def names_of_all() -> set[str]:
    """Names of the shipped resins and printers in a file."""
    return {load_printer(name).title for name in asset_names("printers")} | {r.name for r in _resins()}


def _resins() -> list[Any]:
    """Shipped resins; empty without the solver's packages, which reading a law loads."""
    try:
        from ...materials import load_material, material_names
    except (ImportError, OSError, RuntimeError):
        return []
    return [load_material(name) for name in material_names()]


def resins() -> list[Any]:
    """A new material for every shipped resin, with the unit's parameters that it sets."""
    made = []
    for resin in _resins():
        found = bpy.data.materials.new(resin.name)
        found.diffuse_color = materials.COLOURS["MU Membrane"]
        found[RESIN] = json.dumps(resin_parameters(resin))
        found.asset_mark()
        found.asset_data.description = f"Resin of a unit's wall: {resin.about}"
        made.append(found)
    return made


def printers() -> list[Any]:
    """A new object for every shipped printer: its build volume, as a wire box in true size."""
    made = []
    for name in asset_names("printers"):
        printer = load_printer(name)
        size = np.array([printer[f"build_{axis}_mm"] for axis in "xyz"])
        mesh = bpy.data.meshes.new(printer.title)
        half = 0.5 * size * [1.0, 1.0, 0.0]
        skeletons.write(mesh, skeletons.box(-half, half + size * [0.0, 0.0, 1.0]))
        box = bpy.data.objects.new(printer.title, mesh)
        box.scale = (scene_units.mm(bpy.context.scene),) * 3
        box.display_type = "WIRE"
        box[PRINTER] = name
        box.asset_mark()
        box.asset_data.description = f"Printer: {printer.title}"
        made.append(box)
    return made


def pixels_of(made: Any, size: int) -> Array:
    """Pixels (size, size, 4): a ball of a resin, a printer's build volume; rows from below."""
    if isinstance(made, bpy.types.Material):
        mesh, colour = bpy.data.meshes.new("ball"), made.diffuse_color[:3]
        skeletons.write(mesh, skeletons.ball(1.0, 32))
        points, triangles = arrays_in(mesh)
        bpy.data.meshes.remove(mesh)
    else:
        points, triangles = arrays_in(made.data)
        colour = materials.COLOURS["MU Layer"][:3]
    return surface_pixels(points, triangles, np.broadcast_to(colour, (len(triangles), 3)), size)
