"""What an effect is, declared whole in one file: texts, owner, kinship, laws, and how it acts on readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ...measured import Experiment
from ..parameter import Parameter

Array = np.ndarray[Any, Any]
# Changed readings (n,) of an experiment, from those without the effect, in their unit. Values are by name of
# the effect's parameters; the last argument is the largest reading of that kind among the data, 0 if unknown.
Action = Callable[[Experiment, Array, Mapping[str, float], float], Array]

SPECIMEN, BENCH, EITHER, ALL = "specimen", "bench", "either", "all"
"""Who may have an effect alone: a specimen, an experiment or session on a bench, either; or all have it."""
IN_MODEL = "simulate with --model model.toml, which has it"
"""Remedy of physics that a simulation can have."""


def _no_laws(kind: str, experiments: Sequence[Experiment]) -> tuple[tuple[Parameter, ...], ...]:
    return ()


@attrs.frozen(kw_only=True, eq=False)
class Declaration:
    """An effect; its name is that of its module.

    mechanism: what it is; reveals: the experiment that separates it from its rivals, shown_by: that for a
    kind of experiment where it is another; remedy: what to do about it; each without a full stop. of: who may
    have it alone. instrument: a fault of what measures or holds, for which no simulation is to blame. camera:
    a fault of the one camera; grips: of what holds a specimen; memory: the specimen remembers its drive;
    level: a record is off as a whole or wanders, as slow noise does; modulus: it multiplies the modulus.

    laws: parameters of its laws for a kind of experiment, given all experiments; none by default, for an
    effect that a simulator in `prediction` has. How it acts: pressure, on that of a unit behind its gauge, in
    kPa; strain, on that of a specimen; reading, on the first predicted channel, as the instrument shows it.
    """

    mechanism: str
    reveals: str
    remedy: str
    shown_by: Mapping[str, str] = MappingProxyType({})
    of: str = SPECIMEN
    instrument: bool = False
    camera: bool = False
    grips: bool = False
    memory: bool = False
    level: bool = False
    modulus: bool = False
    laws: Callable[[str, Sequence[Experiment]], tuple[tuple[Parameter, ...], ...]] = _no_laws
    pressure: Action | None = None
    strain: Action | None = None
    reading: Action | None = None
