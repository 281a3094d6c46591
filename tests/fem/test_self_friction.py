"""Friction of a body with itself: derivatives, Coulomb's law between blocks, and where energy goes."""

from functools import partial

import numpy as np
import pytest

from mu_addon.errors import ConvergenceError, InputError
from mu_addon.fem.dead_loads import traction
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.outer_faces import outer_faces
from mu_addon.fem.rigid import Plane, Pose
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.trajectory import simulate

from . import bodies
from .derivatives import assert_consistent
from .test_self_contact import D, E, K, body
from .test_self_intersection import fork, lean

pytest.importorskip("ipctk")

MU = 0.3


def stacked(below=4, above=5):
    """A block of 3 x 3 x 1 clamped at its foot, and 0.5 above it one of 2 x 2 x 1, its mesh another."""
    return bodies.stacked(below, above, 3.0, (0.5, 0.5, 1.5))


with_friction = partial(body, friction=MU)


def moved(mesh, way):
    """The upper block of `stacked` moved, the lower one at rest."""
    return np.where(mesh.nodes[:, 2:] > 1.2, np.asarray(way, float), 0.0)


@pytest.mark.parametrize("order", [1, 2])
def test_force_and_tangent_are_derivatives_of_the_energy(order):
    mesh = fork(order)
    eq = with_friction(mesh, friction=0.1)
    contact, random = eq.model.self_contact, np.random.default_rng(0)
    before, lagged, u = (
        lean(mesh, by) + 1e-3 * random.standard_normal(mesh.nodes.shape) for by in (0.48, 0.49, 0.49)
    )
    contact.commit(before)
    contact.update_lag(lagged)
    _, total = contact.forces(u)
    _, without = SelfContact(mesh, D, K).forces(u)
    assert np.abs(total - without).max() > 0.02 * np.abs(without).max()
    assert_consistent(eq.model, eq.parameters, u, random, 1e-5)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, -0.8)])
def test_a_block_that_slides_is_held_by_mu_times_its_normal_force(direction):
    """Of flat plates whose meshes do not match, with edges; friction is in balance."""
    mesh = stacked(4, 5)
    contact, plain = SelfContact(mesh, D, K, MU), SelfContact(mesh, D, K)
    pressed = moved(mesh, (0.0, 0.0, -0.47))
    contact.begin(pressed)
    aside = pressed + moved(mesh, (0.03 * direction[0], 0.03 * direction[1], 0.0))
    contact.update_lag(aside)
    nodes, forces = contact.forces(aside)
    normal = plain.forces(aside)[1]
    friction = forces - normal
    assert np.abs(friction.sum(axis=0)).max() < 1e-12
    above = mesh.nodes[nodes, 2] > 1.2
    along = friction[above].sum(axis=0) @ [*direction, 0.0]
    assert along == pytest.approx(-MU * normal[above, 2].sum(), rel=0.04)
    assert along > 0


def test_slip_too_small_to_slide_is_held_by_less():
    """2 s/e - (s/e)^2 of the bound at a slip s, e being the slip of a tenth of the gap."""
    mesh = stacked(4, 5)
    contact, plain = SelfContact(mesh, D, K, MU), SelfContact(mesh, D, K)
    pressed = moved(mesh, (0.0, 0.0, -0.46))
    shares = []
    for slip in (0.25, 0.5, 1.0, 3.0):
        contact.begin(pressed)
        aside = pressed + moved(mesh, (0.1 * D * slip, 0.0, 0.0))
        friction = contact.forces(aside)[1] - plain.forces(aside)[1]
        above = mesh.nodes[contact.forces(aside)[0], 2] > 1.2
        shares.append(friction[above, 0].sum())
    np.testing.assert_allclose(np.array(shares) / shares[-1], [0.4375, 0.75, 1.0, 1.0], rtol=2e-3)


def test_what_is_pushed_by_less_than_friction_stays_and_by_more_is_lost():
    mesh = stacked(3, 4)
    eq = with_friction(mesh, material=(E, 0.0))
    z = mesh.nodes[:, 2]
    faces = outer_faces(mesh).nodes
    top = faces[(z[faces] > z.max() - 1e-9).all(axis=1)]
    down, aside = (traction(mesh, top, np.array(t)) for t in ((0.0, 0.0, -0.02), (MU * 0.02, 0.0, 0.0)))
    supports = np.zeros(mesh.nodes.shape, bool)
    supports[:, :2] = True
    upright = Equilibrium(Model(mesh, supports, threads=1), bodies.uniform(mesh, E, 0.0), SELF_CONTACT_NEWTON)
    upright.model.self_contact, upright.model.load = SelfContact(mesh, D, K), down
    pressed = upright.newton(moved(mesh, (0.0, 0.0, -0.46)), 0.0).u
    eq.model.self_contact.begin(pressed)
    eq.model.load = down + 0.9 * aside
    held = eq.newton(pressed, 0.0).u
    foot, head = ((held - pressed)[np.abs(z - level) < 1e-9, 0].mean() for level in (1.5, 1.0))
    # The foot gives by the slip at which friction is full, and by no more.
    assert 0 < foot - head < 0.1 * D
    eq.model.load = down + 1.1 * aside
    with pytest.raises(ConvergenceError):
        eq.newton(pressed, 0.0)


def dragged(friction, way, steps):
    """A block pressed onto another by a lid that it sticks to, which then goes a way (3,) in mm.

    Contacts of the lid (steps + 1,), energies in mJ stored in the blocks and the lid, and lost by then.
    """
    mesh = stacked(3, 4)
    eq = with_friction(mesh, friction=friction)
    model = eq.model
    lid = Obstacle(mesh, Plane((0.0, 0.0, 2.03), (0.0, 0.0, -1.0)), 0.05, 0.002, friction=3.0)
    sliding = model.self_contact
    model.obstacles, model.self_contact = (lid,), SelfContact(mesh, D, K)
    start = moved(mesh, (0.0, 0.0, -0.47))
    lid.begin(start)
    state = eq.settled(start, 0.0)
    model.self_contact = sliding
    lid.begin(state.u)
    sliding.begin(state.u)
    contacts, stored, lost = [], [], []
    for share in np.linspace(0.0, 1.0, steps + 1):
        lid.pose = Pose(shift=(share * way[0], share * way[1], share * way[2]))
        state = eq.newton(state.u, 0.0)
        model.commit(state.u, eq.parameters)
        contacts.append(lid.contact(state.u))
        stored.append(model.potential(state.u, 0.0, eq.parameters))
        lost.append(sliding.lost_mJ)
    return contacts, np.array(stored), np.array(lost), model


@pytest.mark.nightly("test_what_is_pushed_by_less_than_friction_stays_and_by_more_is_lost")
def test_a_block_drawn_over_another_costs_what_the_lid_does():
    way = (0.18, -0.24, 0.0)
    contacts, stored, lost, model = dragged(MU, way, 20)
    pulled = np.array([c.tangential_N for c in contacts])
    pressed = np.array([c.normal_N[2] for c in contacts])
    along = pulled @ way / np.linalg.norm(way)
    # From where it slides everywhere.
    np.testing.assert_allclose(-along[5:] / pressed[5:], MU, rtol=0.01)
    work = -np.cumsum((along[1:] + along[:-1]) / 2) * np.linalg.norm(way) / 20
    # The lid's normal force does no work; its own slip costs next to nothing.
    assert contacts[-1].lost_mJ < 1e-4 * lost[-1]
    assert work[-1] == pytest.approx(lost[-1] + stored[-1] - stored[0], rel=0.01)
    assert lost[-1] > 0.8 * work[-1]
    assert (np.diff(lost) >= 0).all()
    again = SelfContact(model.mesh, D, K, MU)
    again.restore(np.zeros_like(model.mesh.nodes), model.self_contact.kept())
    assert again.lost_mJ == lost[-1]


def test_a_body_with_friction_is_solved_in_time_only():
    eq = with_friction(fork())
    with pytest.raises(InputError, match="history"):
        simulate(eq, np.array([0.0, 1.0]), np.array([0.0, 1.0]))


@pytest.mark.parametrize("friction", [-0.1, np.nan, np.inf])
def test_friction_below_0_is_refused(friction):
    with pytest.raises(InputError, match="friction"):
        SelfContact(fork(), D, K, friction)
