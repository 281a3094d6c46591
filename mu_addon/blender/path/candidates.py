"""Every candidate path, drawn on the lattice of a unit at rest."""

from __future__ import annotations

from typing import Any

from ..jobs.start_child import JOB_ENDED
from ..preview import skeletons
from ..preview.skeletons import Skeleton
from ..shared import displays
from ..shared.registration import add_handlers, remove_handlers
from ..unit import drawing, preview_update
from ..unit.object import DRAWN_BESIDE, PREVIEW_DRAWN
from ..unit.properties import to_unit
from . import ranking

CANDIDATE = "candidate:"
FREE = "free"
"""The whole lattice's best path, if a study has searched it."""


def candidate(root: Any, name: str) -> Any | None:
    """The object that shows the candidate path of that name, or None."""
    return drawing.beside(root, CANDIDATE + name)


def _draw(root: Any) -> None:
    """Draw every candidate path on the lattice, in the colour of its J if it is known, or none."""
    unit, drawn = to_unit(root.mu_unit), dict[str, Skeleton]()
    if root.mu_unit.candidates:
        lanes = skeletons.candidates(unit, root.mu_unit.cut)
        drawn = {CANDIDATE + name: path for name, path in lanes.items()}
        found = ranking.free(root)
        if found is not None:
            name, _, points = found
            drawn[FREE] = skeletons.free_path(points, name, unit.dimensions.cell)
    for name, path in drawn.items():
        chosen = name in (FREE, CANDIDATE + root.mu_unit.path)
        colour = "MU Waveguide" if chosen else "MU Candidate"
        title = name.removeprefix(CANDIDATE) if name != FREE else ""
        drawing.put_beside(root, name, path, colour, "MU Labelled Tube", title)
    tubes = {name.removeprefix(CANDIDATE): drawing.beside(root, name) for name in drawn if name != FREE}
    if tubes:
        ranking.colour_and_label(root, tubes)
    for child in list(root.children):
        name = child.get(displays.PART, "")
        if (name == FREE or name.startswith(CANDIDATE)) and name not in drawn:
            displays.remove(child)


def _known(root: Any) -> Any:
    """Results by which the paths are coloured; () while they are hidden."""
    return (ranking.known(root), ranking.free(root)) if root.mu_unit.candidates else ()


def _job_ended(_key: str) -> None:
    # Its results appear on the paths.
    preview_update.catch_up()


_CONNECTIONS = ((PREVIEW_DRAWN, _draw), (DRAWN_BESIDE, _known), (JOB_ENDED, _job_ended))


def register() -> None:
    """Draw the paths with each preview, and again when a job ends."""
    add_handlers({}, _CONNECTIONS)


def unregister() -> None:
    """Stop that."""
    remove_handlers({}, _CONNECTIONS)
