"""A unit's motion of known angles: each cross-section turned by its share, without any solver."""

import functools
import json
import os
from types import SimpleNamespace

import attrs
import numpy as np

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import Trajectory
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.report.motion_files import write_model_a
from mu_addon.simulate_and_place import unfinished_motion_parts
from mu_addon.simulate_and_place.mechanics import Samples
from mu_addon.simulate_and_place.motion_tables import Reached
from mu_addon.studies import unit_runs
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_ranking import UnitStudy

from .made_up import bent

UNIT = load_preset("mu-0.75x")
PRESSURES = np.array([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0])
ANGLES = np.array([-16.0, -9.0, 0.0, 11.0, 24.0, 38.0, 50.0])


@functools.cache
def coarse_mesh(unit, refine):
    """A coarse mesh of a unit, whatever its run says."""
    return mesh_printed(unit, MeshSettings(refine=refine))


def write_bent_motion(folder, angles=ANGLES, pressures=PRESSURES, unit=UNIT, refine=0.2):
    """Write `folder`/motion of these angles at these pressures, and return the mesh."""
    mesh = coarse_mesh(unit, refine)
    states = tuple(
        State(pressure_MPa=p / 1e3, u=bent(mesh, a)) for p, a in zip(pressures, angles, strict=True)
    )
    index = np.arange(len(pressures))
    trajectory = Trajectory(index.astype(float), np.asarray(pressures), states, index, mesh)
    write_model_a(folder, mesh, materials_of(unit, mesh), trajectory)
    return mesh


def write_bent_part(folder, solved_kPa):
    """Write `folder`/motion as a run does that has solved some of these pressures."""
    mesh, times = coarse_mesh(UNIT, 0.2), np.arange(len(PRESSURES), dtype=float)
    samples = Samples(times, PRESSURES, PRESSURES)
    known = dict(zip(PRESSURES.tolist(), ANGLES, strict=True))
    states = [State(pressure_MPa=p / 1e3, u=bent(mesh, known[p])) for p in (0.0, *solved_kPa)]
    reached = Reached.of(samples, states, by_instant=False, in_time=False)
    study = SimpleNamespace(samples=samples, mechanics=UnitStudy(unit=UNIT).mechanics)
    for file in unfinished_motion_parts(study, mesh, reached, None):
        file.make(folder / file.name)


def write_bent_run(home, at_s, wall_mm=0.9, more=1.0, full=False, ranked=True):
    """A finished run in a unit's home folder, as if ended at a time: bent `more` times as far.

    full: on the default mesh, as its inputs say, else on a coarse one; ranked: whether it ranked paths, too.
    Returns the run.
    """
    chambers = attrs.evolve(UNIT.chambers, wall_mm=wall_mm)
    mesh = MeshSettings(refine=1.0 if full else 0.5)
    job = UnitStudy(unit=attrs.evolve(UNIT, chambers=chambers), mesh=mesh)
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
