"""The printed unit against rigid bodies: what can be touched, and what it gives back."""

import attrs
import numpy as np
import pytest

from mu_addon.body.lattice import clearance
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.body.strut import strut_mesh
from mu_addon.design import load_preset
from mu_addon.design.strut_cell import strut_cell
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import CONTACT_NEWTON
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.outer_faces import outer_faces
from mu_addon.fem.rigid import Plane, Pose, Sphere
from mu_addon.fem.state import rest
from mu_addon.fem.unit_materials import materials_of
from mu_addon.homogenize.cell_mesh import cell_materials
from mu_addon.homogenize.specimen import block_specimen
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings

SMALL = load_preset("mu-1.0x")
SMALL = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, count=3))
TIP = SMALL.dimensions.height


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SMALL, MeshSettings(refine=0.5))


def beside(mesh, obstacle):
    model = Model(mesh, threads=1)
    model.obstacles = (obstacle,)
    return Equilibrium(model, materials_of(SMALL, mesh), CONTACT_NEWTON)


def test_struts_inside_the_wall_cannot_be_touched(mesh):
    """A bare point of a strut lies outside the actuator but for what a third of a face straddles."""
    found = outer_faces(mesh)
    of_strut = np.zeros(len(mesh.nodes), bool)
    of_strut[mesh.tets[mesh.region == LATTICE]] = True
    struts = found.of(of_strut[found.nodes].all(axis=1))
    clear = clearance(SMALL.printed, mesh.nodes[struts.nodes[:, :3]].reshape(-1, 3)).reshape(-1, 3)
    assert clear[struts.bare == 1.0].min() > -0.2
    assert (struts.bare[clear < -1.0] < 0.2).all()
    sides = np.diff(mesh.nodes[struts.nodes[:, :3]], axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    buried = (clear < 0).all(axis=1)
    assert (area * struts.bare.mean(axis=1))[buried].sum() < 0.01 * area.sum()


def test_a_rigid_plate_presses_a_lattice_as_a_prescribed_displacement_does():
    """A cell of the lattice that goes on to all sides: its junctions stay pressed, so both must agree."""
    cell = strut_cell(SMALL)
    octant = strut_mesh(SMALL.printed, 1, 5)
    block = block_specimen(octant, 1, cell_materials(cell, octant, 2.5, 0.45))
    mesh, half, strain = block.mesh, block.side_mm / 2, 0.01
    held = (mesh.nodes == half) & [True, True, False]
    top = mesh.nodes[:, 2] == half
    moved = held.copy()
    moved[top, 2] = True
    eq = Equilibrium(Model(mesh, moved, threads=1), block.materials, CONTACT_NEWTON)
    u = eq.newton(-strain * mesh.nodes * [0.0, 0.0, 1.0], 0.0).u
    prescribed = -eq.model.residual(u, 0.0, eq.parameters)[top, 2].sum()
    plate = Obstacle(mesh, Plane((0.0, 0.0, half), (0.0, 0.0, -1.0)), 0.1, 1e-4)
    model = Model(mesh, held, threads=1)
    model.obstacles = (plate,)
    plate.pose = Pose(shift=(0.0, 0.0, -strain * half))
    pressed = Equilibrium(model, block.materials, CONTACT_NEWTON).newton(0.0 * u, 0.0)
    assert plate.force_N(pressed.u)[2] == pytest.approx(prescribed, rel=2e-3)
    assert plate.deepest_mm(pressed.u) < 2e-3 * strain * half


@pytest.mark.slow
def test_a_ball_on_the_cap_alone_is_pressed_back_alike_on_a_finer_mesh(mesh):
    force = []
    for body in (mesh, mesh_printed(SMALL, MeshSettings())):
        ball = Obstacle(body, Sphere((0.0, 0.0, TIP + 3.0), 3.0), 0.1, 0.05, 2)
        eq, u = beside(body, ball), rest(body).u
        for by in (0.02, 0.05):
            ball.pose = Pose(shift=(0.0, 0.0, -by))
            u = eq.newton(u, 0.0).u
        force.append(ball.force_N(u)[2])
    assert force[0] > 4e-3
    assert force[0] == pytest.approx(force[1], rel=0.1)
