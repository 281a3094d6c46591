"""The unit by finite elements, as a table of angles and places that `tests/data/blind/unit.npz` holds.

Twice: as the judge has it (the mesh, pressures and sizes of `diagnose`), and as the hidden bench has it, from
another mesh, at pressures and sizes of its own. It is of an earlier model, a homogenised lattice: any smooth
response of a unit serves.
"""

from pathlib import Path

import numpy as np

from mu_addon.evidence.effect import Parameter
from mu_addon.evidence.effects import STATIC as EFFECTS
from mu_addon.evidence.prediction.unit_pressure import UnitResponse, Variant
from mu_addon.evidence.unit_fem import FARTHER

TABLE = Path(__file__).parents[1] / "data" / "blind" / "unit.npz"
CHANNELS = ("angle_deg", *(f"marker{m}_{a}_mm" for m in (1, 2, 3) for a in "yz"))
TURNS = (0.0, 90.0)
JUDGED_kPa = (-18.0, -13.5, -9.0, -4.5, 0.0, *(38.0 * np.arange(1, 8) / 7).tolist())
HIDDEN_kPa = (-18.5, -15.0, -11.0, -7.0, -3.0, 0.0, 3.0, 7.0, 11.5, 16.5, 22.0, 28.0, 34.0, 39.0)
# What the bench may hide in this unit, at sizes of its own; the judge's are those of each effect.
SIZES = {
    "wall_thickness": (0.85, 0.95, 1.1, 1.25),
    "clogged_chamber": (0.15, 0.5, 1.0),
    "gravity": (800.0, 2500.0),
    "overcure": (0.04, 0.11, 0.2),
    "strain_stiffening": (-0.02, 0.05, 0.25, 0.7),
}
# What a mesh of 1.5 times the elements differs by, as `unit_fem` has it beside every hypothesis.
MESH = Parameter("mesh_share", "", -10 * FARTHER, 10 * FARTHER, 0.0, spread=FARTHER)
FINER = "judged mesh_error 1 0"


def table():
    """Angles and places (7, k) of each run, by its name."""
    with np.load(TABLE) as kept:
        return {name: kept[name] for name in kept.files}


def response(runs, turn):
    """The judge's response of the unit in one orientation, from a table's runs."""
    variants = {MESH.name: Variant(MESH, np.array([0.0, 1.0]), np.array([runs["judged"], runs[FINER]]))}
    for name in SIZES:
        effect = EFFECTS[name]
        at = turn if effect.has_gravity else 0.0
        sizes = [
            s for s in effect.sizes if s == effect.parameter.null or f"judged {name} {s:g} {at:g}" in runs
        ]
        values = [runs.get(f"judged {name} {s:g} {at:g}", runs["judged"]) for s in sizes]
        whole = [k for k, v in enumerate(values) if np.isfinite(v).all()]
        if len(whole) > 1:
            variants[name] = Variant(
                effect.parameter, np.array([sizes[k] for k in whole]), np.array([values[k] for k in whole])
            )
    return UnitResponse(CHANNELS, np.array(JUDGED_kPa), runs["judged"], variants, 1.0, turn)
