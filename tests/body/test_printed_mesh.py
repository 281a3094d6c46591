"""The printed unit's mesh: what is filled, what is tied, and what its solutions are."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from mu_addon.body.lattice import without_loose_parts
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design import load_preset, shapes
from mu_addon.design.body import read_body
from mu_addon.design.lattice import lattice_of
from mu_addon.design.profile import cavity_polygon, outer_polygon
from mu_addon.design.solid import QUALITY, lattice_solid
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.dead_loads import gravity
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.self_contact import self_contact_of
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, boundary_faces, mirror, mirror_displacement
from mu_addon.meshing.settings import MeshSettings

from ..fem.bodies import box
from .ties import require_linear_motions_kept

SMALL = load_preset("mu-1.0x")
SMALL = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, count=3))


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SMALL)


def test_a_part_that_hangs_by_a_node_is_left_out():
    # Two stacks of elements that share one node, the first of them held.
    first, second = box((1, 1, 1), (1.0, 1.0, 1.0)), box((1, 1, 1), (1.0, 1.0, 1.0))
    corner = len(first.nodes) - 1
    top = int(np.argmax(first.nodes.sum(axis=1)))
    own = np.argmin(second.nodes.sum(axis=1))
    number = corner + 1 + np.arange(len(second.nodes))
    number[own] = top
    nodes = np.vstack([first.nodes, second.nodes + first.nodes[top]])
    count = len(first.tets) + len(second.tets)
    both = attrs.evolve(
        first,
        nodes=nodes,
        tets=np.vstack([first.tets, number[second.tets]]),
        region=np.full(count, LATTICE),
        filled=np.ones((count, 4)),
    )
    held = nodes[:, 2] == 0.0
    assert len(without_loose_parts(both, held).tets) == len(first.tets)
    assert without_loose_parts(both, np.ones(len(nodes), bool)) is both


@pytest.mark.nightly("test_a_part_that_hangs_by_a_node_is_left_out")
def test_a_users_body_that_cuts_slivers_off_still_bears_its_pressure():
    folder = Path(__file__).parents[2] / "assets/examples/finger-in-a-body"
    chambers = attrs.evolve(SMALL.chambers, wall_mm=0.8)
    lattice = attrs.evolve(SMALL.lattice, junction_diameter_mm=1.398)
    thin = attrs.evolve(SMALL, chambers=chambers, lattice=lattice)
    mesh = mesh_printed(thin, MeshSettings(refine=0.3), body=read_body(folder / "body.obj"))
    body = Equilibrium(Model(mesh, threads=1), materials_of(thin, mesh))
    assert bending_angle_deg(mesh, body.reach(0.002, [body.at_zero_pressure()]).u) > 0.1


def printed_volume_mm3(unit):
    """Half the volume that manifold3d gives the union of lattice and actuator, less the cavity."""
    from manifold3d import Manifold, OpType

    d, facets = unit.dimensions, QUALITY["export"]
    whole = [lattice_solid(d, lattice_of(d), facets)]
    whole += [shapes.revolved(outer_polygon(d, facets.along_arc), facets.around_axis)]
    hollow = Manifold.batch_boolean(whole, OpType.Add)
    hollow -= shapes.revolved(cavity_polygon(d, facets.along_arc), facets.around_axis)
    return hollow.volume() / 2.0


def test_it_holds_as_much_resin_as_the_drawn_solid(mesh):
    assert Model(mesh).volumes.sum() == pytest.approx(printed_volume_mm3(SMALL), rel=2e-3)


def test_the_same_input_gives_the_same_mesh(mesh):
    assert mesh_printed(SMALL).hash() == mesh.hash()


def test_ties_keep_straight_what_is_straight(mesh):
    """A linear motion of what is not tied is one of what is."""
    require_linear_motions_kept(mesh)


def test_all_of_a_strut_touches_but_its_feet(mesh):
    pytest.importorskip("ipctk")
    contact = self_contact_of(SMALL, mesh)
    # As docs/engineering/method.md has them for a wall of 0.9 mm and a resin of 2.5 MPa.
    assert (contact.gap_mm, contact.stiffness_MPa) == pytest.approx((0.1, 0.1))
    still = np.zeros_like(mesh.nodes)
    assert contact.energy_mJ(still) == 0.0
    assert not contact.intersects(still)
    assert not np.isin(contact.facets, mesh.tied).any()
    faces, owner = boundary_faces(mesh.tets)
    of_strut = mesh.region[owner] == LATTICE
    bare = of_strut & ~np.isin(faces, mesh.tied).any(axis=1)
    bare &= ~(mesh.nodes[faces, 0] == 0.0).all(axis=1)
    of_wall = np.zeros(len(mesh.nodes), bool)
    of_wall[mesh.tets[mesh.region == MEMBRANE]] = True
    left = np.count_nonzero(~of_wall[contact.facets].any(axis=1))
    # Struts that are beams have flat faces.
    assert 0.8 < left / np.count_nonzero(bare) <= 1.0


def test_weight_is_that_of_the_resin_and_lost_to_no_tie(mesh):
    model = Model(mesh)
    model.load = gravity(mesh, 1.1e-9, [0.0, 0.0, -1.0])
    m = model.parameters(materials_of(SMALL, mesh))
    weight = 1.1e-9 * 9806.65 * model.volumes.sum()
    reactions = model.residual(np.zeros_like(mesh.nodes), 0.0, m)
    assert reactions[:, 2].sum() == pytest.approx(weight, rel=1e-9)
    assert not reactions[mesh.tied].any()


def test_a_half_bends_as_the_whole_does():
    mesh = mesh_printed(SMALL, MeshSettings(refine=0.35))
    half = Equilibrium(Model(mesh), materials_of(SMALL, mesh))
    state = half.reach(0.002, [half.at_zero_pressure()])
    whole = mirror(mesh, "x")
    body = Model(whole)
    u = mirror_displacement(mesh, state.u, "x")
    m = body.parameters(materials_of(SMALL, whole))
    force = body.residual(u, 0.002, m).ravel()[body.free]
    assert np.linalg.norm(force) < 1e-8 * body.force_scale()
    assert bending_angle_deg(whole, u) == pytest.approx(bending_angle_deg(mesh, state.u), rel=1e-9)
