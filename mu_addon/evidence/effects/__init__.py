"""Effects that a model may lack, one a file: `DECLARED` holds every module's `EFFECT` by its name."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from .declaration import BENCH, Declaration, Law, Setting

DECLARED: dict[str, Declaration] = {
    m.name: import_module(f".{m.name}", __name__).EFFECT
    for m in iter_modules(__path__)
    if m.name != "declaration"
}


def having(trait: str) -> frozenset[str]:
    """Names of the effects of which a flag of `Declaration` is true, such as "camera"."""
    return frozenset(name for name, e in DECLARED.items() if getattr(e, trait))


CAMERA, GRIPS, MEMORY, LEVEL, MODULI = map(having, ("camera", "grips", "memory", "level", "modulus"))
ON_UNITS = {name: e.unit for name, e in DECLARED.items() if e.unit}
"""Static effects of the finite-element model of a unit, with those of walls and of a held tip."""
STATIC = {name: e for name, e in ON_UNITS.items() if not e.of}
"""Those of a unit wherever it is."""
LOADS = frozenset(name for name, e in STATIC.items() if e.load)
"""Those that are dead loads, which bend a stiffer unit less in proportion."""


@cache
def laws_of(kind: str) -> dict[str, tuple[Law, ...]]:
    """Laws for a kind of experiment by the name of their effect, those of a bench last.

    Of explanations that do equally well the first is taken: a specimen's before its bench's.
    """
    found = {}
    for name, e in sorted(DECLARED.items(), key=lambda item: item[1].of == BENCH):
        every = (*e.laws, *([e.differs] if e.differs else []))
        if own := tuple(law for law in every if kind in law.kinds):
            found[name] = own
    return found


def places(kind: str, name: str) -> frozenset[str]:
    """Places at which an effect acts on experiments of a kind."""
    return frozenset(place for law in laws_of(kind).get(name, ()) for place in law.acts)


class Acting:
    """The effects that act on an experiment of a kind with values by "effect.parameter"."""

    def __init__(self, kind: str, values: Mapping[str, float], setting: Setting) -> None:
        self.setting = setting
        own: dict[str, dict[str, float]] = {}
        for key, value in values.items():
            name, dot, parameter = key.partition(".")
            if dot:
                own.setdefault(name, {})[parameter] = value
        self._at: dict[str, list[tuple[Any, dict[str, float]]]] = {}
        self._names: dict[str, list[Hashable]] = {}
        for name, laws in laws_of(kind).items():
            for law in laws if name in own else ():
                given = own[name]
                if law.parameters:
                    size = law.parameters[0]
                    if given.get(size.name, size.null) == size.null:
                        continue
                    given = {p.name: p.null for p in law.parameters} | given
                for place, action in law.acts.items():
                    self._at.setdefault(place, []).append((action, given))
                    self._names.setdefault(place, []).append((name, tuple(given.items())))

    def along(self, quantity: Any, *places: str) -> Any:
        """The quantity after all that acts on it at these places, in their order."""
        for place in places:
            for action, values in self._at.get(place, ()):
                quantity = action(quantity, values, self.setting)
        return quantity

    def at(self, *places: str) -> tuple[Hashable, ...]:
        """What acts at these places, with its values; empty if nothing does."""
        return tuple(one for place in places for one in self._names.get(place, ()))
