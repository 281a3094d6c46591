"""Expected duration of a grasp's stages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..simulate_and_place.expected import BY_REFINEMENT
from .settings import REFINE

if TYPE_CHECKING:
    from ...run.progress_estimate import Plan

GRASP_OF = "grasp of"


def stage_of(side_mm: float) -> str:
    """Name of the stage in which a cube of that side is grasped."""
    return f"{GRASP_OF} {side_mm:g} mm"


def expected_plan(sides_mm: Sequence[float], refine: float, step_s: float) -> Plan:
    """Stages of a grasp of cubes with the expected seconds of each on two cores.

    refine: of the mesh; step_s: longest interval between instants.
    """
    finer = (refine / REFINE.default) ** BY_REFINEMENT
    seconds = 420.0 * finer / step_s
    plan = [("solid", 5.0), *([("mesh", 5.0 * finer)] if sides_mm else [])]
    plan += [(stage_of(side), seconds) for side in sides_mm]
    plan += [("light", 4.0 * len(sides_mm) / step_s)] if sides_mm else []
    return [*plan, ("report", 6.0 if sides_mm else 3.0)]
