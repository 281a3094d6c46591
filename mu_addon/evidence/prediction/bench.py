"""Experiments on a bench other than with the unit: the class that predicts each kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from ...measured import Experiment
from ..simulator import Simulator
from . import beam_deadweight, coupon, lattice_compression, pressure_hold, waveguide_bending


def bench_simulators(
    experiments: Sequence[Experiment],
    scalings: Mapping[str, lattice_compression.Scaling] = MappingProxyType({}),
) -> dict[str, Simulator]:
    """Simulators of the kinds among the experiments, by kind; unit_pressure has none here.

    scalings: response of printed lattices to printing, by name of the experiment; a power law of slender
    struts where none is given.
    """
    every: dict[str, Simulator] = {
        beam_deadweight.KIND: beam_deadweight.BeamSag(),
        coupon.KIND: coupon.CouponStress(experiments),
        pressure_hold.KIND: pressure_hold.ChamberPressure(experiments),
        lattice_compression.KIND: lattice_compression.LatticeStress(experiments, scalings),
        waveguide_bending.KIND: waveguide_bending.WaveguideVoltage(),
    }
    kinds = {e.kind for e in experiments}
    return {kind: simulator for kind, simulator in every.items() if kind in kinds}
