"""Anisotropy."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="layers make the modulus depend on direction",
    reveals="specimens printed along x, y and z",
    remedy=f"{IN_MODEL}; print all parts the same way, or along another direction",
)
