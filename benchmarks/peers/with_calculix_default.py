"""CalculiX at the tolerances it comes with, which end near the answer, not at it."""

from functools import partial

from .process import answer
from .with_calculix import solve

if __name__ == "__main__":
    answer(partial(solve, controls="", name="default controls"))
