"""What of a body in parts that overlap can be touched: two boxes that share one."""

import attrs
import numpy as np
import pytest

from mu_addon.fem.embedding import embed
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.outer_faces import outer_faces
from mu_addon.fem.rigid import Plane, Pose
from mu_addon.fem.state import rest
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.meshing.mesh import LATTICE, boundary_faces

from .bodies import box, touching

E, NU = 1.0, 0.3
LOW, HIGH = 0.6, 0.3
POINTS = 4


def overlapping(symmetry=()):
    """A unit cube of a box up to z = LOW, and of one from HIGH on, whose part below LOW is cut away."""
    below = box((2, 3, 2), (1.0, 1.0, LOW), jiggle=0.2, symmetry=symmetry, clamp=not symmetry)
    above = box((3, 2, 7), (1.0, 1.0, 1.0 - HIGH), symmetry=symmetry)
    above.nodes[:, 2] += HIGH
    above = attrs.evolve(above, region=np.full(len(above.tets), LATTICE))
    count = len(below.nodes)
    filled = np.repeat(above.nodes[above.corners][:, :, 2].max(axis=1) > LOW + 1e-9, POINTS)
    within = np.flatnonzero(above.nodes[:, 2] <= LOW + 1e-9)
    follows = embed(below, above.nodes[within])
    return attrs.evolve(
        below,
        nodes=np.vstack([below.nodes, above.nodes]),
        tets=np.vstack([below.tets, above.tets + count]),
        region=np.concatenate([below.region, above.region]),
        filled=np.concatenate([np.ones(len(below.tets) * POINTS), filled]).reshape(-1, POINTS),
        tied=count + within,
        tied_to=follows.nodes,
        tied_weights=follows.weights,
    )


def test_what_lies_inside_another_part_is_no_outer_face():
    mesh = overlapping()
    found = outer_faces(mesh)
    every = len(boundary_faces(mesh.tets)[0])
    z = mesh.nodes[found.nodes][:, :, 2]
    of_above = (found.nodes >= mesh.tied.min()).all(axis=1)
    assert len(found.nodes) < every
    assert z[of_above].min() == pytest.approx(LOW)
    assert (found.bare == 1.0).all()


@pytest.mark.parametrize("axis", [0, 1])
def test_patch(axis):
    """Pressed beside the plane where its parts end the cube is strained as a whole one, alike everywhere."""
    mesh = overlapping(symmetry=("x", "y", "z"))
    at, towards = np.eye(3)[axis], -np.eye(3)[axis]
    obstacle = Obstacle(mesh, Plane(at, towards), 0.2, 0.01)
    eq = touching(mesh, obstacle)
    obstacle.pose = Pose(shift=0.1 * towards)
    state = eq.newton(rest(mesh).u, 0.0)
    _, on = obstacle.pressures_MPa(state.u)
    np.testing.assert_allclose(on, on.mean(), rtol=1e-6)
    strain = state.u[:, axis][mesh.nodes[:, axis] > 0] / mesh.nodes[:, axis][mesh.nodes[:, axis] > 0]
    np.testing.assert_allclose(strain, obstacle.deepest_mm(state.u) - 0.1, rtol=1e-6)
    contact = obstacle.contact(state.u)
    # Each place once, on whichever part it is.
    assert contact.area_mm2 == pytest.approx(1.0)
    assert contact.force_N[axis] == pytest.approx(on.mean())


def test_force_and_tangent_are_derivatives_of_the_energy():
    mesh = overlapping()
    obstacle = Obstacle(mesh, Plane((0.97, 0.0, 0.0), (-1.0, 0.1, 0.2)), 0.2, 0.01, friction=0.4)
    eq = touching(mesh, obstacle)
    random = np.random.default_rng(0)
    before, u = (mesh.following(0.01 * random.standard_normal(mesh.nodes.shape)) for _ in range(2))
    obstacle.update_lag(before)
    eq.model.commit(before, eq.parameters)
    obstacle.update_lag(u)
    assert_folded(eq.model, eq.parameters, u, random)


def assert_folded(model, m, u, random):
    """As `assert_consistent`, along motions that the ties follow."""
    step = random.standard_normal(len(model.free))
    h = 1e-6
    ahead, behind = (model.moved(u, sign * h * step) for sign in (1, -1))
    slope = (model.potential(ahead, 0.0, m) - model.potential(behind, 0.0, m)) / (2 * h)
    assert slope == pytest.approx(float(model.residual(u, 0.0, m).ravel()[model.free] @ step), rel=1e-7)
    change = model.residual(ahead, 0.0, m) - model.residual(behind, 0.0, m)
    along = model.matrix(model.tangent(u, 0.0, m)) @ step
    np.testing.assert_allclose(change.ravel()[model.free] / (2 * h), along, atol=1e-6 * np.abs(along).max())


def test_a_cube_in_two_parts_rubs_as_a_whole_one():
    """A lid pressed on its side and drawn along it: mu times the normal force, in balance with the base."""
    mesh, friction = overlapping(), 0.3
    lid = Obstacle(
        mesh,
        Plane((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        0.05,
        0.005,
        friction=friction,
        path=lambda t: Pose(shift=(-0.05 * min(t, 1.0), 0.0, 0.4 * max(t - 1.0, 0.0))),
    )
    eq = touching(mesh, lid)
    found = simulate_in_time(eq, np.linspace(0.0, 2.0, 9), np.zeros(9)).states[-1]
    contact = lid.contact(found.u)
    normal, along = contact.normal_N[0], contact.tangential_N[2]
    # The lid goes up, so the body holds it down.
    assert along == pytest.approx(-friction * normal, rel=0.02)
    reaction = eq.model.residual(found.u, 0.0, eq.parameters)[mesh.base].sum(axis=0)
    np.testing.assert_allclose(reaction, contact.force_N, rtol=1e-6, atol=1e-9)
