"""A unit as printed: nominal dimensions with every surface moved outward by the printer's offsets.

Unchanged are pitch, envelope, end planes and anchors, which lattice cells and build plate fix, and the
virtual inclusion, which is part of the model. A surface facing n moves by |D n| with D = diag(offset_xy,
offset_xy, offset_z), see `shapes.offset_along`.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from .dimensions import Dimensions
from .profile import outer_radius, outer_slope
from .shapes import offset_along, ring


def as_printed(d: Dimensions, offset_xy: float, offset_z: float) -> Dimensions:
    """Dimensions of the part as printed: every surface moved outward by the print offsets in mm.

    offset_xy in the plane, offset_z along z; negative ones move inward. Struts and walls grow by twice the
    offset, or by its mean round the struts and over the profile where the two differ. The outer profile
    remains parabolic, with R + o, r + o and the joint moved along z so that it is offset equally: equal
    offsets o then move the profile by o within 0.1 o everywhere. Caps grow by 2 offset_z inward, so that
    their ends keep their planes; wells keep their depth.
    """
    if offset_xy == 0.0 and offset_z == 0.0:
        return d
    offset = np.array([offset_xy, offset_xy, offset_z])
    steepest = 2.0 * (d.R - d.r) / (d.a + d.b)
    normal = np.array([[1.0, 0.0, steepest]]) / np.hypot(1.0, steepest)
    # At the joint the profile must rise by |D n|/n_r; a joint moved by s raises it there by o_xy + slope s/2.
    rise = _outward(normal, offset)[0] * np.hypot(1.0, steepest)
    moved = 2.0 * (rise - offset_xy) / steepest
    strut, wall = 2.0 * _round_the_struts(d, offset), 2.0 * _over_the_profile(d, offset)
    return attrs.evolve(
        d,
        R=d.R + offset_xy,
        r=d.r + offset_xy,
        a=d.a + moved,
        b=d.b - moved,
        wall=d.wall + wall,
        wall_growth=d.wall_growth + wall,
        base_cap=d.base_cap + 2.0 * offset_z,
        tip_cap=d.tip_cap + 2.0 * offset_z,
        inlet_radius=d.inlet_radius - offset_xy,
        inlet_length=d.inlet_length + offset_z,
        inlet_wall=d.inlet_wall + 2.0 * offset_xy,
        junction_diameter=d.junction_diameter + strut,
        midspan_diameter=d.midspan_diameter + strut,
        strut_growth=d.strut_growth + strut,
        waveguide_section=d.waveguide_section + 2.0 * offset_xy,
        waveguide_end=d.waveguide_end + offset_z,
        well_width=d.well_width - 2.0 * offset_z,
    )


def _outward(normals: Array, offset: Array) -> Array:
    """Outward move (n,) of surfaces along their unit normals (n, 3)."""
    return np.asarray(np.sum(offset_along(normals, offset) * normals, axis=1))


def _round_the_struts(d: Dimensions, offset: Array) -> float:
    """Mean outward move of the lattice's struts, by length and round each."""
    kind = d.kind
    axes = np.diff(kind.nodes[kind.struts], axis=1)[:, 0]
    moves = [_outward(ring(axis, 64), offset).mean() for axis in axes]
    return float(np.average(moves, weights=np.linalg.norm(axes, axis=1)))


def _over_the_profile(d: Dimensions, offset: Array) -> float:
    """Mean outward move of the outer profile, by its area."""
    z = d.cell * (np.arange(400) + 0.5) / 800.0
    slope = outer_slope(d, z)
    stretch = np.hypot(1.0, slope)
    normals = np.stack([1.0 / stretch, np.zeros_like(z), -slope / stretch], axis=1)
    return float(np.average(_outward(normals, offset), weights=outer_radius(d, z) * stretch))


def skin_stiffening(wall: ArrayLike, depth: float, factor: float) -> Array:
    """Modulus of a wall with a stiffer skin on both faces over its core's: Voigt's mean over the thickness.

    wall, depth: thickness of the wall (any shape) and of one skin, in mm; factor: modulus of skin over core.
    The skin's share is min(1, 2 depth/wall). Exact for stretch along the wall; in bending, where the faces
    count most, a stiffer skin is underestimated.

    >>> float(skin_stiffening(wall=1.0, depth=0.1, factor=2.0))
    1.2
    """
    share = np.minimum(1.0, 2.0 * depth / np.asarray(wall, float))
    return np.asarray(1.0 + share * (factor - 1.0))
