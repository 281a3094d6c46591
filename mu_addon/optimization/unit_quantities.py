"""Quantities of the drawn unit as a whole, which need no simulation: mass, time to print, wall."""

from __future__ import annotations

import attrs

from ..design.body import Body, envelope
from ..design.figures import estimated_volume, print_time
from ..design.parameters import Unit
from ..design.printing.printer import Printer
from ..design.steps import Stack, StepInputs
from .structure import Condition, States, Structure


@attrs.frozen
class Mass:
    """Mass in g, by `estimated_volume` (2 % above the solid's for the shipped units), without a waveguide.

    density_g_per_ml: of the resin; body: in place of the lattice's box, or None. The mass jumps a little
    where a strut enters the actuator, so that its derivative is that between units a little apart.
    """

    name: str
    density_g_per_ml: float
    printer: Printer
    conditions: tuple[Condition, ...] = ()
    body: Body | None = None

    def value(self, structure: Structure, states: States) -> float:
        """Value in g."""
        unit: Unit = structure.about
        body = None if self.body is None else envelope(self.body, unit.dimensions)
        struts = Stack().value("struts", StepInputs(unit, body=body))
        return estimated_volume(unit, struts) / 1000.0 * self.density_g_per_ml


@attrs.frozen
class PrintTime:
    """Time in h to print the unit upright: its layers, not rounded, times the time of one."""

    name: str
    printer: Printer
    conditions: tuple[Condition, ...] = ()

    def value(self, structure: Structure, states: States) -> float:
        """Value in h."""
        d = structure.about.dimensions
        height = d.height + d.inlet_length
        return print_time(height, self.printer) / 3600.0

    def change(self, structure: Structure, states: States, plus: Structure, minus: Structure) -> float:
        """Change of the print time in h, of layers that are not rounded to whole ones."""
        heights = [s.about.dimensions.height + s.about.dimensions.inlet_length for s in (plus, minus)]
        return (heights[0] - heights[1]) / self.printer["layer_mm"] * self.printer["layer_s"] / 3600.0


@attrs.frozen
class WallThickness:
    """Thickness in mm of the thinnest chamber's wall as drawn, which the print check compares with the
    printer's limit."""

    name: str
    conditions: tuple[Condition, ...] = ()

    def value(self, structure: Structure, states: States) -> float:
        """Value in mm."""
        return float(structure.about.dimensions.thinnest_wall)
