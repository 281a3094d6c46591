"""A study's candidates where contact or wall has history: each through its whole motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from ...design.anchors import anchor_points
from ...errors import ConvergenceError
from ...fem.equilibrium import LOWER
from ...fem.kinematics import probe
from ...fem.trajectory import Trajectory
from ...meshing.mesh import Mesh
from ...placement.candidates import Candidate, Evaluation, evaluation
from ...run.cache import Cache, key
from .candidate_pool import CandidatePool, CandidateProblem
from .contact_history import PRESSURE_AND_HALVINGS, DEPTH_mm
from .job import Job

Array = np.ndarray[Any, Any]


def evaluations(
    job: Job,
    cache: Cache,
    mesh: Mesh,
    trajectory: Trajectory,
    candidates: Sequence[Candidate],
    on_progress: Callable[[float], None],
) -> tuple[list[Evaluation], list[str]]:
    """Evaluation of every candidate against Model A's motion.

    It compares the instants until the first that a candidate does not reach, and lists the others.

    The shortcuts of `candidates_by_pressure` are invalid if a state depends on earlier ones. Every candidate
    is solved through all instants and kept in the cache. Raises ConvergenceError.
    """
    unit, materials = job.unit, job.materials(mesh)
    points = anchor_points(unit)
    time, pressure = trajectory.time_s, trajectory.pressure_kPa
    setting = CandidateProblem(job, mesh, points, tuple(candidates))
    friction = [o.friction for o in job.obstacles]
    if job.self_friction:
        friction.append(job.self_friction)
    contact = job.newton, *PRESSURE_AND_HALVINGS, DEPTH_mm, friction
    names = [
        key(
            mesh.hash(),
            materials.hash(),
            time,
            pressure,
            *contact,
            job.obstacles_text() or "",
            points,
            candidate.points,
            *job.effects.parts,
        )
        for candidate in candidates
    ]
    kept = {n: cache.get("march", name) for n, name in enumerate(names)}
    moved = {n: arrays["moved_mm"] for n, arrays in kept.items() if arrays is not None}
    with closing(CandidatePool(setting, job.workers)) as sweeper:
        missing = [n for n in range(len(candidates)) if n not in moved]
        for n, found in sweeper.simulated_in_time(missing, time, pressure):
            cache.put("march", names[n], {"moved_mm": found})
            moved[n] = found
            on_progress(len(moved) / len(candidates))
    count = min(map(len, moved.values()))
    not_reached = []
    if count < len(time):
        first = next(one.name for n, one in enumerate(candidates) if len(moved[n]) == count)
        not_reached = [f"from {time[count]:.6g} s on ({first}: no equilibrium at {pressure[count]:.4g} kPa)"]
        if not pressure[:count].any():
            raise ConvergenceError(f"not all paths are compared {not_reached[0]}", first, LOWER)
    monitor = probe(mesh, points)
    still = trajectory.of_time(np.array([points + monitor.displacement(s.u) for s in trajectory.solved]))
    every = np.full((len(candidates), *still.shape), np.nan)
    for n in moved:
        every[n, :count] = moved[n][:count]
    compared = [
        evaluation(one.name, own, still, job.stations) for one, own in zip(candidates, every, strict=True)
    ]
    return compared, not_reached
