"""Expected duration of an optimisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...run.progress_estimate import Plan

MOST_CHECKED = 6
"""Most units of a front that are simulated again on a finer mesh: its ends and some evenly between."""
_A_STATE_S, _BY_REFINEMENT = 76.0, 1.8
"""Seconds of a state with its slopes at a refinement of 1, and the exponent of the refinement."""
_CHECKED, _APART = 1.2, 3.0
"""Factors on that of a unit that is checked, and of walls and struts that are kept apart."""


def search_plan(
    units: int,
    refine: float,
    check_refine: float,
    self_contact: bool,
    objectives: int = 2,
    states: int = 2,
) -> Plan:
    """Stages of a search among so many units, with the expected seconds of each on two cores.

    refine: of the search's mesh; check_refine: of the check of its proposals, a single one with fewer than
    two objectives; states: of a unit, under the targets' pressures.
    """
    checked = min(MOST_CHECKED, units) if objectives > 1 else 1

    def seconds(refine: float) -> float:
        return max(states, 1) * _A_STATE_S * refine**_BY_REFINEMENT * (_APART if self_contact else 1.0)

    return [
        ("search", seconds(refine) * units),
        ("check of what is proposed", _CHECKED * seconds(check_refine) * checked),
        ("report", 3.0),
    ]
