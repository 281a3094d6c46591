"""Answers against the mesh, whose figures docs/engineering/verification.md gives."""

import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import candidate_paths, roi

UNIT = load_preset("mu-1.0x")
REFINEMENTS = (0.7, 1.0, 1.4)


@pytest.fixture(scope="module")
def meshes():
    return [mesh_unit(UNIT, MeshSettings(refine=refine)) for refine in REFINEMENTS]


@pytest.mark.nightly(
    "tests/fem/test_manufactured.py::test_displacement_converges_one_order_faster_than_its_gradient"
)
def test_the_default_mesh_is_within_three_percent_of_the_finest(meshes):
    """Tip angle at -20, 20 and 40 kPa on three refinements; the default is the middle one."""
    found = []
    for mesh in meshes:
        materials = materials_of(UNIT, mesh)
        pressure = np.array([0.0, -20, 0, 20, 40])
        path = simulate(Equilibrium(Model(mesh), materials), np.arange(5.0), pressure)
        angle = {round(s.pressure_MPa * 1e3): bending_angle_deg(mesh, s.u) for s in path.solved}
        found.append([angle[p] for p in (-20, 20, 40)])
    coarse, default, fine = np.array(found)
    assert (np.abs(default / fine - 1) < 0.03).all()
    assert (np.abs(default - fine) < np.abs(coarse - fine)).all()


def test_shares_keep_the_sensors_volume_on_any_mesh(meshes):
    """Whole touched elements hold several times as much, by an amount that is the mesh's (mean of paths)."""
    touched, shared = [], []
    for mesh in meshes:
        volumes = element_volumes(mesh)
        found = [roi(mesh, candidate, 1.0) for candidate in candidate_paths(anchor_points(UNIT), windows(6))]
        touched.append(np.mean([2 * (f.touched @ volumes) / f.cylinder_volume_mm3 for f in found]))
        shared.append(np.mean([2 * (f.share @ volumes) / f.cylinder_volume_mm3 for f in found]))
    np.testing.assert_allclose(shared, 1.0, rtol=1e-3)
    assert min(touched) > 4
    assert max(touched) > 1.5 * min(touched)
