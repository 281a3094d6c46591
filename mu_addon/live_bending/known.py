"""Bent shapes that were found before: shown at once, while that of the present unit is computed.

A shape is a folder with the motion of its surfaces, the unit's file and bent.json, the answer that it came
with (`requests`). Units that differ in size and stiffness alone bend alike: lengths go with the scale,
pressures with the wall's modulus. With more or fewer chambers each bends about as before.
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
from ..report.motion_files import FOLDER, MODEL_A, Motion, Surface, read_motion

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
    """The shape in folders of shapes that comes from the unit most like this one; None without any."""
    files = [path for folder in shapes for path in folder.glob(f"*/{UNIT}")]
    try:
        found = [(_apart(unit, _unit_in(path, path.stat().st_mtime_ns)), path) for path in files]
        if not found:
            return None
        apart, path = min(found)
        of, motion = read_unit(path), read_motion(path.parent)
        answer: dict[str, Any] = parse_json(file_bytes(path.with_name(ANSWER)), ANSWER)
    except (OSError, InputError):
        return None  # one of them is being replaced
    longer, stiffer = (
        unit.scale / of.scale,
        unit.material.membrane_modulus_kPa / of.material.membrane_modulus_kPa,
    )
    count, had = unit.chambers.count, of.chambers.count
    if count != had:
        motion = with_chambers(motion, of.printed.cell, had, count)
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
    states = [[stiffer * kPa, angle * (count / had)] for kPa, angle in answer["states"]]
    return Known(motion, answer | {"states": states}, apart < 1e-6)


def with_chambers(motion: Motion, pitch_mm: float, had: int, count: int) -> Motion:
    """The motion of a unit of other length: chambers in the middle of `had` are left out or repeated.

    Each deforms as the one that it is taken from, on the section at which the one below it ends.
    """
    nodes = motion.mesh.nodes
    moved = nodes + motion.model_a
    lower = min(had, count) // 2
    taken = [*range(lower), *[lower] * max(count - had, 0), *range(had - min(had, count) + lower, had)]
    sections = [_section(nodes, moved, pitch_mm * k) for k in range(had + 1)]
    steps, below = [], np.eye(3)
    for number, source in enumerate(taken):
        # In the bending plane, y and z: rigid motions as homogeneous matrices.
        up = np.eye(3)
        up[1, 2] = pitch_mm * (number - source)
        placed = below @ up @ np.linalg.inv(sections[source])
        below = placed @ sections[source + 1] @ np.linalg.inv(up)
        steps.append((source, up[1, 2], placed))
    rest: list[Any] = []
    turned, surfaces, fields = [], {}, {}
    for region, surface in motion.surfaces.items():
        chamber = np.clip(nodes[surface.node[surface.triangles], 2].mean(axis=1) // pitch_mm, 0, had - 1)
        kept: list[Any] = []
        faces, cut = [], []
        for source, higher, placed in steps:
            own = chamber == source
            vertices, triangles = np.unique(surface.triangles[own], return_inverse=True)
            faces.append(sum(map(len, kept)) + triangles.reshape(-1, 3))
            cut.append(surface.cut[own])
            kept.append(vertices)
            at = surface.node[vertices]
            rest.append(nodes[at] + [0.0, 0.0, higher])
            flat = moved[:, at, 1:] @ placed[:, :2, :2].swapaxes(1, 2) + placed[:, None, :2, 2]
            turned.append(np.dstack([moved[:, at, :1], flat]))
        every = np.concatenate(kept)
        node = sum(map(len, rest)) - len(every) + np.arange(len(every))
        surfaces[region] = Surface(node, np.concatenate(faces), np.concatenate(cut))
        fields[region] = {name: values[:, every] for name, values in motion.fields[region].items()}
    made = np.concatenate(rest)
    return attrs.evolve(
        motion,
        mesh=attrs.evolve(motion.mesh, nodes=made),
        model_a=(np.concatenate(turned, axis=1) - made).astype(np.float32),
        surfaces=surfaces,
        fields=fields,
    )


def _section(nodes: Any, moved: Any, height_mm: float) -> Any:
    """How the section at a height moved in the plane of y and z: rigid motions (s, 3, 3), homogeneous."""
    apart = np.abs(nodes[:, 2] - height_mm)
    near = apart < apart.min() + 0.1
    before, after = nodes[near, 1:], moved[:, near, 1:]
    middle, middles = before.mean(axis=0), after.mean(axis=1)
    a, b = before - middle, after - middles[:, None]
    turn = np.arctan2((a[:, 0] * b[..., 1] - a[:, 1] * b[..., 0]).sum(axis=1), (a * b).sum(axis=(1, 2)))
    found = np.zeros((len(moved), 3, 3))
    found[:, 0, 0] = found[:, 1, 1] = np.cos(turn)
    found[:, 1, 0] = np.sin(turn)
    found[:, 0, 1] = -found[:, 1, 0]
    found[:, :2, 2] = middles - found[:, :2, :2] @ middle
    found[:, 2, 2] = 1.0
    return found


@lru_cache(maxsize=64)
def _unit_in(path: Path, changed_ns: int) -> Unit:
    return read_unit(path)


def _apart(one: Unit, other: Unit) -> float:
    """0 for units that bend alike; else the sum of the parameters' differences.

    A number counts by the logarithm of its ratio, anything else as 1.
    """
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
