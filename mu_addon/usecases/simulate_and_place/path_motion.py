"""Motion of a unit with a sensor, for display, as differences from Model A's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...fem.kinematics import MIRROR
from ...meshing.mesh import Mesh, images
from ...placement.candidates import Candidate
from ...report.motion_files import IMAGE, REGIONS, SurfaceFields, surface_of, write_path

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

    own: the study's mesh; mesh: the same, or its `mirror`, the whole body's, if that is a half. on_progress:
    called with the finished share.
    """
    image = None if mesh.symmetry == own.symmetry else images(own, "x")
    nodes = {region: surface_of(own, number).node for region, number in REGIONS.items()}
    both = {r: n if image is None else np.concatenate([n, image[n]]) for r, n in nodes.items()}
    looked, materials = SurfaceFields(mesh, both), job.materials(mesh)
    by_pressure = {state.pressure_kPa: state.u for state in trajectory.solved}
    without: dict[str, Array] = {}
    for number, (name, pressure_kPa, difference_mm) in enumerate(solver.whole(trajectory)):
        still = [by_pressure[p] for p in pressure_kPa]
        without = without or looked.of_states(still, materials)
        moved = [u + apart for u, apart in zip(still, difference_mm, strict=True)]
        fields = {key: values - without[key] for key, values in looked.of_states(moved, materials).items()}
        further = {}
        if image is not None:
            further["image_mm"] = difference_mm[:, image] * MIRROR
            for key, values in fields.items():
                count = len(nodes[key.partition("_")[0]])
                fields[key], further[IMAGE + key] = values[:, :count], values[:, count:]
            difference_mm = difference_mm[:, : len(own.nodes)]
        write_path(folder, name, pressure_kPa, difference_mm, **fields, **further)
        on_progress((number + 1) / len(every))
