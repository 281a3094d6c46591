"""Contact."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the unit touches an obstacle",
    reveals="the same protocol away from every obstacle",
    remedy="remove the obstacle, or simulate it with --obstacle",
    of=BENCH,
)
