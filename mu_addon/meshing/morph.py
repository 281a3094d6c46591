"""Dimensions compared, and scaled, as moving a mesh to a slightly different unit needs it."""

from __future__ import annotations

import attrs

from ..design.dimensions import Dimensions


def struts_alone_differ(a: Dimensions, b: Dimensions) -> bool:
    """Return True if dimensions differ only in the struts, so that the walls agree."""
    struts = ("grading", "junction_diameter", "midspan_diameter")
    return attrs.evolve(b, **{name: getattr(a, name) for name in struts}) == a


def shrunk(d: Dimensions, cell: float) -> Dimensions:
    """Dimensions with every length of membrane, struts and envelope scaled to another cell in mm."""
    by = cell / d.cell
    wall = ("R", "r", "a", "b", "wall", "wall_growth", "base_cap", "tip_cap")
    lengths = (*wall, "junction_diameter", "midspan_diameter", "strut_growth")
    grading = None if d.grading is None else attrs.evolve(d.grading, cell=cell)
    scaled = {name: by * getattr(d, name) for name in lengths}
    return attrs.evolve(d, cell=cell, grading=grading, **scaled)
