"""Step change."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="between two tests something changed and stayed so: a clamp, a setting, damage",
    reveals="the first test again",
    remedy="find what was changed between these tests, and repeat the first one",
    modulus=True,
)
