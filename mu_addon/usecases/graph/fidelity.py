"""What of a unit's lattice is simulated: settings that several nodes have."""

from __future__ import annotations

from ...graph.definition import setting
from ...meshing.settings import FIDELITIES, HOMOGENISED, RESOLVED

_WHAT = "the printed body with its struts, or a continuum in place of the lattice"
_APART = "keep walls and struts of a resolved unit apart"
FIDELITY = setting("fidelity", RESOLVED, _WHAT, choices=tuple(FIDELITIES))
SELF_CONTACT = setting("self_contact", True, _APART)
# Of nodes that solve a unit tens of times, or in time.
QUICK_FIDELITY = setting("fidelity", HOMOGENISED, _WHAT, choices=tuple(FIDELITIES))
QUICK_SELF_CONTACT = setting("self_contact", False, _APART)
SELF_FRICTION = setting(
    "self_friction",
    0.0,
    "coefficient of friction of walls and struts on each other, with self-contact",
    low=0,
    high=5,
)
