"""Errors a user can act on: what happened, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterable


class MuError(Exception):
    """A failure described by `what`, `where` and `remedy`; `status` is the exit status of its run."""

    status = 1

    def __init__(self, what: str, where: str = "", remedy: str = "") -> None:
        super().__init__(what, where, remedy)
        self.what = what
        self.where = where
        self.remedy = remedy

    def __str__(self) -> str:
        parts = [self.what]
        if self.where:
            parts.append(f"where: {self.where}")
        if self.remedy:
            parts.append(f"what to do: {self.remedy}")
        return "\n  ".join(parts)


class InputError(MuError):
    """A parameter, file or argument that cannot be used."""

    status = 2


class MeshingError(MuError):
    """A geometry that no mesher here could turn into valid tetrahedra."""

    status = 3


class ConvergenceError(MuError):
    """An equilibrium was not found; no result that depends on it may be reported."""

    status = 4


class OutputError(MuError):
    """A result that could not be written."""

    status = 5


def did_you_mean(name: str, names: Iterable[str], alike: float = 0.6) -> str:
    """`; did you mean x?` for the most similar of the names, "" where none is similar.

    alike: least similarity of a suggestion, from 0 to 1.
    """
    # Imported late: only a message needs it.
    from difflib import get_close_matches

    close = get_close_matches(name, list(names), 1, alike)
    return f"; did you mean {close[0]!r}?" if close else ""
