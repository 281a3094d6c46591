"""The lengths of a unit in mm at its scale, from which geometry and meshes are made."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import lattice_kinds
from .grading import Field
from .wall_factors import factor_at


@attrs.frozen
class Dimensions:
    """Lengths of a unit in mm at its scale, as geometry and meshes take them.

    cell: the lattice cell U, which is also the pitch of the chambers; count: of chambers. R and r: outer
    radii of the profile at a bladder's apex and at a neck; a and b: half-lengths of their parabola arcs, a +
    b = U/2. wall: along the surface normal; wall_factors: of single chambers, () if all are equal;
    wall_growth: thickness added by printing, which no factor multiplies. Counts of cells and `row` are whole
    numbers, see `parameters.Envelope`. grading: of the struts, None for uniform struts; strut_growth:
    diameter added by printing, which no grading multiplies.

    >>> from mu_addon.design import load_preset
    >>> d = load_preset("mu-1.5x").dimensions
    >>> d.cell, d.R, d.height
    (18.75, 18.75, 112.5)
    """

    scale: float
    cell: float
    count: int
    R: float
    r: float
    a: float
    b: float
    wall: float
    base_cap: float
    tip_cap: float
    inlet_radius: float
    inlet_length: float
    inlet_wall: float
    cells_x: int
    cells_y_minus: int
    cells_y_plus: int
    kind: lattice_kinds.LatticeKind
    junction_diameter: float
    midspan_diameter: float
    row: int
    waveguide_section: float
    waveguide_end: float
    well_width: float
    well_depth: float
    well_pitch: float
    seats: bool
    part_length: float
    part_width: float
    part_height: float
    seat_clearance: float
    seat_wall: float
    cable: float
    inclusion_radius: float
    grading: Field | None = None
    strut_growth: float = 0.0
    wall_factors: tuple[float, ...] = ()
    wall_growth: float = 0.0

    def wall_at(self, z: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Wall in mm along the normal of the outer profile at heights z in mm (any shape), and its slope."""
        at = np.asarray(z, float)
        if not self.wall_factors:
            return np.full(at.shape, self.wall), np.zeros(at.shape)
        factor, slope = factor_at(self.wall_factors, self.cell, at)
        drawn = self.wall - self.wall_growth
        return drawn * factor + self.wall_growth, drawn * slope

    @property
    def thinnest_wall(self) -> float:
        """Thickness in mm of the thinnest chamber's wall."""
        return (self.wall - self.wall_growth) * min(self.wall_factors, default=1.0) + self.wall_growth

    @property
    def thickest_wall(self) -> float:
        """Thickness in mm of the thickest chamber's wall."""
        return (self.wall - self.wall_growth) * max(self.wall_factors, default=1.0) + self.wall_growth

    def strut_factors(self, points: ArrayLike) -> NDArray[np.float64]:
        """Factors (n,) of the grading at points (n, 3) in mm; 1 without one."""
        at = np.asarray(points, float)
        return np.ones(len(at)) if self.grading is None else self.grading.at(at)

    def junction_diameters(self, points: ArrayLike) -> NDArray[np.float64]:
        """Diameters (n,) in mm of struts that meet at nodes (n, 3) in mm."""
        drawn = self.junction_diameter - self.strut_growth
        return np.asarray(drawn * self.strut_factors(points) + self.strut_growth)

    @property
    def height(self) -> float:
        """Length of the unit along z in mm, without the inlet boss."""
        return self.count * self.cell

    @property
    def joint_radius(self) -> float:
        """Outer radius in mm at the joint of the arcs of bladder and neck: (R b + r a)/(a + b)."""
        return (self.R * self.b + self.r * self.a) / (self.a + self.b)

    @property
    def apex_curvature_radius(self) -> float:
        """Radius of curvature in mm of the profile at an apex; a thicker wall folds its inner offset."""
        return self.a * (self.a + self.b) / (2.0 * (self.R - self.r))

    @property
    def bounds(self) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Box of the lattice envelope in mm: (low, high) along x, y and z."""
        x = self.cell * self.cells_x / 2.0
        return (
            (-x, x),
            (-self.cell * (self.cells_y_minus + 0.5), self.cell * (self.cells_y_plus + 0.5)),
            (0.0, self.height),
        )
