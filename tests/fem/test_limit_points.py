"""Limit points: where load stepping ends, and how damped motion goes on beyond."""

import re

import attrs
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from mu_addon.errors import ConvergenceError
from mu_addon.fem import time_stepping
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import BODY_OBSTACLE_NEWTON, NewtonSettings
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Plane, Pose
from mu_addon.fem.state import rest
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.meshing.mesh import boundary_faces, edges_of

from . import bodies

A, B, NU = 10.0, 11.0, 0.499


def equilibrium(mesh, modulus, poisson, held=None, **options):
    model = Model(mesh, supports=held, threads=1)
    return Equilibrium(model, bodies.uniform(mesh, modulus, poisson), NewtonSettings(**options))


def balloon(around=3):
    """A hollow sphere of shear modulus 1 MPa."""
    mesh = bodies.sphere_octant(A, B, around)
    return mesh, equilibrium(mesh, 2 * (1 + NU), NU, max_step_MPa=0.05)


def pressure_of(a):
    """Of an incompressible neo-Hookean sphere, mu = 1, whose inner radius has grown a-fold."""
    b = (1 + (a**3 - 1) * (A / B) ** 3) ** (1 / 3)
    return 2 * ((1 / b + 1 / (4 * b**4)) - (1 / a + 1 / (4 * a**4)))


def arch(cells=12, radius=50.0, half_angle=25.0, thickness=1.5, width=4.0):
    """Half a clamped shallow arch in plane strain; its underside is the cavity's wall, its crown at x = 0."""
    nodes, tets = bodies._grid((cells, 1, 1), (1, 1, 1))
    end = np.deg2rad(half_angle)

    def bend(p):
        r, angle = radius + thickness * (p[:, 1] - 0.5), end * p[:, 0]
        out = np.stack([r * np.sin(angle), r * np.cos(angle) - radius, width * p[:, 2]], axis=1)
        out[np.abs(out) < 1e-9] = 0.0
        return out

    edges, _ = edges_of(tets)
    middles = bend(nodes[edges].mean(axis=1))
    faces, _ = boundary_faces(tets)
    under = faces[(nodes[faces][:, :, 1] == 0).all(axis=1)]

    def clamped(p):
        return abs(np.arctan2(p[0], p[1] + radius) - end) < 1e-6

    return bodies.make(bend(nodes), tets, 2, under, (clamped,), ("x", "z"), lambda m, e: middles)


def far_side(mesh):
    """Supports that hold the face opposite the mirror plane z = 0 in z: plane strain."""
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = mesh.nodes[:, 2] == mesh.nodes[:, 2].max()
    return held


def crown(mesh):
    on = np.flatnonzero((mesh.nodes[:, 0] == 0) & (mesh.nodes[:, 2] == 0))
    return on[mesh.nodes[on, 1].argmax()]


def test_a_balloon_follows_its_closed_form_up_to_its_limit_point():
    """Beyond the peak of the closed form there is no equilibrium: the path ends there, and says where."""
    mesh, body = balloon()
    empty = body.model.cavity_volume(np.zeros_like(mesh.nodes))
    found = []
    with pytest.raises(ConvergenceError, match="limit point") as ended:
        body.path(np.arange(0.01, 0.2, 0.01), rest(mesh), found.append)
    stretch = np.array([body.model.cavity_volume(s.u) / empty for s in found]) ** (1 / 3)
    pressure = np.array([s.pressure_MPa for s in found])
    np.testing.assert_allclose(pressure, pressure_of(stretch), rtol=0.005)
    peak = -minimize_scalar(lambda a: -pressure_of(a), bounds=(1.05, 3), method="bounded").fun
    last = float(re.search(r"last converged state is ([\d.]+) kPa", ended.value.where)[1])
    assert last == pytest.approx(1e3 * peak, rel=0.005)


def test_damped_motion_turns_an_arch_over_that_bears_its_load_no_more():
    """From its midline's mirror image, which is on the other side already, it comes to the same state."""
    mesh = arch()
    body = equilibrium(mesh, 1.0, 0.3, far_side(mesh))
    model = body.model
    model.load = np.zeros_like(mesh.nodes)
    model.load[crown(mesh), 1] = -0.01
    with pytest.raises(ConvergenceError):
        body.newton(rest(mesh).u, 0.0, reach_mm=1.0)
    found = body.settled(rest(mesh).u, 0.0)
    feet = mesh.nodes[mesh.base, 1].mean()
    turned = np.zeros_like(mesh.nodes)
    turned[:, 1] = 2 * (feet + 50.0 - np.sqrt(50.0**2 - mesh.nodes[:, 0] ** 2))
    turned[mesh.base] = 0.0
    over = body.settled(turned, 0.0)
    assert found.u[crown(mesh), 1] < 1.5 * feet
    assert np.abs(found.u - over.u).max() < 1e-6
    assert body.newton(found.u, 0.0).iterations == 0


@pytest.mark.slow
def test_a_motion_in_time_goes_on_beyond_a_limit_point(monkeypatch):
    """A loaded arch whose prop is drawn away at once turns over and falls on it, lower down."""
    # Newton's method would find the arch on the other side by itself, and not tell.
    monkeypatch.setattr(time_stepping, "LEAP", 1e-3)
    mesh = arch()
    mesh = attrs.evolve(mesh, cavity=mesh.cavity[:0])
    model = Model(mesh, supports=far_side(mesh), threads=1)
    prop = Obstacle(
        mesh,
        Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)),
        4e-4,
        0.01,
        friction=0.3,
        path=lambda t: Pose(shift=(0.0, -5.0 * (t > 1.0), 0.0)),
    )
    model.obstacles = (prop,)
    model.load = np.zeros_like(mesh.nodes)
    model.load[crown(mesh), 1] = -0.01
    body = Equilibrium(model, bodies.uniform(mesh, 1.0, 0.3), BODY_OBSTACLE_NEWTON)
    times, none = np.array([0.0, 1.0, 2.0]), np.zeros(3)
    before, _, after = simulate_in_time(body, times, none).states
    assert before.snapped_mm == 0.0
    assert after.snapped_mm > 3.0
    contact = prop.contact(after.u)
    assert contact.normal_N[1] < -1e-3
    assert np.hypot(*contact.tangential_N[[0, 2]]) < 0.3 * -contact.normal_N[1]
    reaction = model.residual(after.u, 0.0, body.parameters)[mesh.base, 1].sum()
    assert reaction - contact.force_N[1] == pytest.approx(0.01, rel=1e-6)
    # Without friction there is one place to lie, whatever the way there.
    prop.friction = 0.0
    again, otherwise = (body.settled(state.u, 0.0) for state in (after, before))
    assert np.abs(again.u - otherwise.u).max() < 1e-6
    prop.friction, body.settings = 0.3, attrs.evolve(body.settings, follow_snaps=False)
    with pytest.raises(ConvergenceError, match="no equilibrium at"):
        simulate_in_time(body, times, none)
