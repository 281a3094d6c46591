"""A unit's motion of known angles: each cross-section turned by its share, without any solver."""

import numpy as np

from mu_addon.design.parameters import load_preset
from mu_addon.fem.state import State
from mu_addon.fem.trajectory import Trajectory
from mu_addon.fem.unit import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.meshing.unit import mesh_unit
from mu_addon.usecases.simulate_and_place.motion import write_model_a

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


def write_bent_motion(folder, angles=ANGLES, pressures=PRESSURES):
    """Write `folder`/motion of these angles at these pressures, and return the mesh."""
    mesh = mesh_unit(UNIT, MeshSettings(refine=0.5, order=1))
    states = tuple(
        State(pressure_MPa=p / 1e3, u=bent(mesh, a)) for p, a in zip(pressures, angles, strict=True)
    )
    index = np.arange(len(pressures))
    trajectory = Trajectory(index.astype(float), np.asarray(pressures), states, index)
    write_model_a(folder, mesh, materials_of(UNIT, mesh), trajectory)
    return mesh
