"""Chains of beams: closed forms, the elastica, frame indifference, derivatives, reach."""

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from mu_addon.chain import Chain, Link, Loads, Shape, reach_point
from mu_addon.chain.chain import GRAVITY_N_PER_G
from mu_addon.chain.joint_learning import Learned
from mu_addon.chain.rigid_motion import exponential
from mu_addon.chain.unit_between_plates import frame
from mu_addon.errors import ConvergenceError, InputError

from ..fem.bodies import box
from .beams import beam

DOWN = np.array([0.0, 0.0, 1.0])


def elastica(load):
    """Tip (across, along) of a cantilever of length and stiffness 1 under a load across it, by shooting."""

    def over(moment):
        def rates(_, y):
            return [np.sin(y[2]), np.cos(y[2]), y[3], -load * np.cos(y[2])]

        return solve_ivp(rates, (0, 1), [0, 0, 0, moment], rtol=1e-10, atol=1e-12).y[:, -1]

    moment = brentq(lambda m: over(m)[3], 0.0, load)
    return over(moment)[:2]


def test_small_loads_bend_a_chain_as_a_cantilever():
    # Links of constant curvature see the moment at their middles: P L^3/3 EI (1 - 1/4 n^2)
    length, bending, force = 100.0, 1e3, 1e-4
    for n in (1, 2, 5):
        chain = Chain([Link(beam(length / n, bending))] * n, Loads(tip_force_N=np.array([0.0, force, 0.0])))
        wanted = force * length**3 / (3 * bending) * (1 - 1 / (4 * n**2))
        assert chain.at_rest().tip_mm[1] == pytest.approx(wanted, rel=1e-4)


def test_a_drawn_unit_ends_on_its_plate_at_pressures_between_those_learned():
    length, turns = 40.0, (0.0, 90.0)
    joint = beam(length, 1e3, curvature=0.03)
    mesh = box((1, 1, 4), (6.0, 6.0, length), clamp=True)
    mesh = attrs.evolve(mesh, tip=np.flatnonzero(mesh.nodes[:, 2] == length))
    free = [
        np.array([(exponential(z / length * eta0) @ [x, y, 0.0, 1.0])[:3] for x, y, z in mesh.nodes])
        - mesh.nodes
        for eta0 in joint.eta0
    ]
    shape = Shape(turns, (mesh, mesh), (Learned(joint, (), np.array(free)),) * 2)
    chain = Chain([Link(joint, turn) for turn in turns])
    still = chain.at_rest()
    np.testing.assert_allclose(shape.places(still), shape.mesh().nodes, atol=1e-9)
    for pressures in ([5.0, 3.0], [10.0, 7.5]):
        state = chain.reach(still, np.array(pressures))
        units = np.split(shape.places(state), 2)
        for turn, places, plate in zip(turns, units, state.plates[1:], strict=True):
            own = plate @ frame(turn)
            wanted = (mesh.nodes[mesh.tip] - [0.0, 0.0, length]) @ own[:3, :3].T + own[:3, 3]
            np.testing.assert_allclose(places[mesh.tip], wanted, atol=1e-6)
    # What swells at 10 kPa has swollen by half of that at 5 kPa.
    swollen = free[1] + 0.1 * mesh.nodes * (mesh.nodes[:, 2:] == length / 2) * [1.0, 0.0, 0.0]
    other = Shape((0.0,), (mesh,), (Learned(joint, (), np.array([free[0], swollen])),))
    state = Chain([Link(joint)]).reach(Chain([Link(joint)]).at_rest(), np.array([5.0]))
    grown = other.places(state) - attrs.evolve(other, learned=shape.learned[:1]).places(state)
    np.testing.assert_allclose(np.linalg.norm(grown, axis=1), 0.5 * np.linalg.norm(swollen - free[1], axis=1))


def test_chains_of_more_and_more_links_come_to_the_elastica():
    wanted = 100.0 * elastica(10.0)
    errors = []
    for n in (4, 8):
        chain = Chain([Link(beam(100.0 / n, 1e3))] * n, Loads(tip_force_N=np.array([0.0, 1.0, 0.0])))
        errors.append(np.linalg.norm(chain.at_rest().tip_mm[1:] - wanted))
    assert errors[1] < 0.4
    # Second order in the length of a link.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_a_couple_rolls_a_chain_to_a_circle():
    # Of any number of links, since constant curvature is what a link can have.
    couple = 2.0 * np.pi / 3 * 1e3 / 100.0
    chain = Chain([Link(beam(50.0, 1e3))] * 2, Loads(tip_couple_N_mm=np.array([couple, 0.0, 0.0])))
    radius = 100.0 / (2.0 * np.pi / 3)
    wanted = [0.0, -radius * (1 - np.cos(2 * np.pi / 3)), radius * np.sin(2 * np.pi / 3)]
    state = chain.at_rest()
    np.testing.assert_allclose(state.tip_mm, wanted, atol=1e-6)
    assert state.angle_deg == pytest.approx(120.0, abs=1e-6)


def test_a_hanging_chain_stretches_by_what_hangs_on_each_link():
    axial, mass, tip = 10.0, 20.0, 30.0
    chain = Chain([Link(beam(75.0, 1e3, axial=axial, mass_g=mass))] * 3, Loads(down=DOWN, tip_mass_g=tip))
    # The centre of mass of a link moves by half its stretch.
    below = np.array([2.5, 1.5, 0.5]) * mass + tip
    wanted = 225.0 + (below * GRAVITY_N_PER_G * 75.0 / axial).sum()
    assert chain.at_rest().tip_mm[2] == pytest.approx(wanted, rel=1e-9)


def test_a_standing_column_that_buckles_is_refused_and_a_hanging_one_is_not():
    links = [Link(beam(25.0, 1e3))] * 4
    critical = np.pi**2 * 1e3 / (4 * 100.0**2)
    stands = Chain(links, Loads(tip_force_N=np.array([0.0, 0.0, -0.9 * critical])))
    assert stands.at_rest().tip_mm[2] == pytest.approx(100.0, abs=0.1)
    falls = Chain(links, Loads(tip_force_N=np.array([0.0, 0.0, -1.1 * critical])))
    p = np.zeros(4)
    state = falls.free_plates(p)
    with pytest.raises(ConvergenceError, match="unstable"):
        falls.newton(state, p)
    hangs = Chain(links, Loads(tip_force_N=np.array([0.0, 0.0, 5 * critical])))
    assert hangs.at_rest().angle_deg == pytest.approx(0.0, abs=1e-6)


def loaded_chain(turn=0.0):
    links = [
        Link(beam(60.0, 900.0, 700.0, 30.0, 40.0, mass_g=15.0, curvature=0.004), turn + 20.0),
        Link(beam(75.0, 700.0, 500.0, 40.0, 30.0, mass_g=20.0, curvature=-0.003), turn + 130.0),
    ]
    a = np.radians(turn)
    r = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    loads = Loads(r @ [0.6, 0.0, 0.8], 10.0, r @ [0.02, -0.03, 0.05])
    return Chain(links, loads), r


def test_residual_and_tangent_are_derivatives_of_the_potential():
    chain, _ = loaded_chain()
    p = np.array([7.0, 4.0])
    at = chain.joints_at(p)
    rng = np.random.default_rng(3)
    plates = chain.plates_of(
        np.array([joint.eta0 for joint in at]) + rng.normal(size=(2, 6)) * [0.2, 0.2, 0.2, 3, 3, 3]
    )
    from mu_addon.chain.chain import moved

    def shifted(step):
        found = plates.copy()
        for k in range(2):
            found[k + 1] = moved(plates[k + 1], step[None, 6 * k : 6 * k + 6])[0]
        return found

    h = 1e-4
    residual = chain.residual(plates, at, chain.loads)
    for k in range(12):
        step = np.zeros(12)
        step[k] = h
        ends = [chain.potential(shifted(s * step), at, chain.loads) for s in (1.0, -1.0)]
        assert residual[k] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-5, abs=1e-5)


def test_the_tangent_is_symmetric_in_equilibrium():
    chain, _ = loaded_chain()
    state = chain.reach(chain.at_rest(), np.array([10.0, 5.0]))
    k = chain.tangent(state.plates, chain.joints_at(state.pressures_kPa), chain.loads)
    np.testing.assert_allclose(k, k.T, atol=1e-6 * np.abs(k).max())


def test_a_chain_turned_with_its_loads_moves_as_before():
    p = np.array([10.0, 5.0])
    first, _ = loaded_chain()
    turned, r = loaded_chain(turn=73.0)
    one, other = (chain.reach(chain.at_rest(), p) for chain in (first, turned))
    np.testing.assert_allclose(other.tip_mm, r @ one.tip_mm, atol=1e-6)
    np.testing.assert_allclose(other.plates[-1, :3, :3] @ r, r @ one.plates[-1, :3, :3], atol=1e-8)


def test_the_work_of_a_slowly_grown_load_is_the_potential_gained():
    link = Link(beam(50.0, 1e3, mass_g=0.0))
    force, work, before = np.array([0.3, 0.4, 0.0]), 0.0, None
    shares = np.linspace(0.0, 1.0, 21)
    for share in shares:
        chain = Chain([link] * 2, Loads(tip_force_N=share * force))
        state = chain.at_rest()
        if before is not None:
            work += (share + before[0]) / 2 * float(force @ (state.tip_mm - before[1]))
        before = share, state.tip_mm
    stored = chain.potential(state.plates, chain.joints_at(np.zeros(2)), Loads())
    assert work == pytest.approx(stored, rel=2e-3)


def test_a_free_chain_bends_by_its_units_curvatures():
    chain = Chain([Link(beam(50.0, 1e3, curvature=0.01)), Link(beam(50.0, 1e3, curvature=0.01), 180.0)])
    bent = chain.reach(chain.at_rest(), np.array([10.0, 0.0]))
    assert bent.angle_deg == pytest.approx(np.degrees(0.5), abs=1e-6)
    # A unit that is turned half round undoes what the one before it did.
    both = chain.reach(bent, np.array([10.0, 10.0]))
    assert both.angle_deg == pytest.approx(0.0, abs=1e-6)
    assert both.tip_mm[1] == pytest.approx(-2 * (1 - np.cos(0.5)) / 0.01, rel=1e-6)


def test_reach_finds_pressures_that_were_used_to_make_the_point():
    links = [Link(beam(50.0, 1e3, mass_g=5.0, curvature=0.01), turn) for turn in (0.0, 90.0, 200.0)]
    chain = Chain(links, Loads(down=DOWN, tip_mass_g=5.0))
    state = chain.reach(chain.at_rest(), np.array([6.0, 3.0, 8.0]))
    found = reach_point(chain, state.tip_mm)
    assert found.miss_mm < 1e-3
    again = chain.reach(chain.at_rest(), found.pressures_kPa)
    np.testing.assert_allclose(again.tip_mm, state.tip_mm, atol=2e-3)


def test_a_point_out_of_reach_is_missed_at_a_bound():
    chain = Chain([Link(beam(50.0, 1e3, curvature=0.01))])
    found = reach_point(chain, np.array([0.0, -80.0, 40.0]))
    assert found.at_bound.all()
    assert found.miss_mm > 30.0


def test_an_error_of_a_joint_spreads_to_the_tip_as_a_random_load_would():
    error = np.zeros((6, 6))
    error[0, 0] = 2.0**2
    joint = beam(50.0, 1e3, error=error)
    state = Chain([Link(joint)]).at_rest()
    # A moment of 2 N mm turns a beam of EI/L = 20 N mm by 0.1 rad.
    assert state.angle_error_deg == pytest.approx(1.96 * np.degrees(0.1), rel=1e-4)
    assert state.tip_error_mm[1] == pytest.approx(1.96 * 0.1 * 25.0, rel=1e-4)


def test_loads_beyond_what_a_joint_was_learned_for_are_refused_with_words():
    chain = Chain([Link(beam(50.0, 1e3, range_=0.1))], Loads(tip_force_N=np.array([0.0, 2.0, 0.0])))
    with pytest.raises(ConvergenceError, match="times as far as its joint was learned"):
        chain.at_rest()
    with pytest.raises(InputError, match="beyond the 0 to 10 kPa"):
        chain.joints_at(np.array([11.0]))
    with pytest.raises(InputError, match="2 pressures for 1 units"):
        chain.joints_at(np.array([1.0, 2.0]))
    with pytest.raises(InputError, match="a chain of 0 units"):
        Chain([])


def test_joint_between_pressures_follows_its_free_state():
    joint = beam(50.0, 1e3, curvature=0.01)
    at = joint.at(5.0)
    np.testing.assert_allclose(at.gradient(at.eta0), 0.0, atol=1e-12)
    assert exponential(at.eta0)[2, 2] == pytest.approx(np.cos(0.25))
