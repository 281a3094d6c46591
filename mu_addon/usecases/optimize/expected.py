"""Expected duration of an optimisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...meshing.settings import MeshSettings
    from ...run.progress_estimate import Plan

MOST_CHECKED = 6
"""Most units of a front that are simulated again on a finer mesh: its ends and some evenly between."""
# Seconds on two cores that a unit of the search, and one that is checked, take about on a mesh of 1, whose
# lattice is homogenised.
_A_UNIT_S, _A_CHECK_S = 60.0, 100.0
# Of the printed body, and of walls and struts that are kept apart.
_PRINTED, _APART = 3.0, 3.0


def search_plan(
    units: int, settings: MeshSettings, check_refine: float, self_contact: bool, objectives: int = 2
) -> Plan:
    """Stages of a search among so many units, with the expected seconds of each on two cores.

    settings: of the search's mesh; check_refine: refinement of the check of its proposals, of which there is
    one with fewer than two objectives.
    """
    checked = min(MOST_CHECKED, units) if objectives > 1 else 1
    slower = (_PRINTED if settings.resolved else 1.0) * (_APART if self_contact else 1.0)
    # A unit's time grows as the square of the refinement: homogenised 15 s at 0.5, printed 43 s.
    return [
        ("search", slower * _A_UNIT_S * settings.refine**2 * units),
        ("check of what is proposed", slower * _A_CHECK_S * check_refine**2 * checked),
        ("report", 20.0),
    ]
