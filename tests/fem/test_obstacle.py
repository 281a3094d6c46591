"""Rigid obstacles: signed distances, a potential and its derivatives, the patch test, and Hertz's contact."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from mu_addon.errors import InputError
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Box, Plane, Pose, Sphere
from mu_addon.fem.state import rest

from .bodies import box, make, touching

E, NU = 1.0, 0.3
RIGID = [
    Plane((0.1, 0.2, 0.9), (0.1, -0.2, -1.0)),
    Sphere((0.4, 0.6, 1.3), 0.5),
    Box((1.2, 0.5, 1.1), (0.5, 0.2, 0.4)),
]


@pytest.mark.parametrize("rigid", RIGID)
@given(at=st.tuples(*[st.floats(-2.0, 3.0)] * 3))
def test_a_distance_has_a_unit_gradient_and_its_own_derivatives(rigid, at):
    x, h = np.array([at]), 1e-6
    g, n, bend = rigid.distance(x)
    steps = h * np.eye(3)
    ahead, behind = rigid.distance(x + steps), rigid.distance(x - steps)
    if isinstance(rigid, Sphere) and abs(g[0] + rigid.radius) < 1e-2:
        return
    if isinstance(rigid, Box):
        # Not on an edge's plane or where the nearest face changes, which it also does from one side of the
        # middle to the other: there the gradient turns at once.
        aside = np.abs(x[0] - rigid.centre)
        beyond = np.sort(aside - rigid.half_mm)
        if min(np.abs(beyond).min(), aside.min()) < 1e-2 or beyond[2] - beyond[1] < 1e-2:
            return
    assert np.linalg.norm(n[0]) == pytest.approx(1.0)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), n[0], atol=1e-7)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), bend[0], atol=1e-4)


def test_an_obstacle_out_of_reach_changes_nothing():
    mesh = box((2, 2, 2), clamp=True)
    obstacle = Obstacle(mesh, Plane((0, 0, 1.5), (0, 0, -1)), 0.3, 0.01)
    u = np.zeros_like(mesh.nodes)
    assert obstacle.gap_mm(u) == pytest.approx(0.5)
    assert obstacle.energy_mJ(u) == 0.0
    assert len(obstacle.forces(u)[0]) == len(obstacle.blocks(u)[0]) == 0


def test_the_energy_of_a_face_is_the_work_that_pressed_it_in():
    """Through the depth at which the pressure's rise becomes straight."""
    mesh, depth = box((2, 2, 2), clamp=True), 0.01
    still = np.zeros_like(mesh.nodes)
    path = depth * np.linspace(0.0, 3.0, 301)
    energy, force = [], []
    for s in path:
        obstacle = Obstacle(mesh, Plane((0, 0, 1.0 - s), (0, 0, -1)), 0.3, depth)
        energy.append(obstacle.energy_mJ(still))
        force.append(obstacle.contact(still).normal_N[2])
    np.testing.assert_allclose(
        np.diff(energy), np.diff(path) * (np.add(force[1:], force[:-1]) / 2), rtol=1e-2, atol=1e-9
    )


@pytest.mark.parametrize("order", [1, 2])
def test_patch(order):
    """A block pressed by a plane is strained alike everywhere, as by a pressure, to rounding."""
    mesh = box((2, 3, 2), order=order, jiggle=0.2, symmetry=("x", "y", "z"))
    depth, pressure, by = 0.01, 0.2, 0.2
    obstacle = Obstacle(mesh, Plane((0, 0, 1), (0, 0, -1)), pressure, depth)
    eq = touching(mesh, obstacle)
    state = rest(mesh)
    for shift in (0.5 * by, by):
        obstacle.pose = Pose(shift=(0, 0, -shift))
        state = eq.newton(state.u, 0.0)
    _, on = obstacle.pressures_MPa(state.u)
    np.testing.assert_allclose(on, on.mean(), rtol=1e-6)
    stretch = 1 + state.u / np.where(mesh.nodes == 0, np.inf, mesh.nodes)
    stretch = np.array([stretch[mesh.nodes[:, i] > 0, i] for i in range(3)], dtype=object)
    for values in stretch:
        np.testing.assert_allclose(values.astype(float), values[0], rtol=1e-7)
    across, along = float(stretch[0][0]), float(stretch[2][0])
    mu, kappa = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))

    def stress(a, z):
        """First Piola-Kirchhoff stresses, across and along, of the uniaxial state."""
        J, i1 = a * a * z, 2 * a * a + z * z
        of = lambda s: mu * J ** (-2 / 3) * (s - i1 / (3 * s)) + kappa * (J - 1) * J / s  # noqa: E731
        return of(a), of(z)

    free = brentq(lambda a: stress(a, along)[0], 0.9, 1.3)
    assert across == pytest.approx(free, rel=1e-7)
    assert on.mean() == pytest.approx(-stress(free, along)[1], rel=1e-6)
    # The plane is as deep in the block as its law says.
    assert along == pytest.approx(1 - by + obstacle.deepest_mm(state.u), rel=1e-9)
    k = 2 * pressure / depth
    assert obstacle.deepest_mm(state.u) == pytest.approx(on.mean() / k + depth / 2, rel=1e-6)
    assert obstacle.force_N(state.u)[2] == pytest.approx(on.mean(), rel=1e-6)


def half_space(side, counts, order=2):
    """A quarter of a block, its upper face's middle at the origin, elements ever larger away from it."""
    mesh = box((counts,) * 3, (1.0,) * 3, order=1, symmetry=("x", "y"))
    graded = side * np.sinh(5.0 * mesh.nodes) / np.sinh(5.0)
    nodes, tets = graded * (1, 1, -1), mesh.tets[:, [1, 0, 2, 3]]
    return make(nodes, tets, order, base=(lambda p: p[2] < -side * (1 - 1e-9),), symmetry=("x", "y"))


def hertz(radius, approach):
    """Force of a ball on a half-space and the largest pressure; Johnson, Contact Mechanics, 1985, 4.2."""
    plane = E / (1 - NU**2)
    force = 4 / 3 * plane * np.sqrt(radius * approach**3)
    return force, (6 * force * plane**2 / (np.pi**3 * radius**2)) ** (1 / 3)


def approached(mesh, rigid, radius, approach):
    """Force on an obstacle that has come nearer by `approach`, radius of the contact, depth of the surface.

    Hertz's pressure, p0 sqrt(1 - r^2/a^2), has a mean of r^2 of 2/5 a^2.
    """
    obstacle = Obstacle(mesh, rigid, hertz(radius, approach)[1], 0.01 * approach)
    eq = touching(mesh, obstacle)
    state = rest(mesh)
    for share in (0.1, 0.4, 1.0):
        obstacle.pose = Pose(shift=(0, 0, -share * approach))
        state = eq.newton(state.u, 0.0)
    nodes, forces = obstacle.forces(state.u)
    far = (mesh.nodes[nodes, :2] ** 2).sum(axis=1)
    wide = np.sqrt(2.5 * (forces[:, 2] @ far) / forces[:, 2].sum())
    return 4 * float(obstacle.force_N(state.u)[2]), float(wide), obstacle.deepest_mm(state.u)


def test_hertz_ball_on_a_half_space():
    """A contact of 1 mm radius; the block of 30 mm is held 2 % more stiffly than a half-space."""
    radius, approach = 10.0, 0.1
    force, wide, deep = approached(half_space(30.0, 8), Sphere((0, 0, radius), radius), radius, approach)
    assert force == pytest.approx(hertz(radius, approach)[0], rel=0.05)
    assert wide == pytest.approx(np.sqrt(radius * approach), rel=0.05)
    assert 0 < deep < 0.015 * approach


def test_hertz_elastic_ball_on_a_plane():
    """The body is round, to second order of the radius, and the obstacle flat: the same answer."""
    radius, approach = 10.0, 0.1
    mesh = half_space(30.0, 8)
    near = np.minimum((mesh.nodes[:, :2] ** 2).sum(axis=1), 9.0)
    nodes = mesh.nodes - near[:, None] / (2 * radius) * np.exp(mesh.nodes[:, 2:] / 3.0) * (0, 0, 1)
    round_ = attrs.evolve(mesh, nodes=nodes)
    force, wide, _ = approached(round_, Plane((0, 0, 0), (0, 0, -1)), radius, approach)
    assert force == pytest.approx(hertz(radius, approach)[0], rel=0.05)
    assert wide == pytest.approx(np.sqrt(radius * approach), rel=0.05)


def test_a_pose_that_is_no_rotation_and_a_contact_without_depth_are_refused():
    with pytest.raises(InputError, match="not a rotation"):
        Pose(np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(InputError, match="MPa at 0 mm"):
        Obstacle(box(), RIGID[0], 0.5, 0.0)
    with pytest.raises(InputError, match="is not a direction"):
        Plane((0, 0, 0), (0, 0, 0))
