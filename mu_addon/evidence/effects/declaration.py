"""What an effect is, declared whole in one file: texts, owner, kinship, laws, and how each law acts.

No list says which effect rivals which: `rivals.py` finds that by what their laws do to the data.

A simulator takes a quantity along its way, from a gauge's reading to a unit's state or from a strain to the
force that is shown, and lets every law of the experiment's kind act at named places on it:

- A unit's pressure in kPa (n,), from the log on: clock, drift, zero, gain, curve, supply, and with an open
  valve leak, line; `modulus`, a factor; from there the pressure at which a unit without memory has that
  state: relaxation, friction, softening. `elements`: shares and times of what relaxes, for a held unit.
- Channels (c, n) of a unit in degrees and mm: swing, surface, read; `view`: a `prediction.camera.View`.
- A specimen: strain (n,); `stiffness`, a factor; law and sign, on stress in kPa of a strain; faces, on a law;
  yielding_strain, yielding, stress_softening, stress_relaxation; `frame`, a compliance and what it takes.
- What a load cell shows, in its unit: filter, cell_curve, cell_gain, cell_drift; `stand`, its compliance.
- A lattice as printed: `printed`, its offset and the excess of its skin in mm. A `beam`: see `BeamSag`.
- A chamber with its valve shut: `gas`, a `prediction.chamber.Chamber`; room, read_gain, read_zero, read_drift
  on its pressure. A waveguide: bent_clock, bent_zero, bend, on its angle; exponent, voltage.
- Of any kind `shown`, on the predicted channels (c, n).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...arrays import Array as Array
from ...measured import Experiment
from ..parameter import Parameter as Parameter
from ..parameter import factor as factor

if TYPE_CHECKING:
    from ..unit_body import UnitEffect


SPECIMEN, BENCH, EITHER, ALL = "specimen", "bench", "either", "all"
"""Who may have an effect alone: a specimen, an experiment or session on a bench, either; or all have it."""
IN_MODEL = "simulate with --model model.toml, which has it"
"""Remedy of physics that a simulation can have."""
CYCLED = ("unit_pressure", "pressure_step")
"""Kinds of a unit that bends freely while a pressure is recorded."""
DRIVEN = (*CYCLED, "blocked_force")
"""Kinds of a unit under a pressure that is recorded over time."""
OF_UNITS = (*DRIVEN, "unit_pose")
MACHINE = ("coupon", "lattice_compression")
"""Kinds in a testing machine."""
CELL = (*MACHINE, "blocked_force")
"""Kinds with a load cell."""


class Setting(SimpleNamespace):
    """What actions may use: `experiment`, `time_s` (n,), and what the simulator of a kind adds.

    Of a unit: largest, the gauge's largest reading in kPa; past, a `PressureHistory`; reference_kPa and
    before_kPa of Mullins softening; channels, rest and recordings; picture_s. Of a specimen: largest, in the
    unit of what the cell shows, and largest_N; kPa_per_N; past, a `StrainHistory`; mode, modulus_kPa and
    strain of its law; that law, and the path of strains (n,) that it takes; strain_per_kPa_mm_N of a frame.
    """


Values = Mapping[str, float]
"""Of a law's parameters, by their names."""
Action = Callable[[Any, Values, Setting], Any]
"""The changed quantity, of that without the effect, values by name of the law's parameters, and a setting."""


@attrs.frozen(kw_only=True)
class Data:
    """What laws are offered for: a kind of experiment, all experiments, and what a simulator knows.

    channels: that are predicted. walls: responses of a unit to walls, each with its side. largest_offset_mm:
    of a lattice's print.
    """

    kind: str
    experiments: Sequence[Experiment] = ()
    channels: Sequence[str] = ()
    walls: Sequence[tuple[int, Any]] = ()
    largest_offset_mm: float = np.inf

    @property
    def own(self) -> list[Experiment]:
        """The experiments of the kind."""
        return [e for e in self.experiments if e.kind == self.kind]

    def largest(self, column: str) -> float:
        """The largest magnitude in a column of the own experiments, in its unit; 0 without any."""
        return largest_reading(column, self.own)


def largest_reading(column: str, experiments: Iterable[Experiment]) -> float:
    """The largest magnitude in a column of experiments, in the column's unit; 0 without any."""
    read = [e[column] for e in experiments if column in e.columns]
    return max((float(np.nanmax(np.abs(v))) for v in read if np.isfinite(v).any()), default=0.0)


@attrs.frozen(eq=False)
class Law:
    """A law of an effect for kinds of experiments: its parameters, the first its size, and how it acts.

    A law acts where its size is not at its null; one without parameters wherever it has a value. mechanism,
    reveals: its own, if not those of the effect. refines: it has more freedom than another one, and is fitted
    only in its place. tried: number of alternatives among which its starts were chosen. offered: the laws, of
    this one and the data, that are fitted to these, with parameters bounded by them; this one by default.
    """

    kinds: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    acts: Mapping[str, Action] = MappingProxyType({})
    mechanism: str = ""
    reveals: str = ""
    refines: bool = False
    tried: int = 1
    offered: Callable[[Law, Data], Iterable[Law]] = lambda law, data: (law,)


@attrs.frozen(kw_only=True, eq=False)
class Declaration:
    """An effect; its name is that of its module.

    mechanism: what it is; reveals: the experiment that separates it from its rivals, shown_by: that for a
    kind of experiment where it is another; remedy: what to do about it; each without a full stop. of: who may
    have it alone. instrument: a fault of what measures or holds, for which no simulation is to blame. camera:
    a fault of the one camera; grips: of what holds a specimen; memory: the specimen remembers its drive;
    level: a record is off as a whole or wanders, as slow noise does; modulus: it multiplies the modulus.

    laws: how it acts. unit: the same on the finite-element model of a unit, as a static effect. differs: law
    in whose size specimens differ, although not all of them can have it. groups: labels of the experiments
    in a testing machine that may have it together, with their names; they have it by the law `differs`.
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
    laws: tuple[Law, ...] = ()
    unit: UnitEffect | None = None
    differs: Law | None = None
    groups: Callable[[Sequence[Experiment]], Mapping[str, Iterable[str]]] | None = None
