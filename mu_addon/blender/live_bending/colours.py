"""Stretch and stress on a unit that is bent live: their range, and the colours of its parts."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..preview import materials
from ..results import field_colours

_LOOKS = {"membrane": "MU Membrane", "lattice": "MU Lattice", "before": "MU Before"}


def ends_of(fields: dict[str, dict[str, Any]], field: str) -> tuple[float, float] | None:
    """Range of a field (s, v) by region over all pressures, or None where it was not found."""
    values = [found[field] for found in fields.values() if field in found]
    if not values:
        return None
    ends = [field_colours.BY_NAME[field].ends(one) for one in values]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    return low, max(high, low + 1e-6)


def plain(part: Any, look: str) -> None:
    """Give a part the colour of its region in the design or, with "before", a dim one."""
    materials.wear(part.data, materials.material(_LOOKS[look]))
    left = part.data.color_attributes.get(field_colours.COLOUR)
    if left is not None:
        part.data.color_attributes.remove(left)


def coloured(root: Any, part: Any, field: str, values: Any, ends: tuple[float, float]) -> None:
    """Colour a part by values (v,) of a field at its vertices."""
    name = f"MU Live {root.mu_unit.uuid[:8]}"
    found = bpy.data.materials.get(name)
    if found is None:
        found = field_colours.material_of(root).copy()
        found.name = name
    field_colours.set_range(found, field, ends)
    materials.wear(part.data, found)
    attribute = part.data.attributes.get(field) or part.data.attributes.new(field, "FLOAT", "POINT")
    attribute.data.foreach_set("value", np.ascontiguousarray(values, np.float32))
    field_colours.write_colours(root, part.data, values, ends)
