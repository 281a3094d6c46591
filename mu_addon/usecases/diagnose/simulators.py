"""Simulators of the experiments that measured data hold."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...design.parameters import Unit
from ...evidence.prediction import lattice
from ...evidence.prediction import unit as unit_pressure
from ...evidence.prediction.bench import bench_simulators
from ...evidence.simulator import Simulator
from ...measured import Experiment
from ...run.progress import Progress

if TYPE_CHECKING:
    from ...evidence.unit_fem import UnitSettings


def simulators_of(
    experiments: Sequence[Experiment],
    unit: Unit | None,
    cache: Path,
    progress: Progress,
    settings: UnitSettings | None = None,
) -> tuple[dict[str, Simulator], list[str]]:
    """Simulators of every kind among the experiments, by kind; and what could not be simulated, in words.

    The unit is followed by finite elements, and so are blocks of its lattice; the runs are kept in the
    folder `cache`. What was taken for granted is among the words.
    """
    remarks: list[str] = []
    scalings: Mapping[str, lattice.Scaling] = {}
    if any(e.cells for e in experiments):
        assert unit is not None
        from ...evidence.lattice_fem import scalings as computed

        with progress.stage("lattice"):
            scalings, remarks = computed(experiments, unit, cache, lambda _, share: progress.update(share))
    found = bench_simulators(experiments, scalings)
    bent = [e for e in experiments if e.kind == unit_pressure.KIND]
    if bent:
        assert unit is not None
        from ...evidence.unit_fem import unit_responses

        with warnings.catch_warnings(record=True) as caught, progress.stage("unit"):
            warnings.simplefilter("always")
            responses = unit_responses(unit, bent, settings, cache, lambda _, share: progress.update(share))
        # Where and what to do, on further lines, is of a simulation that nobody asked for.
        left_out = [str(warning.message).partition("\n")[0] for warning in caught]
        for words in left_out:
            progress.warning(words, "unit")
        remarks += left_out
        found[unit_pressure.KIND] = unit_pressure.UnitPressure(responses, experiments)
    return found, remarks
