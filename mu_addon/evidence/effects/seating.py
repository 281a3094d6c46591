"""Seating."""

from collections.abc import Callable

import attrs
import numpy as np

from ..load_cell import LENGTH_mm
from ..unit_body import HELD, UnitEffect
from .declaration import EITHER, MACHINE, Array, Declaration, Law, Parameter, Setting, Values

# A preload needs faces to carry it: it builds up over this share of the gap, so that seating has one size.
ONSET_mm = 0.01
# Strain up to which a preload is sought.
FARTHEST = 0.5
TOE = (
    Parameter("gap_mm", "mm", 0.0, 3.0, 0.0, (0.3,), "rough faces, loose grips: toe of ASTM D695"),
    Parameter("preload_kPa", "kPa", 0.0, 20.0, 0.0, (0.0, 1.0), "machines start at a preload"),
)
Stress = Callable[[Array], Array]


def _closing(law: Stress, v: Values, at: Setting) -> Stress:
    """The law between faces that close, with strain counted from the preload."""
    gap = v["gap_mm"]
    toe = gap / (at.experiment.length_mm or LENGTH_mm * at.experiment.scale)

    def closing(strain: Array) -> Array:
        return law(np.sign(strain) * (np.abs(strain) + toe * np.expm1(-np.abs(strain) / toe)))

    preload = v["preload_kPa"] * min(1.0, gap / ONSET_mm)
    if not preload:
        return closing
    low, high = 0.0, FARTHEST
    for _ in range(3):
        grid = np.linspace(low, high, 200)
        k = int(np.clip(np.searchsorted(closing(grid), preload), 1, len(grid) - 1))
        low, high = grid[k - 1], grid[k]
    below, above = closing(np.array([low, high]))
    zero = low + (high - low) * min(max((preload - below) / (above - below), 0.0), 1.0)
    return lambda strain: closing(strain + zero)


EFFECT = Declaration(
    mechanism="gaps at the specimen's faces close before it carries load",
    reveals="a preload; two specimen lengths",
    remedy="preload the specimen until its faces are in full contact",
    shown_by={
        "blocked_force": "the tip run up to the load cell until it reads, before any pressure",
    },
    of=EITHER,
    instrument=True,
    grips=True,
    laws=(Law(MACHINE, TOE, {"faces": _closing}),),
    # A load cell farther from the tip than stated, in runs of a held tip.
    unit=UnitEffect(
        Parameter("tip_gap_mm", "mm", 0.0, 3.0, 0.0, (0.2, 1.0), "a cell set by eye is off by tenths"),
        (0.0, 0.5, 1.5, 3.0),
        body=lambda body, more_mm: attrs.evolve(body, gap_mm=(body.gap_mm or 0.0) + more_mm),
        length=1,
        larger=(4.5,),
        first=(1.5,),
        of=HELD,
    ),
)
