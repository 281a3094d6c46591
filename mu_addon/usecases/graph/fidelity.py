"""What of a unit's lattice is simulated: settings that several nodes have."""

from __future__ import annotations

from ...graph.definition import setting
from ...meshing.settings import FIDELITIES, HOMOGENISED

FIDELITY = setting(
    "fidelity",
    HOMOGENISED,
    "the printed body with its struts, or a continuum in place of the lattice",
    choices=tuple(FIDELITIES),
)
SELF_CONTACT = setting("self_contact", False, "keep walls and struts of a resolved unit apart")
SELF_FRICTION = setting(
    "self_friction",
    0.0,
    "coefficient of friction of walls and struts on each other, with self-contact",
    low=0,
    high=5,
)
