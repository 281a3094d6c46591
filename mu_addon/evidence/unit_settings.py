"""Settings of a unit's simulation for the evidence, and the pressures that are simulated."""

from __future__ import annotations

import math
from collections.abc import Collection

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..meshing.settings import SELF_CONTACT, MeshSettings
from ..run.processes import cores
from .drawn import Designs
from .effects import ON_UNITS
from .unit_body import HELD

# Of the pressures' range: the most that a step to which its ends are rounded may be. The quarter of it that
# rounding may take away lies well within the margin. Steps are 1 and 5 times powers of ten.
ROUND = 0.06
# Fewer pressures make no cubic spline.
FEWEST = 4
DEFAULT = MeshSettings()
# The mesh of what effects change the unit by: of an angle the same share within 2 %.
OF_CHANGES = MeshSettings(refine=0.5)
KNOWN = tuple(name for name, e in ON_UNITS.items() if e.of != HELD)
# A second code with another mesh and another volumetric law, the same unit: its angles are ours at pressures
# changed by 0.047 of the largest one times the square of their share of it.
DISCREPANCY = 0.04


@attrs.frozen
class UnitSettings:
    """Settings of the unit's simulation for the evidence.

    mesh: the model's; changes: a coarser one for effects and walls, whose changes of the response are
    transferred in proportion. The difference of these two is then fitted with every hypothesis (`FARTHER`).
    pressures: their approximate number; margin: beyond the measured ones, as a share of their range. effects:
    names of those to run; whole: those run at every size, None for all; the others are run and trusted at
    `UnitEffect.first` alone. distal: chambers behind a clog. farthest_mm: of a marker from the unit, at scale
    1. discrepancy: of the response, as in `UnitResponse`. self_contact: of walls and struts. designs: units
    that differ in what nobody measured, which is then fitted beside every hypothesis, None without any.
    workers: processes, one a core.
    """

    mesh: MeshSettings = DEFAULT
    changes: MeshSettings = OF_CHANGES
    pressures: int = 12
    margin: float = 0.05
    effects: tuple[str, ...] = KNOWN
    whole: frozenset[str] | None = frozenset()
    distal: int = 1
    farthest_mm: float = 4.0
    discrepancy: float = DISCREPANCY
    self_contact: bool = SELF_CONTACT.field()
    designs: Designs | None = None
    workers: int = attrs.field(factory=cores)

    def further(self, names: Collection[str]) -> UnitSettings | None:
        """With some effects also at the remaining sizes; None where all are."""
        more = frozenset({*ON_UNITS}.intersection(names))
        if self.whole is None or more <= self.whole:
            return None
        return attrs.evolve(self, whole=self.whole | more)

    def __attrs_post_init__(self) -> None:
        for name in self.effects:
            if name not in KNOWN:
                raise InputError(
                    f"the model of the unit has no effect {name!r}",
                    "unit settings",
                    f"known: {', '.join(KNOWN)}",
                )
        if self.pressures < FEWEST or self.workers < 1:
            raise InputError(
                f"{self.pressures} pressures or {self.workers} workers are too few",
                "unit settings",
                f"give {FEWEST} pressures and 1 worker at least",
            )


def pressures(readings_kPa: Array, count: int, margin: float) -> tuple[float, ...]:
    """About `count` pressures in kPa, ascending through 0, from a little below the readings to above.

    margin: beyond the readings, as a share of their range. Raises InputError where all readings are 0.

    >>> pressures(np.array([0.02, 29.98]), 4, 0.05) == pressures(np.array([-0.02, 30.02]), 4, 0.05)
    True
    >>> pressures(np.array([-25.0, 12.46]), 4, 0.05) == pressures(np.array([-25.0, 12.54]), 4, 0.05)
    True
    """
    low, high = min(0.0, float(np.min(readings_kPa))), max(0.0, float(np.max(readings_kPa)))
    if low == high:
        raise InputError("the pressure is always 0", "unit_pressure", "add an experiment under pressure")
    # A gauge's noise moves the ends of a protocol to either side of a round number: its runs stay the same.
    whole = 10.0 ** math.floor(math.log10(ROUND * (high - low)))
    step = 5.0 * whole if 5.0 * whole <= ROUND * (high - low) else whole
    # Protocols end at steps and half way between them: both far from a quarter, where rounding changes.
    low, high = (math.copysign(step * math.floor(abs(end) / step + 0.75), end) for end in (low, high))
    beyond = margin * (high - low)
    low, high = _outward(low, -beyond), _outward(high, beyond)
    below = int(np.clip(round((count - 1) * low / (low - high)), 1, count - 2))
    sides = np.linspace(low, 0.0, below + 1), np.linspace(0.0, high, count - below)
    return tuple(np.concatenate([sides[0][:-1], sides[1]]).tolist())


def _outward(end: float, margin: float) -> float:
    """The end plus the margin, in two digits, so that a longer record finds the same runs.

    In three where two would take most of the margin, as 105 becomes 100.
    """
    found = float(f"{end + margin:.2g}")
    return found if abs(found) > abs(end + margin / 2) else float(f"{end + margin:.3g}")
