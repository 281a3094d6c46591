"""The unit by finite elements for the battery: `python -m tests.blind.unit_runs CACHE` makes its table again.

Twice: as the judge has it (the mesh, pressures and sizes of `diagnose`), and as the hidden bench has it, from
another mesh, at pressures and sizes of its own. What is kept of it is a table of angles and places, which
`tests/data/blind/unit.npz` holds; the one there is of an earlier model, a homogenised lattice: any smooth
response of a unit serves.
"""

import sys
from pathlib import Path

import attrs
import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.evidence.effects import STATIC as EFFECTS
from mu_addon.evidence.prediction.unit_pressure import UnitResponse, Variant
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_fem import FINER, Run, run
from mu_addon.files import read_npz, write_npz
from mu_addon.meshing.settings import MeshSettings

TABLE = Path(__file__).parents[1] / "data" / "blind" / "unit.npz"
# On the side of the unit and on its tip, in mm.
POINTS = ((18.75, 10.0, 30.0), (18.75, 10.0, 55.0), (0.0, 5.0, 75.0))
CHANNELS = ("angle_deg", *(f"marker{m}_{a}_mm" for m in (1, 2, 3) for a in "yz"))
# Rows of a run that are seen: the angle, y and z of each point.
ROWS = [0, 3, 4, 6, 7, 9, 10]
TURNS = (0.0, 90.0)
JUDGED_kPa = (-18.0, -13.5, -9.0, -4.5, 0.0, *(38.0 * np.arange(1, 8) / 7).tolist())
HIDDEN_kPa = (-18.5, -15.0, -11.0, -7.0, -3.0, 0.0, 3.0, 7.0, 11.5, 16.5, 22.0, 28.0, 34.0, 39.0)
JUDGED_MESH, HIDDEN_MESH = MeshSettings(), MeshSettings(refine=1.25)
# What the bench may hide in this unit, at sizes of its own; the judge's are those of each effect.
SIZES = {
    "wall_thickness": (0.85, 0.95, 1.1, 1.25),
    "clogged_chamber": (0.15, 0.5, 1.0),
    "gravity": (800.0, 2500.0),
    "overcure": (0.04, 0.11, 0.2),
    "strain_stiffening": (-0.02, 0.05, 0.25, 0.7),
}
# What the judge knows of this unit.
JUDGED = ("mesh_error", *SIZES)


def runs():
    """(name in the table, what is to be run) of every run, what matters most first."""
    unit = load_preset("mu-1.0x")
    judged, hidden = Body(unit, JUDGED_MESH, FINER), Body(unit, HIDDEN_MESH, HIDDEN_MESH)
    yield "judged", Run(judged, JUDGED_kPa, POINTS)
    yield "hidden", Run(hidden, HIDDEN_kPa, POINTS)
    for name in JUDGED:
        for turn in TURNS if EFFECTS[name].has_gravity else (0.0,):
            for size in EFFECTS[name].sizes:
                if size != EFFECTS[name].parameter.null:
                    body = attrs.evolve(judged, orientation_deg=turn)
                    yield f"judged {name} {size:g} {turn:g}", Run(body, JUDGED_kPa, POINTS, name, size)
            for size in SIZES.get(name, ()):
                body = attrs.evolve(hidden, orientation_deg=turn)
                yield f"hidden {name} {size:g} {turn:g}", Run(body, HIDDEN_kPa, POINTS, name, size)


def make(cache):
    """Compute what the cache lacks, and write the table of what is there."""
    table = {}
    for name, case in runs():
        path = Path(cache) / f"{case.key()}.npz"
        kept = read_npz(path)
        if kept is None:
            found = run(case)
            if found.why:
                print(f"{name}: {found.why}", flush=True)
            kept = {"values": found.values[ROWS]}
            write_npz(path, kept)
        table[name] = kept["values"]
        print(name, flush=True)
        # As soon as there is something to judge; later runs add to it.
        write_npz(TABLE, table)


def table():
    """Angles and places (7, k) of each run, by its name."""
    with np.load(TABLE) as kept:
        return {name: kept[name] for name in kept.files}


def response(runs, turn):
    """The judge's response of the unit in one orientation, from a table's runs."""
    variants = {}
    for name in JUDGED:
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


if __name__ == "__main__":
    make(sys.argv[1])
