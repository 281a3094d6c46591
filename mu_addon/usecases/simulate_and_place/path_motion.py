"""Motion of a unit with a sensor, for display, as differences from Model A's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...fem.kinematics import MIRROR
from ...meshing.mesh import Mesh
from ...placement.candidates import Candidate, roi, with_sensor
from .motion_files import IMAGE, REGIONS, SurfaceFields, surface_of, write_path

if TYPE_CHECKING:
    from pathlib import Path

    from ...fem.trajectory import Trajectory
    from .candidates_by_pressure import CandidateSolver
    from .job import Job

Array = np.ndarray[Any, Any]


def keep_motion(
    job: Job,
    folder: Path,
    own: Mesh,
    mesh: Mesh,
    trajectory: Trajectory,
    solver: CandidateSolver,
    every: Sequence[Candidate],
    on_progress: Callable[[float], None],
) -> None:
    """Write the motion of every path whose displacement a sweep on a mesh has kept. Raises OutputError.

    own: the study's mesh; mesh: the same, or the whole body's if that is a half. on_progress: called with the
    finished share.
    """
    unit = job.unit
    image = images(own, mesh)
    nodes = {region: surface_of(own, number).node for region, number in REGIONS.items()}
    both = {r: n if image is None else np.concatenate([n, image[n]]) for r, n in nodes.items()}
    looked, materials = SurfaceFields(mesh, both), job.materials(mesh)
    candidates = {candidate.name: candidate for candidate in every}
    by_pressure = {state.pressure_kPa: state.u for state in trajectory.solved}
    without: dict[str, Array] = {}
    for number, (name, pressure_kPa, difference_mm) in enumerate(solver.whole(trajectory)):
        still = [by_pressure[p] for p in pressure_kPa]
        without = without or looked.of_states(still, materials)
        stiff = materials
        if not mesh.resolved:
            share = roi(mesh, candidates[name], unit.dimensions.inclusion_radius).share
            stiff = with_sensor(materials, share, unit.material.sensor_modulus_MPa)
        moved = [u + apart for u, apart in zip(still, difference_mm, strict=True)]
        fields = {key: values - without[key] for key, values in looked.of_states(moved, stiff).items()}
        further = {}
        if image is not None:
            further["image_mm"] = difference_mm[:, image] * MIRROR
            for key, values in fields.items():
                count = len(nodes[key.partition("_")[0]])
                fields[key], further[IMAGE + key] = values[:, :count], values[:, count:]
            difference_mm = difference_mm[:, : len(own.nodes)]
        write_path(folder, name, pressure_kPa, difference_mm, **fields, **further)
        on_progress((number + 1) / len(candidates))


def images(half: Mesh, mesh: Mesh) -> Array | None:
    """Number in the whole body's mesh of the mirror image (n,) of each of its half's nodes.

    None where the mesh is the half itself. Sides are numbered as `mirror` does it.
    """
    if mesh.symmetry == half.symmetry:
        return None
    off = np.ones(len(half.nodes), bool)
    off[half.symmetry_nodes("x")] = False
    found = np.arange(len(half.nodes))
    found[off] = len(half.nodes) + np.arange(np.count_nonzero(off))
    return found
