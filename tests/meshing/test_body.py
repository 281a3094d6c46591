"""A body of the user's own in place of the envelope's box: meshed with the chambers inside, and bent."""

import math

import attrs
import numpy as np
import pytest

from mu_addon.design.body import envelope
from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import cavity_volume, outer_volume
from mu_addon.design.surface import bad_edges, volume
from mu_addon.errors import InputError
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing import MeshSettings, mesh_quality, mesh_unit
from mu_addon.meshing.mesh import boundary_faces
from mu_addon.meshing.revolved import unit_surfaces

from ..design.bodies import box, cylinder

UNIT = load_preset("mu-1.0x")
# A thick wall: pytetwild keeps to a fifth of it, and takes ten times as long at half the thickness.
SHORT = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3, wall_mm=1.8))
COARSE = MeshSettings(order=1, refine=0.4)


@pytest.mark.parametrize("turn", [math.pi / 2, math.pi, 2 * math.pi])
def test_surfaces_of_any_part_of_a_turn_are_closed_and_hold_its_volume(turn):
    d = UNIT.dimensions
    _, profile, cavity = unit_surfaces(d, turn, 1.5)
    share = turn / (2 * math.pi)
    for surface, exact in ((profile, outer_volume(d)), (cavity, cavity_volume(d))):
        assert bad_edges(surface.triangles.astype(np.int64)) == 0
        assert volume(surface.vertices, surface.triangles) == pytest.approx(share * exact, rel=1e-3)


@pytest.mark.nightly("tests/meshing/test_surface.py::test_nested_spheres_are_told_apart")
def test_a_body_that_is_no_mirror_image_is_meshed_whole(tmp_path):
    d, shear = SHORT.dimensions, 0.15
    drawn = cylinder(18.75, 25.0, 6.25, -1.0, d.height + 1.0, 32)
    drawn = attrs.evolve(drawn, vertices=drawn.vertices + shear * drawn.vertices[:, [1]] * [1.0, 0.0, 0.0])
    body = envelope(drawn, d)
    mesh = mesh_unit(SHORT, COARSE, cache=tmp_path, body=body)
    assert mesh.symmetry == ()
    found = mesh_quality(mesh, SHORT, body)
    assert found.inverted == 0
    assert abs(found.lattice_volume_error) < 0.02
    assert abs(found.cavity_volume_error) < 0.03  # a wall meshed to within a fifth of its thickness
    assert np.allclose(mesh.nodes[mesh.tip, 2], d.height)
    assert np.allclose(mesh.nodes[mesh.base, 2], 0.0)
    assert mesh.nodes[:, 0].min() < -15.0
    again = mesh_unit(SHORT, COARSE, cache=tmp_path, body=body)
    assert again.hash() == mesh.hash()


@pytest.mark.nightly("tests/meshing/test_surface.py::test_nested_spheres_are_told_apart")
def test_bodies_bend_as_their_shape_says(tmp_path):
    """A box that is wider on one side bends; a body that is round about the axis has no side to bend to.

    Meshes as coarse as these, of a mesher without a seed, scatter: the cylinder's angle by 0.12 degrees
    (standard deviation of ten meshes about 0.04), a tenth of the box's.
    """
    d = SHORT.dimensions

    def angle(mesh):
        solver = Equilibrium(Model(mesh), materials_of(SHORT, mesh))
        states = simulate(solver, np.array([0.0, 1.0]), np.array([0.0, 20.0])).states
        return bending_angle_deg(mesh, states[-1].u)

    def of_body(body):
        mesh = mesh_unit(SHORT, COARSE, cache=tmp_path, body=envelope(body, d))
        assert mesh.symmetry == ("x",)
        faces, _ = boundary_faces(mesh.tets)
        assert (abs(mesh.nodes[faces, 0]) < 1e-12).all(axis=1).any()
        return angle(mesh)

    low, high = np.array(d.bounds).T
    wide = of_body(box(np.append(low[:2], -1.0), np.append(high[:2], d.height + 1.0)))
    assert wide > 1.0
    assert abs(of_body(cylinder(22.0, 22.0, 0.0, -1.0, d.height + 1.0))) < 0.5 * wide


def test_a_mesher_that_cannot_take_a_body_is_refused():
    body = envelope(cylinder(18.75, 25.0, 6.25, -1.0, 80.0), UNIT.dimensions)
    with pytest.raises(InputError, match="meshed by pytetwild"):
        mesh_unit(UNIT, COARSE, mesher="gmsh", body=body)
