"""Coulomb friction on rigid obstacles: derivatives, a dragged and a tilted block, and where energy goes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mu_addon.errors import ConvergenceError, InputError
from mu_addon.fem.dead_loads import gravity
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Plane, Pose, Sphere
from mu_addon.fem.state import rest
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.fem.trajectory import simulate

from .bodies import box, hollow_box, touching
from .derivatives import assert_consistent
from .test_obstacle import RIGID

E, NU, MU = 1.0, 0.3, 0.3
LID = Plane((0, 0, 1), (0, 0, -1))


def along(time_s, places):
    """A path of poses, straight between places (k, 3) in mm at times (k,) in s."""
    return lambda t: Pose(shift=[np.interp(t, time_s, np.asarray(places)[:, i]) for i in range(3)])


def simulated_in_time(equilibrium, time_s, pressure_kPa=None):
    """States at instants, and what the first obstacle's contact was at each."""
    found = []
    (obstacle,) = equilibrium.model.obstacles
    pressure = np.zeros(len(time_s)) if pressure_kPa is None else pressure_kPa
    motion = simulate_in_time(
        equilibrium, time_s, pressure, lambda state: found.append(obstacle.contact(state.u))
    )
    return motion.states, found


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("rigid", RIGID)
def test_force_and_tangent_are_derivatives_of_the_energy(rigid, order):
    """The obstacle turned and moved since the last committed state; points stick, slide, come and go.

    Depths are on both sides of that up to which the penalty grows; the tangent goes through its sparsity.
    """
    mesh = box((2, 2, 2), order=order, jiggle=0.2, clamp=True)
    obstacle = Obstacle(mesh, rigid, 0.3, 0.02, friction=0.4, stick_mm=0.01)
    eq = touching(mesh, obstacle)
    model, m = eq.model, eq.parameters
    random = np.random.default_rng(0)
    before, u = (0.02 * random.standard_normal(mesh.nodes.shape) for _ in range(2))
    obstacle.update_lag(before)
    model.commit(before, m)
    obstacle.pose = Pose(Rotation.from_rotvec((0.01, -0.02, 0.015)).as_matrix(), (0.02, -0.03, 0.05))
    obstacle.update_lag(u + 0.005 * random.standard_normal(u.shape))
    assert 0.05 < obstacle.contact(u).sticking < 0.95
    assert obstacle.deepest_mm(u) > 0.02
    assert_consistent(model, m, u, random, 1e-7)


def test_a_dragged_block_resists_with_mu_times_the_normal_force():
    """A lid pressed on a block, then drawn aside: its friction, what it slides and what that costs."""
    mesh = box((3, 3, 3), clamp=True)
    path = along([0, 1, 2, 3], [(0, 0, 0), (0, 0, -0.05), (0.3, 0, -0.05), (0.4, 0, -0.05)])
    obstacle = Obstacle(mesh, LID, 0.05, 0.002, friction=MU, path=path)
    _, contacts = simulated_in_time(touching(mesh, obstacle), np.linspace(0, 3, 31))
    pressed, drawn, last = contacts[10], contacts[20], contacts[30]
    assert pressed.sticking == 1.0
    assert pressed.lost_mJ < 1e-9
    np.testing.assert_allclose(pressed.tangential_N, 0, atol=2e-3 * pressed.normal_N[2])
    assert drawn.sticking == last.sticking == 0.0
    # The lid pushes the body along +x, so the body holds it back.
    np.testing.assert_allclose(
        last.tangential_N, [-MU * last.normal_N[2], 0, 0], atol=1e-4 * last.normal_N[2]
    )
    # From then on the body stays, and every point slides as far as the lid goes.
    slid = last.slid_mm - drawn.slid_mm
    assert ((slid == 0) | (last.slid_mm > 0.1)).all()
    np.testing.assert_allclose(slid[slid > 0], 0.1, rtol=2e-3)
    lost = MU * last.normal_N[2] * 0.1
    assert last.lost_mJ - drawn.lost_mJ == pytest.approx(lost, rel=1e-3)


def test_a_stored_memory_gives_the_forces_back():
    """Of points that stick as of those that slide: a run that was killed goes on from it."""
    mesh = box((3, 3, 3), clamp=True)
    path = along([0, 1, 2], [(0, 0, 0), (0, 0, -0.05), (0.05, 0, -0.05)])
    drawn, again = (Obstacle(mesh, LID, 0.05, 0.002, friction=MU, path=path) for _ in range(2))
    states, contacts = simulated_in_time(touching(mesh, drawn), np.linspace(0, 2, 5))
    assert 0.0 < contacts[-1].sticking < 1.0
    again.move(2.0)
    again.restore(states[-1].u, drawn.kept())
    np.testing.assert_allclose(
        again.contact(states[-1].u).tangential_N, contacts[-1].tangential_N, rtol=1e-12, atol=1e-15
    )


def test_a_stored_memory_knows_what_slid_though_the_lid_has_left():
    mesh = box((3, 3, 3), clamp=True)
    path = along([0, 1, 2, 3], [(0, 0, 0), (0, 0, -0.05), (0.3, 0, -0.05), (0.3, 0, 0.05)])
    drawn, again = (Obstacle(mesh, LID, 0.05, 0.002, friction=MU, path=path) for _ in range(2))
    states, contacts = simulated_in_time(touching(mesh, drawn), np.linspace(0, 3, 7))
    assert contacts[-1].area_mm2 == 0.0
    assert contacts[-1].slid_mm.max() > 0.1
    again.restore(states[-1].u, drawn.kept())
    np.testing.assert_array_equal(again.contact(states[-1].u).slid_mm, contacts[-1].slid_mm)


def test_a_turned_lid_is_held_by_the_moment_of_its_pressure():
    """About its middle: mu N times the mean distance of a square's points from its centre, 0.3826 sides."""
    mesh = box((4, 4, 2), (1, 1, 0.5), clamp=True)

    def path(t):
        turn = Rotation.from_rotvec((0, 0, 0.6 * max(t - 1, 0))).as_matrix()
        centre = np.array([0.5, 0.5, -0.5 - 0.02 * min(t, 1)])
        return Pose(turn, centre - turn @ (0.5, 0.5, 0))

    obstacle = Obstacle(mesh, LID, 0.05, 0.002, friction=MU, path=path)
    # Without a Poisson's ratio the clamped base leaves the pressure uniform.
    states, contacts = simulated_in_time(touching(mesh, obstacle, poisson=0.0), np.linspace(0, 2, 11))
    nodes, forces = obstacle.forces(states[-1].u)
    arm = (mesh.nodes + states[-1].u)[nodes] - (0.5, 0.5, 0)
    mean = (np.sqrt(2) + np.arcsinh(1)) / 6
    held = -MU * contacts[-1].normal_N[2] * mean
    assert np.cross(arm, forces)[:, 2].sum() == pytest.approx(held, rel=0.01)
    np.testing.assert_allclose(contacts[-1].tangential_N, 0, atol=1e-3 * contacts[-1].normal_N[2])


def test_the_angle_at_which_a_block_slides():
    """A block lies free on a plane and its weight tilts: below atan(mu) it stays, and does not creep."""
    side, high, mu = 1.0, 0.5, 0.5
    mesh = box((3, 3, 2), (side, side, high))
    shares = gravity(mesh, 2e-7, np.array([0.0, 0.0, 1.0]))[:, 2]
    weight, deep = shares.sum(), 1e-4
    obstacle = Obstacle(mesh, Plane((0, 0, 0), (0, 0, 1)), weight / side**2, deep, friction=mu)
    eq = touching(mesh, obstacle)

    def tilted(degrees, u):
        t = np.radians(degrees)
        eq.model.load = np.outer(shares, [np.sin(t), 0.0, -np.cos(t)])
        return eq.newton(u, 0.0)

    # Nothing else holds the block: it must touch from the start.
    state = rest(mesh)
    sunk = state.u - (0, 0, deep)
    obstacle.begin(sunk)
    limit = np.degrees(np.arctan(mu))
    state = tilted(0.0, sunk)
    eq.model.commit(state.u, eq.parameters)
    assert obstacle.contact(state.u).normal_N[2] == pytest.approx(-weight, rel=1e-6)
    for degrees in (10.0, 20.0, 0.98 * limit):
        state = tilted(degrees, state.u)
        eq.model.commit(state.u, eq.parameters)
    held = state
    for _ in range(20):
        state = tilted(0.98 * limit, state.u)
        eq.model.commit(state.u, eq.parameters)
    assert np.abs(state.u - held.u).max() < 1e-9
    # What the contact gives before it slides; the block rocks, as the penalty gives, too.
    assert np.abs(held.u[:, 0]).max() < 10 * deep
    memory, holds, slides = obstacle.memory, 0.98 * limit, 1.02 * limit
    while slides - holds > 1e-3:
        middle = (holds + slides) / 2
        obstacle.recall(memory)
        try:
            tilted(middle, state.u)
            holds = middle
        except ConvergenceError:
            slides = middle
    assert holds == pytest.approx(limit, rel=1e-4)


def cycle(friction, steps):
    """A ball presses on a pressurised hollow box, slides on it and leaves; the pressure rises and falls.

    Work done by ball and pressure, energy stored beyond rest's, and energy lost, at every instant, in mJ.
    """
    mesh = hollow_box(1, 4, 4.0)
    # Nothing of it is retraced: the ball leaves elsewhere, and the pressure falls before.
    path = along(
        [0, 1, 2, 3, 4], [(0, 0, 0), (0, 0, -0.4), (0.8, 0.2, -0.4), (0.8, 0.2, -0.4), (1.6, 0.2, 0.1)]
    )
    ball = Obstacle(mesh, Sphere((1.6, 1.9, 5.0), 1.0), 0.3, 0.02, 1, friction=friction, path=path)
    eq = touching(mesh, ball)
    time = np.linspace(0, 4, 4 * steps + 1)
    pressure = np.interp(time, [0, 1, 2, 3, 4], [0, 20, 20, 0, 0])
    volume, force, stored, lost = [], [], [], []
    model, m = eq.model, eq.parameters

    def on_state(state):
        force.append(ball.contact(state.u).force_N)
        lost.append(ball.contact(state.u).lost_mJ)
        volume.append(model.cavity_volume(state.u))
        stored.append(model.potential(state.u, 0.0, m))

    simulate_in_time(eq, time, pressure, on_state)
    shifts = np.array([path(t).shift for t in time])
    force = np.array(force)
    by_ball = -((force[1:] + force[:-1]) / 2 * np.diff(shifts, axis=0)).sum(axis=1)
    by_pressure = (pressure[1:] + pressure[:-1]) / 2e3 * np.diff(volume)
    work = np.concatenate([[0.0], np.cumsum(by_ball + by_pressure)])
    return work, np.array(stored), np.array(lost)


def test_without_friction_a_cycle_gives_its_work_back():
    """To second order of the steps, by which the work is a sum; what is stored is gone to rounding."""
    errors = []
    for steps in (8, 16):
        work, stored, lost = cycle(0.0, steps)
        errors.append(np.abs(work - stored).max() / stored.max())
        assert (lost == 0).all()
        assert stored[-1] < 1e-9 * stored.max()
    assert errors[1] < 0.4 * errors[0]
    assert errors[1] < 2e-3


def test_with_friction_a_cycle_loses_what_sliding_costs():
    errors = []
    for steps in (8, 16):
        work, stored, lost = cycle(MU, steps)
        errors.append(np.abs(work - stored - lost).max() / stored.max())
        assert stored[-1] < 1e-9 * stored.max()
    assert lost[-1] > stored.max()
    assert errors[1] < 0.4 * errors[0]
    assert work[-1] == pytest.approx(lost[-1], rel=0.02)


def test_what_comes_nearer_aslant_does_not_rub_before_it_touches():
    """In one step, most of it in the air, friction is not that of the whole way; in many it converges."""
    mesh = box((2, 2, 2), clamp=True)
    ways = along([-4, 0, 1], [(-1.6, 0, 0.8), (0, 0, 0), (0.04, 0, -0.02)])

    def rubbed(*times):
        lid = Obstacle(mesh, LID, 0.05, 1e-4, friction=MU, stick_mm=1.0, path=ways)
        return simulated_in_time(touching(mesh, lid), np.array(times))[1][-1].tangential_N[0]

    alone, fine = rubbed(0, 1), rubbed(*np.linspace(-0.1, 1, 12))
    assert fine == pytest.approx(alone, rel=0.02)
    # What a first step in contact misses is what it rubs there.
    assert alone < rubbed(-4, 1) <= 0
    assert rubbed(-0.05, 0.05, 1) == pytest.approx(alone, rel=0.1)


def test_a_body_that_rubs_is_marched_and_bad_friction_refused():
    mesh = box((1, 1, 1), clamp=True)
    eq = touching(mesh, Obstacle(mesh, LID, 0.05, 0.01, friction=MU))
    with pytest.raises(InputError, match="depends on its history"):
        simulate(eq, np.arange(2.0), np.zeros(2))
    with pytest.raises(InputError, match="friction coefficient of -0"):
        Obstacle(mesh, LID, 0.05, 0.01, friction=-0.1)
    with pytest.raises(InputError, match="that 0 mm of slip"):
        Obstacle(mesh, LID, 0.05, 0.01, friction=0.1, stick_mm=0.0)
