"""Figures of a whole unit: size, resin, print time; computed in milliseconds."""

from __future__ import annotations

import math

import attrs
import numpy as np

from .parameters import Unit
from .printing.printer import Printer
from .profile import membrane_volume
from .steps import Struts


@attrs.frozen
class Figures:
    """Size (x, y, z) in mm with the inlet, volume in mm3, mass in g, and time in s to print, upright.

    approximate: True if the volume is `estimated_volume` and not that of the printable solid.
    """

    size_mm: tuple[float, float, float]
    volume_mm3: float
    mass_g: float
    print_s: float
    approximate: bool


def figures(unit: Unit, printer: Printer, struts: Struts | None, volume_mm3: float | None = None) -> Figures:
    """Figures of a unit on a printer; volume_mm3 of its printable solid, where one was built.

    struts: the value of the step of that name, for the estimate.
    """
    d = unit.dimensions
    (x0, x1), (y0, y1), (z0, z1) = d.bounds
    size = (x1 - x0, y1 - y0, z1 - z0 + d.inlet_length)
    volume = estimated_volume(unit, struts) if volume_mm3 is None else volume_mm3
    mass = volume / 1000.0 * printer["density_g_per_ml"]
    return Figures(size, volume, mass, print_time(size[2], printer), volume_mm3 is None)


def estimated_volume(unit: Unit, struts: Struts | None) -> float:
    """Volume in mm3 of membranes, inlet and struts without a waveguide.

    Junctions of struts are counted more than once: for the shipped presets it is 2 % above the solid's.
    """
    d = unit.dimensions
    boss = (d.inlet_radius + d.inlet_wall) ** 2 - d.inlet_radius**2
    volume = membrane_volume(d) + math.pi * d.inlet_length * boss - math.pi * d.inlet_radius**2 * d.base_cap
    if struts is None or struts.lattice is None:
        return volume
    shown = struts.trimmed
    share = shown.last - shown.first
    t = shown.first[:, None] + share[:, None] * np.linspace(0.0, 1.0, 9)
    area = math.pi * (struts.lattice.radii(t, shown.rows) ** 2).mean(axis=1)
    length = np.linalg.norm(shown.ends[:, 1] - shown.ends[:, 0], axis=1) * share
    return volume + float((area * length).sum())


def print_time(height_mm: float, printer: Printer) -> float:
    """Time in s to print a part of that height on its supports: layers times the time of one."""
    return math.ceil((height_mm + printer["support_mm"]) / printer["layer_mm"]) * printer["layer_s"]
