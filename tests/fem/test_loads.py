"""Weight and tractions against closed forms."""

import numpy as np
import pytest

from mu_addon.errors import ConvergenceError
from mu_addon.fem.dead_loads import STANDARD_GRAVITY, gravity, traction
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.state import rest
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.fem.trajectory import simulate
from mu_addon.meshing.mesh import MEMBRANE, Mesh, boundary_faces

from . import bodies
from .bodies import uniform
from .derivatives import assert_derivatives

DENSITY = 1.1e-9  # tonne/mm3, silicone


def loaded(model, materials, load):
    model.load = load
    return Equilibrium(model, materials, NewtonSettings()).newton(rest(model.mesh).u, 0.0).u


def linear(model, materials, load):
    """The linearised answer."""
    u = rest(model.mesh).u
    model.factor.factor(model.tangent(u, 0.0, model.parameters(materials)))
    u.ravel()[model.free] = model.factor.solve(load.ravel()[model.free])
    return u


@pytest.mark.parametrize("order", [1, 2])
def test_weight_adds_up_and_balances_about_the_centre_of_mass(order):
    mesh = bodies.sphere_octant(order=order)
    density = np.linspace(1, 3, len(mesh.tets)) * DENSITY
    load = gravity(mesh, density, [0, -2, 0])
    reference = Model(mesh).volumes
    assert load.sum(axis=0) == pytest.approx([0, -(density * reference).sum() * STANDARD_GRAVITY, 0])
    box = bodies.box((2, 3, 2), (2.0, 4.0, 6.0), order=order)
    load = gravity(box, DENSITY, [1, 0, 0], g_mm_per_s2=1.0)
    moment = np.cross(box.nodes - [1.0, 2.0, 3.0], load).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * load.sum())


@pytest.mark.parametrize("order", [1, 2])
def test_a_hanging_bar_grows_by_rho_g_L2_over_2E(order):
    mesh = bodies.box((1, 1, 6), (2.0, 2.0, 30.0), order=order)
    held = mesh.nodes[:, 2:] == 30.0
    model = Model(mesh, supports=np.repeat(held, 3, axis=1))
    load = gravity(mesh, DENSITY, [0, 0, -1])
    expected = -DENSITY * STANDARD_GRAVITY * 30.0**2 / (2 * 0.5)
    u = linear(model, uniform(mesh, 0.5, 0.0), load)
    bottom = mesh.nodes[:, 2] == 0
    if order == 2:
        np.testing.assert_allclose(u[bottom, 2], expected, rtol=1e-9)
    # Linear elements share a section's weight unevenly among its nodes: only their mean is right.
    assert u[bottom, 2].mean() == pytest.approx(expected, rel=1e-3)
    assert loaded(model, uniform(mesh, 0.5, 0.0), load)[bottom, 2].mean() == pytest.approx(expected, rel=0.02)


def test_a_heavy_beam_sags_by_its_closed_form():
    """rho g A L^4/(8 E I) by bending, and rho g L^2/(2 G 5/6) by shear, of a square section, nu = 0."""
    length, side, modulus = 40.0, 4.0, 2.0
    mesh = bodies.box((2, 2, 12), (side, side, length), clamp=True)
    model = Model(mesh)
    load = gravity(mesh, DENSITY, [0, -1, 0])
    weight = DENSITY * STANDARD_GRAVITY
    bending = weight * length**4 / (8 * modulus * side**2 / 12)
    shear = weight * length**2 / (2 * (modulus / 2) * 5 / 6)
    tip = mesh.nodes[:, 2] == length
    sag = -linear(model, uniform(mesh, modulus, 0.0), load)[tip, 1].mean()
    assert sag == pytest.approx(bending + shear, rel=5e-3)


@pytest.mark.parametrize("order", [1, 2])
def test_a_traction_pulls_a_bar_evenly(order):
    mesh = bodies.box((2, 2, 3), (1.0, 2.0, 3.0), order=order, symmetry=("x", "y", "z"), jiggle=0.2)
    faces, _ = boundary_faces(mesh.tets)
    top = faces[(mesh.nodes[faces][:, :, 2] == 3).all(axis=1)]
    if order == 2:
        top = with_middles(mesh, top)
    load = traction(mesh, top, [0.0, 0.0, 1e-3])
    assert load.sum(axis=0) == pytest.approx([0, 0, 2e-3])
    u = linear(Model(mesh), uniform(mesh, 0.5, 0.3), load)
    np.testing.assert_allclose(u, mesh.nodes * [-0.3 * 2e-3, -0.3 * 2e-3, 2e-3], atol=1e-12)


def with_middles(mesh, faces):
    """Faces (f, 3) of a quadratic mesh with their mid-edge nodes, found by place."""
    ends = mesh.nodes[faces]
    middles = (ends + np.roll(ends, -1, axis=1)) / 2
    distance = np.linalg.norm(mesh.nodes[None, None] - middles[:, :, None], axis=-1)
    return np.hstack([faces, distance.argmin(axis=2)])


def test_force_and_tangent_are_derivatives_of_the_potential_with_a_load_too():
    mesh = bodies.hollow_box(2, n=3, clamp=False)
    model = Model(mesh)
    m = model.parameters(uniform(mesh, 0.5, 0.3))
    model.load = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    u, d = 0.03 * np.random.default_rng(1).standard_normal((2, *mesh.nodes.shape))
    assert_derivatives(model, m, u, d, 0.01)


def test_weight_of_half_a_body_is_half_the_weight():
    half = bodies.box((2, 2, 2), symmetry=("x",))
    nodes = np.vstack([half.nodes, half.nodes * [-1, 1, 1]])
    other = half.tets[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]] + len(half.nodes)
    tets = np.vstack([half.tets, other])
    whole = Mesh(nodes, tets, np.full(len(tets), MEMBRANE), np.empty((0, 6), int), [], [])
    load = gravity(whole, DENSITY, [0, 0, -1])
    np.testing.assert_allclose(load[: len(half.nodes)], gravity(half, DENSITY, [0, 0, -1]))


def bar(load_factor, direction):
    """A clamped bar of silicone's weight, or so many times as heavy."""
    mesh = bodies.box((1, 1, 6), (2.0, 2.0, 30.0), order=2)
    model = Model(mesh, supports=np.repeat(mesh.nodes[:, 2:] == 0.0, 3, axis=1))
    model.load = load_factor * gravity(mesh, DENSITY, direction)
    return Equilibrium(model, uniform(mesh, 0.5, 0.3))


def test_a_body_that_weighs_nothing_is_as_drawn_without_pressure():
    body = bar(1.0, [0, -1, 0])
    body.model.load = None
    state = body.at_zero_pressure()
    assert not state.loaded
    assert state.factorisations == 0


def test_weight_is_put_on_in_as_many_steps_as_it_takes():
    light, heavy = bar(1.0, [0, -1, 0]), bar(60.0, [0, -1, 0])
    with pytest.raises(ConvergenceError):
        heavy.newton(rest(heavy.model.mesh).u, 0.0)
    load = heavy.model.load.copy()
    state = heavy.at_zero_pressure()
    assert state.loaded
    assert state.residual < 1e-9
    np.testing.assert_array_equal(heavy.model.load, load)
    tip = light.model.mesh.nodes[:, 2] == 30.0
    once, sixty = (s.u[tip, 1].mean() for s in (light.at_zero_pressure(), state))
    # Longer than it is it cannot hang.
    assert -30.0 < sixty < 4 * once < 0


def test_a_weight_that_is_not_borne_is_said():
    """A column under many times the weight at which it buckles."""
    body = bar(400.0, [0, 0, -1])
    load = body.model.load.copy()
    with pytest.raises(ConvergenceError, match="no equilibrium under gravity alone") as caught:
        body.at_zero_pressure()
    assert caught.value.remedy
    np.testing.assert_array_equal(body.model.load, load)


def test_motion_begins_where_the_weight_has_taken_the_body():
    body = bar(1.0, [0, -1, 0])
    start = body.at_zero_pressure()
    for motion in (simulate, simulate_in_time):
        np.testing.assert_array_equal(motion(body, np.arange(2.0), np.zeros(2)).states[0].u, start.u)
