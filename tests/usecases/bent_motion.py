"""A unit's motion of known angles: each cross-section turned by its share, without any solver."""

import json
import os

import attrs
import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import Trajectory
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import RESOLVED, MeshSettings
from mu_addon.usecases.simulate_and_place import unit_runs
from mu_addon.usecases.simulate_and_place.job import Job, grasp, write_study
from mu_addon.usecases.simulate_and_place.motion_files import write_model_a

UNIT = load_preset("mu-0.75x")
PRESSURES = np.array([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0])
ANGLES = np.array([-16.0, -9.0, 0.0, 11.0, 24.0, 38.0, 50.0])


def bent(mesh, angle_deg):
    """Displacements (n, 3) in mm: sections turn toward +y with their height, by angle_deg at the tip."""
    y, z = mesh.nodes[:, 1], mesh.nodes[:, 2]
    turn = np.radians(angle_deg) * np.clip(z / z.max(), 0.0, None)
    # About the middle of the base: sections stay plane.
    u = np.zeros_like(mesh.nodes)
    u[:, 1] = y * np.cos(turn) + z * np.sin(turn) - y
    u[:, 2] = -y * np.sin(turn) + z * np.cos(turn) - z
    return u


def write_bent_motion(folder, angles=ANGLES, pressures=PRESSURES, refine=0.5, unit=UNIT):
    """Write `folder`/motion of these angles at these pressures, and return the mesh."""
    mesh = mesh_unit(unit, MeshSettings(refine=refine, order=1))
    states = tuple(
        State(pressure_MPa=p / 1e3, u=bent(mesh, a)) for p, a in zip(pressures, angles, strict=True)
    )
    index = np.arange(len(pressures))
    trajectory = Trajectory(index.astype(float), np.asarray(pressures), states, index, mesh)
    write_model_a(folder, mesh, materials_of(unit, mesh), trajectory)
    return mesh


def write_bent_run(home, at_s, wall_mm=0.9, more=1.0, full=False, ranked=True):
    """A finished run in a unit's home folder, as if ended at a time: bent `more` times as far.

    full: on the default mesh, as its inputs say, else on a coarse one; ranked: whether it ranked paths, too.
    Returns the run.
    """
    chambers = attrs.evolve(UNIT.chambers, wall_mm=wall_mm)
    mesh = MeshSettings(refine=1.0 if full else 0.5, fidelity=RESOLVED)
    job = Job(attrs.evolve(UNIT, chambers=chambers), grasp(), mesh=mesh)
    if not ranked:
        job = attrs.evolve(job, stages=("design", "simulate"))
    folder, job = unit_runs.place_of(home, job)
    write_study(job, folder)
    write_bent_motion(folder, more * ANGLES)
    angles = {f"{p:g}": more * a for p, a in zip(PRESSURES, ANGLES, strict=True)}
    summary = {"status": "complete", "angle_deg": angles, "seconds": {"Model A": 480.0 if full else 20.0}}
    if ranked:
        found = {"alpha4": 0.05 * more, "alpha1": 0.1, "alpha10": 0.4}
        summary |= {"chosen": "alpha4", "J_hat_mm": found}
    path = folder / "summary.json"
    path.write_text(json.dumps(summary))
    os.utime(path, (at_s, at_s))
    return unit_runs.read_run(folder)
