"""Mesh error."""

from .declaration import ALL, Declaration

EFFECT = Declaration(
    mechanism="the mesh of the model is too coarse",
    reveals="the same simulation on a finer mesh",
    remedy="simulate with a finer mesh, --refine",
    of=ALL,
)
