"""Simulators of the experiments in measured data."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ..design.parameters import Unit
from ..errors import InputError
from ..measured import Experiment
from ..measured.kinds import OF_A_UNIT
from ..run.progress_estimate import Plan
from .drawn import LEADING, ROUNDS
from .prediction import blocked_force, pressure_step, unit_pose, unit_pressure
from .simulator import Simulator

if TYPE_CHECKING:
    from .unit_settings import UnitSettings

LATTICE = "lattice"
LATTICE_S, UNIT_S = 90.0, 24.0
"""Seconds of the simulation of a block, and of a unit of one chamber."""
BY_CHAMBERS = 1.6
"""Power of their number by which a unit's seconds grow: measured with three and six."""
BASE = "unit"
"""Stage of a unit that bends freely."""
HELD = "unit with its tip held"
"""Stage of a unit on a load cell."""
DESIGNS, DESIGN_S = "unit of every design", 90.0
"""Stage of units with other values of unknown parameters, and the seconds of one of them."""
TOUCHING_KPA, TOUCHING = -8.0, 2.0
"""Reading below which walls of a unit may touch, and the factor on its seconds then."""
# Kinds of a unit that bends freely, by what predicts them.
FREE: dict[str, Callable[..., Simulator]] = {
    unit_pressure.KIND: unit_pressure.UnitPressure,
    pressure_step.KIND: pressure_step.PressureStep,
    unit_pose.KIND: unit_pose.UnitPose,
}
HELD_TIP: dict[str, Callable[..., Simulator]] = {blocked_force.KIND: blocked_force.BlockedForce}


def simulations_plan(experiments: Sequence[Experiment], behind: Unit | None, settings: UnitSettings) -> Plan:
    """Stages of `simulators_of` with the expected seconds of each on two cores."""
    kinds = {e.kind for e in experiments}
    lowest = min((float(e["pressure_kPa"].min()) for e in experiments if e.kind in OF_A_UNIT), default=0.0)
    chambers = behind.chambers.count if behind else 1
    unit = UNIT_S * chambers**BY_CHAMBERS * (TOUCHING if lowest < TOUCHING_KPA else 1.0)
    lattice = []
    if any(e.cells for e in experiments) and behind is not None:
        from .lattice_fem import to_compute

        # What is wrong with a block is told by the stage itself.
        with suppress(InputError):
            lattice = [(LATTICE, 0.2 + LATTICE_S * to_compute(experiments, behind))]
    free = [(BASE, unit)] if kinds & set(FREE) else []
    if settings.designs:
        # The unit as given is simulated anyway.
        simulated = len(settings.designs.units) - 1 + ROUNDS * LEADING
        free.append((DESIGNS, DESIGN_S * simulated))
    return [*lattice, *free, *([(HELD, unit)] if blocked_force.KIND in kinds else [])]


def bending_freely(experiments: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """Experiments on a unit that its simulation without weight and without a held tip predicts."""
    return tuple(e for e in experiments if e.kind in (unit_pressure.KIND, pressure_step.KIND))


def of_a_unit(
    experiments: Sequence[Experiment],
    unit: Unit,
    cache: Path,
    progress: Callable[[float], None],
    settings: UnitSettings | None = None,
    held: bool = False,
) -> tuple[dict[str, Simulator], list[str]]:
    """Simulators of experiments on a unit that bends freely, or with its tip held, by kind.

    Also the reasons why effects could not be simulated. progress: called with the share done.
    """
    from .unit_fem import unit_responses

    def share(_: str, done: float) -> None:
        progress(done)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        responses = unit_responses(unit, experiments, settings, cache, share, held)
        kinds = {e.kind for e in experiments}
        made = (HELD_TIP if held else FREE).items()
        found = {kind: predicts(responses, experiments) for kind, predicts in made if kind in kinds}
    # Location and remedy on further lines belong to a simulation that nobody asked for.
    return found, [*dict.fromkeys(str(warning.message).partition("\n")[0] for warning in caught)]
