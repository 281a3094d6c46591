"""Inertia."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="the unit's mass swings after each change of pressure",
    reveals="the same steps through a narrower line; a ballast on the tip lengthens its period",
    remedy="read steps after they have settled, or let pressure in slowly: the simulation has no inertia",
)
