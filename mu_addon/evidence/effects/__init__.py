"""Effects that a model may lack, one a file: `DECLARED` holds every module's `EFFECT` by its name."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import numpy as np

from ...measured import Experiment
from ..parameter import OF
from .declaration import Declaration

Array = np.ndarray[Any, Any]

DECLARED: dict[str, Declaration] = {
    m.name: import_module(f".{m.name}", __name__).EFFECT
    for m in iter_modules(__path__)
    if m.name != "declaration"
}


def having(trait: str) -> frozenset[str]:
    """Names of the effects of which a flag of `Declaration` is true, such as "camera"."""
    return frozenset(name for name, e in DECLARED.items() if getattr(e, trait))


CAMERA, GRIPS, MEMORY, LEVEL, MODULI = map(having, ("camera", "grips", "memory", "level", "modulus"))


def acted(
    on: str, experiment: Experiment, readings: Array, values: Mapping[str, float], largest: float = 0.0
) -> Array:
    """Readings (n,) of an experiment, in their unit, with the effects that act on them.

    on: "pressure", "strain" or "reading", see `Declaration`. values: by "effect.parameter". largest: reading
    of that kind among the data.
    """
    for name in _ACTING[on]:
        start = f"{name}."
        own = {k.removeprefix(start): v for k, v in values.items() if k.startswith(start) and OF not in k}
        if own:
            readings = getattr(DECLARED[name], on)(experiment, readings, own, largest)
    return readings


_ACTING = {on: [n for n, e in DECLARED.items() if getattr(e, on)] for on in ("pressure", "strain", "reading")}
