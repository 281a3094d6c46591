"""Declarations of the material laws, read from the source of `fem/laws`: no law and no solver is loaded.

A law's class states them as literals, which `fem.laws.law.Law` explains. Files, options and panels know a law
as soon as its file lies in that folder.
"""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import InputError
from ..reading import file_text

FOLDER = Path(__file__).resolve().parents[1] / "fem" / "laws"


class DeclaredLaw(NamedTuple):
    """What the class of a law declares; the fields are those of `Law`. memory: it has a `history`."""

    name: str
    memory: bool
    wall: str | None = None
    wall_text: str = ""
    wall_total: tuple[Any, ...] = ()
    builds_on: str = ""
    fitted: tuple[tuple[Any, ...], ...] = ()
    terms: int = 0

    @property
    def key(self) -> str:
        """The law's name in files and options."""
        return self.name.lower()

    @property
    def parameters(self) -> dict[str, tuple[Any, ...]]:
        """Arguments of `quantity` for each parameter in [wall] of its own. Raises InputError."""
        found = {}
        for line in filter(str.strip, (self.wall or "").splitlines()):
            try:
                name, default, unit, bounds, text, source = map(str.strip, line.split("|"))
                low, high = map(float, bounds.split(" to "))
                found[name] = (float(default), unit, low, high, text, source)
            except ValueError as error:
                remedy = "write name | default | unit | bounds | meaning | source"
                raise InputError(f"{line.strip()!r} declares no parameter", self.name, remedy) from error
        return found

    @property
    def forms(self) -> dict[str, int]:
        """Number of fitted parameters of each form in which the law can be fitted, by the form's name."""
        if self.terms:
            return {f"{self.key}-{n}": 2 * n for n in range(1, self.terms + 1)}
        return {self.key: len(self.fitted)} if self.fitted else {}


@cache
def declared_laws() -> dict[str, DeclaredLaw]:
    """Every law by its name in files: first those without memory, each group in alphabetical order.

    Raises InputError for a declaration that is not a literal, and a name that is declared twice.
    """
    every = [law for path in sorted(FOLDER.glob("*.py")) for law in _laws_of(path)]
    names = [law.key for law in every] + [name for law in every for name in law.parameters]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two laws declare {name!r}", str(FOLDER), "choose another name")
    return {law.key: law for law in sorted(every, key=lambda law: (law.memory, law.key))}


@cache
def wall_laws() -> dict[str, DeclaredLaw]:
    """The laws that a unit's wall may have, by name in files, in the order of `declared_laws`."""
    return {key: law for key, law in declared_laws().items() if law.wall is not None}


@cache
def wall_parameters(key: str) -> tuple[str, ...]:
    """Names of the parameters in [wall] of a law, by its name in files; of what it builds on first."""
    law = wall_laws()[key]
    own = tuple(law.parameters)
    return (*wall_parameters(law.builds_on.lower()), *own) if law.builds_on else own


def form_names() -> tuple[str, ...]:
    """Names of the forms that `fit-material` fits: exponents last, then by number of parameters."""
    laws = declared_laws().values()
    every = [(law.terms, count, name) for law in laws for name, count in law.forms.items()]
    return tuple(name for *_, name in sorted(every))


def _laws_of(path: Path) -> list[DeclaredLaw]:
    """The laws of a file: its classes whose base is `Law`."""
    # From the first class on, at its line: Warp's functions before it would take most of the time.
    before, start, after = file_text(path).partition("\nclass ")
    found = []
    for node in ast.parse("\n" * before.count("\n") + start + after).body if start else ():
        if not (isinstance(node, ast.ClassDef) and "Law" in [getattr(base, "id", "") for base in node.bases]):
            continue
        stated = {getattr(s.targets[0], "id", ""): s for s in node.body if isinstance(s, ast.Assign)}
        values: dict[str, Any] = {"memory": "history" in stated}
        for name in DeclaredLaw._fields:
            if name in stated:
                try:
                    values[name] = ast.literal_eval(stated[name].value)
                except ValueError as error:
                    where = f"{path.name}, line {stated[name].lineno}, {node.name}.{name}"
                    remedy = "write texts, numbers and tuples only: it is read without running the file"
                    raise InputError("a law's declaration is not a literal", where, remedy) from error
        found.append(DeclaredLaw(**values))
    return found
