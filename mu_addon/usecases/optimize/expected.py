"""Expected duration of an optimisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...run.progress_estimate import Plan

MOST_CHECKED = 6
"""Most units of a front that are simulated again on a finer mesh: its ends and some evenly between."""
# Seconds on two cores that a unit of the search, and one that is checked, take about on a mesh of 1.
_A_UNIT_S, _A_CHECK_S = 60.0, 100.0


def search_plan(units: int, refine: float, check_refine: float) -> Plan:
    """Stages of a search among so many units, with the expected seconds of each on two cores.

    refine, check_refine: refinements of the search, and of the check of its proposals.
    """
    # A unit's time grows as the square of that: 15 s at 0.5, 7 s at 0.35.
    return [
        ("search", _A_UNIT_S * refine**2 * units),
        ("check of what is proposed", _A_CHECK_S * check_refine**2 * min(MOST_CHECKED, units)),
        ("report", 20.0),
    ]
