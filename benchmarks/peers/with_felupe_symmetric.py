"""felupe with a symmetric factorisation, which its manual does not show: as fast as we could make it."""

from functools import partial

from .process import answer
from .with_felupe import solve

if __name__ == "__main__":
    answer(partial(solve, symmetric=True))
