"""Self-contact: a potential and its derivatives, steps that end before a touch, bodies that close."""

import sys

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.dead_loads import traction
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.outer_faces import outer_faces
from mu_addon.fem.rigid import Plane, Pose
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.self_intersection import crossings
from mu_addon.fem.state import rest

from . import bodies
from .bodies import uniform
from .derivatives import assert_consistent
from .test_self_intersection import GAP, fork, lean, pouch

pytest.importorskip("ipctk")

E, NU = 1.0, 0.3
D, K = 0.05, 0.1


def plates(order=1, apart=0.5):
    """Two blocks of 2 x 2 x 1 on each other, of unlike meshes."""
    return bodies.stacked(4, 5, 2.0, (0.0, 0.0, 1.0 + apart), order)


def body(mesh, gap=D, stiffness=K, supports=None, material=(E, NU), friction=0.0):
    model = Model(mesh, supports, threads=1)
    model.self_contact = SelfContact(mesh, gap, stiffness, friction)
    return Equilibrium(model, uniform(mesh, *material), SELF_CONTACT_NEWTON)


def onto_mirror(depth=0.02):
    """A box that stands 0.2 off its mirror plane x = 0, and the displacement that brings it near."""
    mesh = bodies.box((2, 2, 2), symmetry=("x",))
    mesh = attrs.evolve(mesh, nodes=mesh.nodes + np.array([0.2, 0.0, 0.0]))
    return mesh, np.tile([depth - 0.2, 0.0, 0.0], (len(mesh.nodes), 1))


@pytest.mark.parametrize("order", [1, 2])
def test_force_and_tangent_are_derivatives_of_the_energy(order):
    mesh = fork(order)
    eq = body(mesh)
    random = np.random.default_rng(0)
    u = lean(mesh, 0.48) + 1e-3 * random.standard_normal(mesh.nodes.shape)
    contact = eq.model.self_contact
    assert contact.count(u) > 10
    assert contact.energy_mJ(u) > 1e-6
    assert_consistent(eq.model, eq.parameters, u, random, 1e-5)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_work_of_its_forces_has_a_derivative_by_the_places_as_drawn(mirrored):
    random = np.random.default_rng(3)
    mesh, u = onto_mirror(0.04) if mirrored else (fork(2), lean(fork(2), 0.48))
    u = u + 1e-3 * random.standard_normal(u.shape)
    contact = SelfContact(mesh, 0.1 if mirrored else D, K)
    v, way = random.standard_normal((2, *u.shape))
    sides = []
    for step in (1e-6, -1e-6):
        moved = contact.relocated(attrs.evolve(mesh, nodes=mesh.nodes + step * way), contact.gap_mm, K)
        nodes, forces = moved.forces(u)
        sides.append(np.vdot(v[nodes], forces))
    _, [found] = contact.by_places(u, [v])
    assert np.vdot(found, way) == pytest.approx((sides[0] - sides[1]) / 2e-6, rel=1e-5)


def test_force_and_tangent_at_a_mirror_plane_are_derivatives_too():
    mesh, u = onto_mirror(0.04)
    eq = body(mesh, gap=0.1)
    random = np.random.default_rng(1)
    u += 1e-3 * random.standard_normal(u.shape)
    assert eq.model.self_contact.energy_mJ(u) > 1e-6
    assert_consistent(eq.model, eq.parameters, u, random, 1e-5)


def test_the_tangent_is_symmetric_and_gets_room_for_what_touches():
    mesh = fork()
    eq = body(mesh)
    model, u = eq.model, lean(mesh, 0.48)
    apart = model.tangent(rest(mesh).u, 0.0, eq.parameters)
    own, factor = model.matrix(apart), model.factor
    values = model.tangent(u, 0.0, eq.parameters)
    assert len(values) > len(apart)
    assert model.factor is not factor
    whole = model.self_contact.stiffness(u).tocsr()
    assert abs(whole - whole.T).max() < 1e-12 * abs(whole).max()
    without = Model(mesh, threads=1)
    expected = without.matrix(without.tangent(u, 0.0, without.parameters(uniform(mesh, E, NU))))
    expected = expected + whole[model.free][:, model.free]
    assert abs(model.matrix(values) - expected).max() < 1e-12 * abs(expected).max()
    # What has grown holds the rest as it was, without contact or with none left.
    model.self_contact, contact = None, model.self_contact
    for model.self_contact in (None, contact):
        assert abs(model.matrix(model.tangent(rest(mesh).u, 0.0, eq.parameters)) - own).max() == 0.0


def test_the_convex_tangent_is_the_exact_one_and_what_made_it_indefinite():
    mesh = fork()
    random = np.random.default_rng(2)
    u = lean(mesh, 0.48) + 1e-3 * random.standard_normal(mesh.nodes.shape)
    contact = SelfContact(mesh, D, K)
    touched = np.unique(contact.stiffness(u).row)
    exact, convex = (
        contact.stiffness(u, convex).tocsr()[touched][:, touched].toarray() for convex in (False, True)
    )
    assert np.linalg.eigvalsh(exact).min() < -1e-3 * abs(exact).max()
    assert np.linalg.eigvalsh(convex).min() > -1e-12 * abs(exact).max()
    assert np.linalg.eigvalsh(convex - exact).min() > -1e-12 * abs(exact).max()


def test_a_prediction_that_would_touch_is_no_start():
    mesh = fork()
    eq, none = body(mesh), rest(mesh).u
    near, through = lean(mesh, 0.3), lean(mesh, 1.2)
    assert eq.start(none, near) is near
    assert eq.start(none, through) is none


def test_a_new_path_begins_without_the_room_that_contact_took():
    mesh = fork()
    eq = body(mesh)
    own = len(eq.model.tangent(rest(mesh).u, 0.0, eq.parameters))
    assert len(eq.model.tangent(lean(mesh, 0.48), 0.0, eq.parameters)) > own
    eq.model.forget_contact()
    assert len(eq.model.tangent(rest(mesh).u, 0.0, eq.parameters)) == own


def test_what_slides_past_the_edges_of_facets_needs_no_more_room():
    mesh = plates()
    eq = body(mesh)
    down = np.where(mesh.nodes[:, 2:] > 1.2, [0.0, 0.0, -0.47], 0.0)
    aside = np.where(mesh.nodes[:, 2:] > 1.2, [1.0, 0.6, 0.0], 0.0)
    eq.model.tangent(down, 0.0, eq.parameters)
    pattern, contact = eq.model.pattern, eq.model.self_contact
    before = set(zip(*contact.stiffness(down).coords, strict=True))
    # Edges of the plates' meshes are 0.5 and 0.4 mm.
    for far in (0.05, 0.2, 0.4):
        eq.model.tangent(down + far * aside, 0.0, eq.parameters)
        assert eq.model.pattern is pattern
    assert not set(zip(*contact.stiffness(down + far * aside).coords, strict=True)) <= before


def test_what_presses_on_itself_is_in_balance():
    mesh = plates()
    contact = SelfContact(mesh, D, K)
    u = np.where(mesh.nodes[:, 2:] > 1.2, [0.0, 0.0, -0.47], 0.0)
    nodes, forces = contact.forces(u)
    assert np.abs(forces).sum() > 0.1
    assert np.abs(forces.sum(axis=0)).max() < 1e-12
    moment = np.cross((mesh.nodes + u)[nodes], forces).sum(axis=0)
    assert np.abs(moment).max() < 1e-12


@pytest.mark.parametrize("order", [1, 2])
def test_a_block_on_another_passes_on_its_pressure(order):
    """The upper block, 2 x 2 mm, bears 20 kPa, so the lower one does; the gap is what the barrier says."""
    mesh = plates(order)
    x, y, z = mesh.nodes.T
    supports = np.zeros(mesh.nodes.shape, bool)
    supports[:, :2] = True
    eq = body(mesh, supports=supports, material=(E, 0.0))
    pressure = 0.02
    faces = outer_faces(mesh).nodes
    top = faces[(z[faces] > z.max() - 1e-9).all(axis=1)]
    eq.model.load = traction(mesh, top, np.array([0.0, 0.0, -pressure]))
    state = eq.newton(np.where(mesh.nodes[:, 2:] > 1.2, [0.0, 0.0, -0.46], 0.0), 0.0)
    reaction = eq.model.residual(state.u, 0.0, eq.parameters)[mesh.base, 2].sum()
    assert reaction == pytest.approx(4.0 * pressure, rel=1e-8)
    below, above = (np.abs(z - level) < 1e-9 for level in (1.0, 1.5))
    # Sharp edges carry more than their share, since the faces beside them count as theirs.
    inside = (np.abs(x - 1) < 0.8) & (np.abs(y - 1) < 0.8)
    gap = 0.5 + state.u[above & inside, 2].mean() - state.u[below & inside, 2].mean()
    shares = np.linspace(0.01, 0.999, 1000)
    carried = -eq.model.self_contact._barrier(shares * D)[1]
    # One-sided, and three times that: two plates face each other, and their edges count beside their faces.
    least, most = (np.interp(-pressure, -factor * carried, shares) for factor in (1, 3))
    assert least < gap / D < most
    touch = eq.model.self_contact.touch(state.u)
    # Edges press sideways, too.
    assert touch.force_N == pytest.approx(4.0 * pressure, rel=1e-5)
    assert touch.gap_mm == pytest.approx(gap, rel=0.1)
    assert touch.pressure_kPa[below & inside].mean() == pytest.approx(1000 * pressure, rel=0.3)
    assert not touch.pressure_kPa[mesh.base].any()


def test_what_is_kept_of_a_search_finds_what_a_new_one_does():
    """Pairs and free steps of a surface that moves on a little, then far, against a new search."""
    mesh = fork(2)
    contact, random = SelfContact(mesh, D, K), np.random.default_rng(1)
    u = lean(mesh, 0.46)
    for size in (0.2 * D, 0.4 * D, 0.4 * D, 3.0 * D):
        to = u + size / 2 * random.uniform(-1, 1, mesh.nodes.shape)
        new = SelfContact(mesh, D, K)
        assert contact.free_share(u, to) == pytest.approx(new.free_share(u, to), rel=1e-9)
        u = u + 0.5 * contact.free_share(u, to) * (to - u)
        assert contact.count(u) == new.count(u)
        assert contact.energy_mJ(u) == pytest.approx(new.energy_mJ(u), rel=1e-12)


def test_a_plate_presses_a_block_on_another_without_a_touch():
    """Self-contact and an obstacle in one model: what the plate presses with arrives at the base."""
    mesh = plates()
    supports = np.zeros(mesh.nodes.shape, bool)
    supports[:, :2] = True
    eq = body(mesh, supports=supports, material=(E, 0.0))
    contact = eq.model.self_contact
    start = np.where(mesh.nodes[:, 2:] > 1.2, [0.0, 0.0, -0.47], 0.0)
    plate = Obstacle(
        mesh,
        Plane((0.0, 0.0, 2.03), (0.0, 0.0, -1.0)),
        0.05,
        0.01,
        friction=0.3,
        path=lambda t: Pose(shift=(0.0, 0.0, -0.1 * t)),
    )
    eq.model.obstacles = (plate,)
    assert not contact.intersects(start)
    first = eq.settled(start, 0.0)
    plate.begin(first.u)
    states = [first]
    for time in (0.5, 1.0):
        plate.move(time)
        states.append(eq.newton(states[-1].u, 0.0))
        eq.model.commit(states[-1].u, eq.parameters)
    for state in states:
        assert not contact.intersects(state.u)
    last = states[-1]
    pressed = plate.contact(last.u).normal_N[2]
    assert pressed > 0.1
    reaction = eq.model.residual(last.u, 0.0, eq.parameters)[mesh.base, 2].sum()
    assert reaction == pytest.approx(pressed, rel=1e-8)
    assert 0.0 < contact.least_gap_mm(last.u) < D


def test_nothing_crosses_its_mirror_plane():
    mesh, u = onto_mirror(-0.1)
    contact = SelfContact(mesh, D, K)
    share = contact.free_share(np.zeros_like(u), u)
    assert share == pytest.approx(0.8 * 2 / 3)
    assert contact.intersects(u)
    assert contact.least_gap_mm(0.95 * onto_mirror(0.0)[1]) == pytest.approx(0.02)


def test_a_block_on_its_mirror_image_leaves_the_gap_that_the_barrier_says():
    """The faces are apart by s where k (4 s q ln s^2 + 2 q^2/s) is the pressure, s in gaps, q = s^2 - 1."""
    mesh = bodies.box((1, 1, 1), symmetry=("x",))
    mesh = attrs.evolve(mesh, nodes=mesh.nodes + np.array([0.2, 0.0, 0.0]))
    supports = np.zeros(mesh.nodes.shape, bool)
    supports[:, 1:] = True
    eq = body(mesh, supports=supports, material=(E, 0.0))
    contact = eq.model.self_contact
    near = np.abs(mesh.nodes[:, 0] - 0.2) < 1e-9
    (plane,) = contact._planes
    touching = np.isin(plane.nodes, np.flatnonzero(near))
    s = 0.3 * D
    pressure = -contact._barrier(np.array([s]))[1]
    load = np.zeros_like(mesh.nodes)
    load[plane.nodes[touching], 0] = -pressure * plane.area[touching]
    eq.model.load = load
    start = np.tile([-0.2 + 0.02, 0.0, 0.0], (len(mesh.nodes), 1))
    state = eq.newton(start, 0.0)
    np.testing.assert_allclose(2 * (mesh.nodes + state.u)[near, 0], s, rtol=1e-6)


def test_a_vacuum_closes_a_pouch_but_never_crosses_it():
    mesh = pouch()
    eq = body(mesh, gap=0.04, material=(1.0, 0.45))
    contact = eq.model.self_contact
    free = Equilibrium(Model(mesh, threads=1), uniform(mesh, 1.0, 0.45))
    history = [rest(mesh)]
    for pressure in (-0.00005, -0.0001, -0.0002, -0.002, -0.02):
        history.append(eq.reach(pressure, history))
    states = history[1:]
    apart = [s for s in states if contact.energy_mJ(s.u) == 0.0]
    assert 0 < len(apart) < len(states)
    before = free.path([s.pressure_MPa for s in apart], rest(mesh))
    np.testing.assert_allclose(apart[-1].u, before[-1].u, atol=1e-7)
    assert not any(contact.intersects(s.u) or crossings(mesh, s.u) for s in states)
    assert crossings(mesh, free.newton(before[-1].u, states[-1].pressure_MPa).u)
    # Flat against its image: the middle has gone half the gap, but for what the barrier keeps open.
    middle = np.linalg.norm(mesh.nodes - [0.0, 0.0, GAP / 2], axis=1).argmin()
    assert -GAP / 2 < states[-1].u[middle, 2] < -GAP / 2 + 0.02


def test_a_gap_that_reaches_across_a_wall_is_refused():
    with pytest.raises(InputError, match="as drawn") as refused:
        SelfContact(fork(), 1.1, K)
    assert "smaller gap" in str(refused.value)


@pytest.mark.parametrize(("gap", "stiffness"), [(0.0, 1.0), (0.1, -1.0), (np.nan, 1.0), (np.inf, 1.0)])
def test_gap_and_stiffness_must_be_above_0(gap, stiffness):
    with pytest.raises(InputError, match="self-contact"):
        SelfContact(fork(), gap, stiffness)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipctk", None)
    with pytest.raises(InputError, match="ipctk"):
        SelfContact(fork(), D, K)
