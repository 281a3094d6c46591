"""Every candidate path, drawn as a chart beside the lattice of a unit at rest."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs.start_child import JOB_ENDED
from ..preview import skeletons
from ..preview.skeletons import Skeleton
from ..shared import displays, viewports
from ..shared.registration import connected
from ..unit import drawing, preview_update
from ..unit import object as unit_object
from ..unit.object import DRAWN_BESIDE, PREVIEW_DRAWN
from ..unit.properties import to_unit
from . import ranking

CANDIDATE = "candidate:"
THICKER = 1.7
"""Factor on the width of the chosen path's bar: its colour is that of its J, as of every bar."""
FREE = "free"
"""The whole lattice's best path, if a study has searched it."""


def candidate(root: Any, name: str) -> Any | None:
    """The object that shows the candidate path of that name, or None."""
    return drawing.beside(root, CANDIDATE + name)


@connected(PREVIEW_DRAWN)
def _draw(root: Any) -> None:
    """Draw every candidate path beside the lattice, in the colour of its J if it is known, or none."""
    unit, drawn = to_unit(root.mu_unit), dict[str, Skeleton]()
    if root.mu_unit.candidates:
        lanes = skeletons.candidates(unit)
        drawn = {CANDIDATE + name: path for name, path in lanes.items()}
        found = ranking.free(root)
        if found is not None:
            name, _, points = found
            drawn[FREE] = skeletons.free_path(points, name, unit.dimensions.cell)
    new = bool(drawn) and not any(drawing.beside(root, name) for name in drawn)
    for name, path in drawn.items():
        chosen = name in (FREE, CANDIDATE + root.mu_unit.path)
        if chosen and name != FREE:
            path.attributes["radius"] *= THICKER
        colour = "MU Waveguide" if chosen else "MU Candidate"
        title = name.removeprefix(CANDIDATE) if name != FREE else ""
        drawing.put_beside(root, name, path, colour, "MU Labelled Tube", title)
    tubes = {name.removeprefix(CANDIDATE): drawing.beside(root, name) for name in drawn if name != FREE}
    if tubes:
        ranking.colour_and_label(root, tubes)
    if FREE in drawn:
        ranking.colour_free(root, drawing.beside(root, FREE), *found[:2])
    if new and not bpy.app.background:
        # Not in a handler of an update, where nothing may be evaluated.
        uuid = root.mu_unit.uuid
        bpy.app.timers.register(lambda: _keep_in_view(uuid), first_interval=0.0)
    for child in list(root.children):
        name = child.get(displays.PART, "")
        if (name == FREE or name.startswith(CANDIDATE)) and name not in drawn:
            displays.remove(child)


def _keep_in_view(uuid: str) -> None:
    """A view that holds the unit holds its chart, too."""
    root = unit_object.by_uuid(uuid)
    if root is not None:
        tubes = [child for child in root.children if child.get(displays.PART, "").startswith(CANDIDATE)]
        viewports.keep_in_view(viewports.corners([root]), viewports.corners([root, *tubes]))


@connected(DRAWN_BESIDE)
def _known(root: Any) -> Any:
    """Results by which the paths are coloured; () while they are hidden."""
    return (ranking.known(root), ranking.free(root)) if root.mu_unit.candidates else ()


@connected(JOB_ENDED)
def _job_ended(_key: str) -> None:
    # Its results appear on the paths.
    preview_update.catch_up()
