"""Everything a bench measures beside the unit: which class predicts which kind."""

from __future__ import annotations

from collections.abc import Sequence

from ...measured import Experiment
from ..simulator import Simulator
from . import beam, coupon, hold, lattice, waveguide


def bench_simulators(
    experiments: Sequence[Experiment], scaling: lattice.Scaling | None = None
) -> dict[str, Simulator]:
    """Simulators of the kinds among the experiments, by kind; of a unit under pressure there is none here.

    scaling: of the printed lattice, a power law of slender struts where none is given.
    """
    every: dict[str, Simulator] = {
        beam.KIND: beam.BeamSag(),
        coupon.KIND: coupon.CouponStress(experiments),
        hold.KIND: hold.ChamberPressure(experiments),
        lattice.KIND: lattice.LatticeStress(experiments, scaling),
        waveguide.KIND: waveguide.WaveguideVoltage(),
    }
    kinds = {e.kind for e in experiments}
    return {kind: simulator for kind, simulator in every.items() if kind in kinds}
