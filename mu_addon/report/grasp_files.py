"""The motion of a grasp for display, one folder a cube.

- motion/: one finger in its frame, as of a study (`motion_files`), each instant a separate state
- finger.pvd and its .vtu files: the half mesh, for ParaView
- gripper.npz: both fingers in the gripper's frame: `rest_mm` (2, v, 3), `triangles` (t, 3), `membrane` (t,),
  whether a triangle is the membrane's; `time_s` (k,), `cube_mm` (k, 3), the cube's middle, `cube_side_mm`;
  `placement` (2, 4, 4), from a finger's frame to the gripper's
- left.pc2 and right.pc2: the vertices of `rest_mm` in motion, at even steps of time from 0 on
- left-cut.pc2 and right-cut.pc2: of the halves of `write_halves`
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..arrays import Array
from ..design.gripper import Gripper
from ..design.quantity import in_MPa
from ..errors import InputError
from ..fem.materials import Materials
from ..fem.state import State
from ..fem.trajectory import Trajectory
from ..files import make_folder, read_npz, write_npz
from ..grasp import Grasp
from ..meshing.mesh import Mesh
from .motion_files import read_motion, write_model_a
from .pc2 import write_pc2
from .vtk import write_trajectory

SIDES = ("left", "right")
CUT = "-cut"
"""Ending of the names of point caches of fingers that are cut open."""
# Most even steps of time of a point cache.
MOST_SAMPLES = 1001


def write_grasp(folder: Path, gripper: Gripper, mesh: Mesh, materials: Materials, found: Grasp) -> None:
    """Write a grasp's motion into `folder`. Raises OutputError."""
    make_folder(folder)
    states = tuple(State(in_MPa(p), u) for p, u in zip(found.pressure_kPa, found.u, strict=True))
    every = Trajectory(found.time_s, found.pressure_kPa, states, np.arange(len(states)), mesh)
    write_model_a(folder, mesh, materials, every)
    write_trajectory(folder / "finger.pvd", mesh, list(zip(found.time_s.tolist(), states, strict=True)))
    motion = read_motion(folder)
    skins = [motion.skin(region, cut=False) for region in ("membrane", "lattice")]
    rest = np.concatenate([skin.of_nodes(mesh.nodes) for skin in skins])
    moved = np.concatenate([skin.of_nodes(mesh.nodes + found.u) for skin in skins], axis=1)
    counts = [len(skin.triangles) for skin in skins]
    triangles = np.vstack([skins[0].triangles, skins[1].triangles + len(skins[0].node)])
    time, samples = even(found.time_s, moved)
    for side, (rotation, shift) in zip(SIDES, gripper.placements, strict=True):
        write_pc2(
            folder / f"{side}.pc2", samples @ rotation.T + shift, float(time[0]), float(time[1] - time[0])
        )
    placement = np.tile(np.eye(4), (2, 1, 1))
    for matrix, (rotation, shift) in zip(placement, gripper.placements, strict=True):
        matrix[:3, :3], matrix[:3, 3] = rotation, shift
    write_npz(
        folder / "gripper.npz",
        {
            "rest_mm": np.array([rest @ r.T + s for r, s in gripper.placements], np.float32),
            "triangles": triangles.astype(np.int32),
            "membrane": np.repeat([True, False], counts),
            "time_s": found.time_s,
            "cube_mm": found.cube_mm + gripper.placements[0][1],
            "cube_side_mm": np.array(found.cube.side_mm),
            "placement": placement,
        },
    )


def write_halves(folder: Path) -> list[tuple[Array, Array, Array]]:
    """Write the motion of both fingers cut open, of their halves at x <= 0. Raises InputError, OutputError.

    Returns for each the vertices at rest (v, 3) in mm, triangles (t, 3), and a mask (t,) of the membrane's.
    """
    motion, data = read_motion(folder), read_npz(folder / "gripper.npz")
    if data is None or "placement" not in data:
        raise InputError("this grasp cannot be cut open", str(folder), "grasp again")
    skins = [motion.skin(region, cut=True) for region in ("membrane", "lattice")]
    rest = np.concatenate([skin.of_nodes(motion.mesh.nodes) for skin in skins])
    u = np.concatenate([skin.of_nodes(motion.model_a[motion.state]) for skin in skins], axis=1)
    triangles = np.vstack([skins[0].triangles, skins[1].triangles + len(skins[0].node)])
    membrane = np.repeat([True, False], [len(skin.triangles) for skin in skins])
    time, samples = even(motion.time_s, rest + u)
    found = []
    for side, place in zip(SIDES, data["placement"], strict=True):
        # A finger turned about z shows the other half, which is the mirror image.
        turned = place[0, 0] < 0
        matrix = place[:3, :3] @ np.diag([-1.0 if turned else 1.0, 1.0, 1.0])
        moved = samples @ matrix.T + place[:3, 3]
        write_pc2(folder / f"{side}{CUT}.pc2", moved, float(time[0]), float(time[1] - time[0]))
        faces = triangles[:, ::-1] if turned else triangles
        found.append((rest @ matrix.T + place[:3, 3], faces, membrane))
    return found


def even(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Times at even steps, at most the least of `time_s` (k,), and values (k, ...) interpolated linearly."""
    step = float(np.diff(time_s).min())
    count = min(MOST_SAMPLES, round(float(time_s[-1] - time_s[0]) / step) + 1)
    time = np.linspace(time_s[0], time_s[-1], count)
    place = np.interp(time, time_s, np.arange(len(time_s)))
    first = np.minimum(place.astype(int), len(time_s) - 2)
    share = (place - first).reshape(-1, *([1] * (values.ndim - 1)))
    return time, (1 - share) * values[first] + share * values[first + 1]
