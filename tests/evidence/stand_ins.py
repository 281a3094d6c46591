"""Small simulators for what the unit's cannot show: a dead load, and three moduli."""

import math
from pathlib import Path

import numpy as np

from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.prediction.unit_pressure import nuisances
from mu_addon.measured import Experiment


class DeadLoad:
    """A beam of the unit's resin: its sag tells the modulus, whatever a gauge of pressure says."""

    nuisances = nuisances(())
    effects = ()

    def channels(self, experiment):
        return ("tip_deflection_mm",)

    def predict(self, experiment, values):
        return 0.4 * experiment["added_mass_g"][None] / values.get("modulus_factor", 1.0)


class Moduli:
    """Compressed lattices of several scales: one modulus, times what brings a length, a time or a force."""

    nuisances = (Parameter("modulus_kPa", "kPa", 1.0, 1000.0, 20.0, (20.0,), "resin and lattice"),)
    effects = tuple(
        Effect(name, (Parameter(p, unit, 0.0, high, 0.0, (start,), "stand-in"),), ("lattice_compression",))
        for name, p, unit, high, start in (
            ("overcure", "offset_mm", "mm", 1.0, 0.1),
            ("skin_cure", "depth_share", "", 5.0, 0.3),
            ("frame_compliance", "share", "", 5.0, 0.3),
            ("seating", "gap_strain", "", 0.01, 0.001),
            ("anisotropy", "share", "", 1.0, 0.1),
        )
    )

    def channels(self, experiment):
        return ("stress_kPa",)

    def predict(self, experiment, values):
        s = experiment.scale
        modulus = values.get("modulus_kPa", 20.0)
        # Bending struts: to the fourth power of their diameter, 1.5 mm at scale 1.
        modulus *= (1.0 + values.get("overcure.offset_mm", 0.0) / (1.5 * s)) ** 4
        modulus *= 1.0 + values.get("skin_cure.depth_share", 0.0) / s
        modulus /= 1.0 + values.get("frame_compliance.share", 0.0) * s
        modulus *= 1.0 + values.get("anisotropy.share", 0.0) * (experiment.axis == "z")
        gap = values.get("seating.gap_strain", 0.0)
        return modulus * np.maximum(experiment["strain"] - gap, 0.0)[None]


def made(name, kind, columns, **more):
    """An experiment in memory."""
    n = len(next(iter(columns.values())))
    fields = {"role": "fit", "temperature_C": math.nan} | more
    return Experiment(
        name=name,
        kind=kind,
        file=Path(f"{name}.csv"),
        columns=columns,
        rows=np.arange(n) + 2,
        sha256=name,
        **fields,
    )


def three_moduli(moduli=(21.70, 18.34, 16.38), spreads=(0.35, 1.86, 1.21)):
    """The paper's moduli in kPa at its three scales, with their spreads, as straight lines to 10 %."""
    strain = np.linspace(0.0, 0.1, 6)
    return [
        made(
            f"{scale:g}x",
            "lattice_compression",
            {"strain": strain, "stress_kPa": e * strain, "stress_sd_kPa": sd * strain},
            scale=scale,
        )
        for scale, e, sd in zip((0.75, 1.0, 1.5), moduli, spreads, strict=True)
    ]
