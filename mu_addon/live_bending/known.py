"""Bent shapes that were found before: shown at once, while that of the present unit is computed.

A shape is a folder with the motion of its surfaces, the unit's file and bent.json, the answer that it came
with (`requests`). Units that differ in size and stiffness alone bend alike: lengths go with the scale,
pressures with the wall's modulus.
"""

from __future__ import annotations

import math
import shutil
from functools import lru_cache
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.parameters import SECTIONS, Unit, Waveguide, read_unit, write_unit
from ..design.quantity import describe
from ..errors import InputError
from ..files import write_json, write_npz
from ..reading import file_bytes, parse_json
from ..report.motion_files import FOLDER, MODEL_A, Motion, read_motion

UNIT, ANSWER = "unit.toml", "bent.json"
KEPT = 20
"""Number of shapes that are kept, the latest."""
_UNFELT = ("lattice_modulus_kPa", "elongation_at_break", "allow_symmetric")
"""Parameters that bend nothing, as those of the waveguide, which is not there."""


@attrs.frozen(eq=False)
class Known:
    """A shape that was found before, in the size and at the pressures of the unit that was asked for.

    answer: as it was, its pressures likewise; same: True if it is that unit's own.
    """

    motion: Motion
    answer: dict[str, Any]
    same: bool


def keep(motion: Motion, answer: dict[str, Any], unit: Unit, shapes: Path) -> None:
    """Keep a unit's shape in the folder `shapes`, in place of an earlier one; raises OutputError."""
    place = shapes / attrs.evolve(unit, name="unit").hash()[:16]
    shutil.rmtree(place, ignore_errors=True)
    nodes = np.unique(np.concatenate([surface.node for surface in motion.surfaces.values()]))
    arrays = {"nodes": _short(motion.mesh.nodes[nodes]), "symmetry": np.array(motion.mesh.symmetry, "U1")}
    arrays |= {name: np.zeros((0, 10), np.int32) for name in ("tets", "cavity")}
    arrays |= {name: np.zeros(0, np.int32) for name in ("region", "base", "tip")}
    moved = {name: getattr(motion, name) for name in ("time_s", "pressure_kPa", "state", "state_kPa")}
    moved["displacement_mm"] = _short(motion.model_a[:, nodes])
    for region, surface in motion.surfaces.items():
        arrays[f"{region}_node"] = np.searchsorted(nodes, surface.node)
        arrays |= {f"{region}_triangles": surface.triangles, f"{region}_cut": surface.cut}
        moved |= {f"{region}_{name}": values for name, values in motion.fields[region].items()}
    write_npz(place / FOLDER / "mesh.npz", arrays)
    write_npz(place / FOLDER / f"{MODEL_A}.npz", moved)
    write_json(place / ANSWER, answer)
    # Last: a shape without its unit is none.
    write_unit(unit, place / UNIT)
    latest = sorted(shapes.glob(f"*/{UNIT}"), key=lambda path: path.stat().st_mtime)
    for path in latest[:-KEPT]:
        shutil.rmtree(path.parent, ignore_errors=True)


def _short(lengths_mm: Any) -> Any:
    """Lengths to 0.002 mm, whose last digits a packed file does not hold."""
    return np.ldexp(np.round(np.ldexp(lengths_mm, 9)), -9).astype(np.float32)


def nearest(unit: Unit, *shapes: Path) -> Known | None:
    """The shape in folders of shapes that comes from the unit most like this one; None without any.

    Units of other numbers of chambers are not alike.
    """
    files = [path for folder in shapes for path in folder.glob(f"*/{UNIT}")]
    try:
        found = [(_apart(unit, _unit_in(path, path.stat().st_mtime_ns)), path) for path in files]
        apart, path = min(found, default=(math.inf, Path()))
        if math.isinf(apart):
            return None
        of, motion = read_unit(path), read_motion(path.parent)
        answer: dict[str, Any] = parse_json(file_bytes(path.with_name(ANSWER)), ANSWER)
    except (OSError, InputError):
        return None  # one of them is being replaced
    longer, stiffer = (
        unit.scale / of.scale,
        unit.material.membrane_modulus_kPa / of.material.membrane_modulus_kPa,
    )
    motion = attrs.evolve(
        motion,
        mesh=attrs.evolve(motion.mesh, nodes=longer * motion.mesh.nodes),
        model_a=np.float32(longer) * motion.model_a,
        state_kPa=stiffer * motion.state_kPa,
        pressure_kPa=stiffer * motion.pressure_kPa,
        fields={
            region: {name: stiffer ** name.endswith("_kPa") * values for name, values in fields.items()}
            for region, fields in motion.fields.items()
        },
    )
    states = [[stiffer * kPa, angle] for kPa, angle in answer["states"]]
    return Known(motion, answer | {"states": states}, apart < 1e-6)


@lru_cache(maxsize=64)
def _unit_in(path: Path, changed_ns: int) -> Unit:
    return read_unit(path)


def _apart(one: Unit, other: Unit) -> float:
    """0 for units that bend alike; else the sum of the parameters' differences, infinite for other chambers.

    A number counts by the logarithm of its ratio, anything else as 1.
    """
    if other.chambers.count != one.chambers.count:
        return math.inf
    apart = 0.0
    for section in SECTIONS:
        for d in describe(section) if section is not Waveguide else ():
            if d.name in (*_UNFELT, "membrane_modulus_kPa"):
                continue
            a, b = (getattr(getattr(unit, getattr(section, "section", "")), d.name) for unit in (one, other))
            if d.fixed:
                a, b = a / one.scale, b / other.scale
            if a != b:
                apart += abs(math.log(a / b)) if d.type is float and a * b > 0 else 1.0
    return apart
