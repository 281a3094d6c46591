"""A motion in the order of its protocol, and what is read off it over time."""

import attrs
import numpy as np
import pytest

from mu_addon.fem import Equilibrium, Model, State, simulate, simulate_in_time
from mu_addon.fem.trajectory import Trajectory

from . import bodies

# A sine that starts, turns and ends at pressures met before.
PRESSURE = np.array([0.0, 5.0, 3.0, -4.0, 3.0, 0.0])
TIME = np.arange(6.0)


def test_states_and_volumes_come_in_the_order_of_the_protocol():
    mesh = bodies.hollow_box(1, n=3)
    body = Equilibrium(Model(mesh), bodies.uniform(mesh, 0.3, 0.4))
    motion = simulate(body, TIME, PRESSURE)
    np.testing.assert_allclose([s.pressure_kPa for s in motion.states], PRESSURE)
    assert [s.pressure_kPa for s in motion.solved] == pytest.approx([-4.0, 0.0, 3.0, 5.0])
    volume = motion.volume_mm3
    assert volume[3] < volume[0] == volume[5] < volume[2] == volume[4] < volume[1]
    np.testing.assert_allclose(volume, [body.model.cavity_volume(s.u) for s in motion.states], rtol=1e-12)
    # One that remembers is ordered alike.
    in_time = simulate_in_time(body, TIME, PRESSURE)
    np.testing.assert_allclose(in_time.volume_mm3, volume, rtol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_the_volume_is_the_whole_bodys(order):
    mesh = bodies.sphere_octant(around=8, order=order)
    rest = State(0.0, np.zeros_like(mesh.nodes))
    motion = Trajectory(np.zeros(1), np.zeros(1), (rest,), np.zeros(1, int), mesh)
    exact = 4 / 3 * np.pi * 10.0**3
    assert motion.volume_mm3[0] == pytest.approx(exact, rel=2e-2 if order == 1 else 1e-4)


def test_angle_and_tip_of_a_half_that_turns_are_the_whole_bodys():
    """The end plane of a column turned by known angles about its base, plus a shift."""
    half = bodies.box((2, 4, 10), (2.0, 4.0, 10.0), symmetry=("x",), clamp=True)
    top = np.flatnonzero(half.nodes[:, 2] == 10.0).astype(np.int32)
    mesh = attrs.evolve(half, tip=top)
    turn = np.radians([20.0, -7.0, 0.0])
    states = []
    for angle in turn:
        y, z = mesh.nodes[:, 1], mesh.nodes[:, 2]
        u = np.zeros_like(mesh.nodes)
        u[:, 1] = y * np.cos(angle) + z * np.sin(angle) - y
        u[:, 2] = z * np.cos(angle) - y * np.sin(angle) - z + 1.0
        states.append(State(1e-3 * angle, u))
    motion = Trajectory(np.arange(4.0), np.zeros(4), tuple(states), np.array([2, 0, 1, 0]), mesh)
    order = turn[[2, 0, 1, 0]]
    np.testing.assert_allclose(motion.angle_deg, np.degrees(order), atol=1e-9)
    middle = mesh.nodes[top, 1].mean()
    expected = [
        np.zeros(4),
        middle * np.cos(order) + 10.0 * np.sin(order),
        10.0 * np.cos(order) - middle * np.sin(order) + 1.0,
    ]
    np.testing.assert_allclose(motion.tip_mm, np.transpose(expected), atol=1e-9)
