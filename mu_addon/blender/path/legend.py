"""Names and ranks of the candidate paths, and the key to their colours, drawn over the viewport."""

from __future__ import annotations

from typing import Any

import attrs
import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ..results import field_colours, legend
from ..results import motion as motion_parts
from ..shared.displays import PART
from ..shared.registration import overlay
from ..shared.wording import path_symbol
from ..unit import object as unit_object
from . import ranking
from .candidates import CANDIDATE

BETTER = "Mean deviation [mm], smaller is better"
"""Note on a ranking's numbers, next to the lattice and in the panel."""
ESTIMATED = "Mean deviation [mm], estimated: no path is solved yet"
UNDECIDED = "≈: undecided, closer than the mesh's error"
BOUND = "≥: cannot be the best, not solved further"
BESIDE = 190
"""Pixels taken by the legend of a field, to the left of this one."""


def lines(known: ranking.Known) -> list[str]:
    """Lines above the ramp: its quantity and, if the ranking is stale, a note."""
    if known.stale:
        return ["Mean deviation", "stale (grey): ranked with other parameters"]
    if known.estimated:
        return [ESTIMATED]
    notes = {UNDECIDED: known.tied, BOUND: known.at_least}
    return [BETTER, *(note for note, wanted in notes.items() if wanted)]


def marks(known: ranking.Known) -> list[tuple[float, str]]:
    """Share of the ramp's height and text of the smallest, the largest and round values of J between.

    None of a single value, which the path's own label tells.
    """
    low, high = min(known.numbers.values()), max(known.numbers.values())
    if not high > low:
        return []
    between = [v for v in legend.ticks(low, high) if 0.12 < known.share_of(v) < 0.9]
    return [(known.share_of(value), f"{value:.3g}") for value in (low, *between, high)]


def label(root: Any, known: ranking.Known, name: str) -> list[str]:
    """Name and rank of a path, with a question mark where the ranking is stale."""
    found = [path_symbol(name)]
    if below := known.rank(name) or known.mean(name):
        found.append(below)
    return found


@overlay
def _draw() -> None:
    context = bpy.context
    # Of the active unit, or another if that shows none, so that the legend fits the colours.
    root = unit_object.first_that(context, seen)
    if root is None:
        return
    known = ranking.known(root)
    scale = context.preferences.system.ui_scale
    size = round(12 * scale)
    for name, tube in seen(root):
        end = location_3d_to_region_2d(
            context.region, context.region_data, tube.matrix_world @ tube.data.vertices[0].co
        )
        if end is None:
            continue
        for line, text in enumerate(label(root, known, name), 1):
            legend.write(text, end.x, end.y - 1.3 * size * line - 0.3 * size, size, share=0.5)
    if known.numbers and root.mu_motion.legend:
        _legend(context, root, known)


def _legend(context: Any, root: Any, known: ranking.Known) -> None:
    texts = lines(known)
    place = legend.room(context, len(texts))
    if any(motion_parts.is_seen(root, part) for part in motion_parts.parts(root)):
        place = place.beside(BESIDE)
    found = [] if known.stale else marks(known)
    if not found:
        legend.above(texts, attrs.evolve(place, height=0.0))
        return
    colours = np.array([field_colours.of_map(s) for s in np.linspace(0.0, 1.0, legend.PIECES + 1)])
    legend.ramp(colours, found, place)
    legend.above(texts, place)


def seen(root: Any) -> list[tuple[str, Any]]:
    """Visible candidate paths, by name."""
    found = ((str(child.get(PART, "")), child) for child in root.children)
    return [
        (part.removeprefix(CANDIDATE), child)
        for part, child in found
        if part.startswith(CANDIDATE) and child.visible_get() and len(child.data.vertices)
    ]
