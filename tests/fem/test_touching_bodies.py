"""Self-contact against published answers: a ring that collapses until it lies flat, two bodies of Hertz's."""

import attrs
import numpy as np
import pytest

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.self_intersection import crossings
from mu_addon.fem.state import rest

from . import bodies
from .elastica import FLATTENS, Ring
from .test_obstacle import half_space
from .test_self_intersection import fork

pytest.importorskip("ipctk")

E, NU = 1.0, 0.3
RADIUS, WALL, OVAL = 10.0, 0.4, 0.01
# Bending stiffness of the wall per unit of width, in N mm; its strain along the ring's axis is zero.
STIFFNESS = E * WALL**3 / 12 / (1 - NU**2)
UNIT_MPa = STIFFNESS / RADIUS**3


def test_the_elastica_meets_itself_where_published():
    """Within the digits that are printed: no force at the pressure of contact, no curvature before a line."""
    ring = Ring.flattened()
    assert ring.force == pytest.approx(0.0, abs=1e-3)
    for pressure in (6.0, 8.0, 10.0, FLATTENS):
        ring = ring.at(pressure, half_gap=0.0)
    assert ring.curvature == pytest.approx(0.0, abs=2e-3)
    # What is left beside the line is one shape, its size by p^(-1/3): a strip folded back on itself.
    folds = [ring.at(p, half_gap=0.0, flat=True) for p in (12.0, 20.0)]
    sizes = [(np.pi / 2 - fold.flat) * p ** (1 / 3) for fold, p in zip(folds, (12.0, 20.0), strict=True)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-6)


def ring_half(around):
    """The half x >= 0 of a slice of a slightly oval ring in plane strain, and its supports."""
    nodes, tets = bodies._grid((1, around, 1), (1.0, 1.0, 1.0))

    def bend(p):
        angle = (p[:, 1] - 0.5) * np.pi
        r = RADIUS + (p[:, 0] - 0.5) * WALL + OVAL * RADIUS * np.cos(2 * angle)
        out = np.stack([r * np.cos(angle), r * np.sin(angle), p[:, 2] * WALL], axis=1)
        out[np.abs(out) < 1e-9] = 0.0
        return out

    edges, _ = bodies.edges_of(tets)
    middles = bend(nodes[edges].mean(axis=1))
    faces, _ = bodies.boundary_faces(tets)
    inside = faces[(nodes[faces][:, :, 0] == 0).all(axis=1)]
    mesh = bodies.make(bend(nodes), tets, 2, inside, symmetry=("x", "z"), onto=lambda m, e: middles)
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = mesh.nodes[:, 2] > WALL * (1 - 1e-9)
    held[:, 1] = (mesh.nodes[:, 1] == 0) & (mesh.nodes[:, 0] > 0)
    return mesh, held


@pytest.mark.nightly("tests/fem/test_self_contact.py::test_a_vacuum_closes_a_pouch_but_never_crosses_it")
def test_a_ring_collapses_and_lies_flat_as_the_elastica_does():
    """Its bending stiffness is the only number that both share; the wall is a 25th of the radius."""
    mesh, held = ring_half(48)
    model = Model(mesh, held, threads=1)
    contact = model.self_contact = SelfContact(mesh, WALL / 8, 1e-3)
    settings = attrs.evolve(SELF_CONTACT_NEWTON, max_step_MPa=0.3 * UNIT_MPa, min_step_MPa=1e-3 * UNIT_MPa)
    eq = Equilibrium(model, bodies.uniform(mesh, E, NU), settings)
    pressures = (2.8, 3.0, 3.5, 4.5, 8.0, 20.0)
    states = eq.path([-p * UNIT_MPa for p in pressures], rest(mesh))

    x, y, _ = mesh.nodes.T
    middle = np.abs(np.hypot(x, y) - RADIUS - OVAL * RADIUS * np.sign(x - y)) < 0.01 * WALL
    above, beside = middle & (x == 0) & (y > 0), middle & (y == 0)
    assert above.sum() == beside.sum() == 3
    found = {
        p: np.array([(y + s.u[:, 1])[above].mean(), (x + s.u[:, 0])[beside].mean()]) / RADIUS
        for p, s in zip(pressures, states, strict=True)
    }
    force = {}
    for p, s in zip(pressures, states, strict=True):
        assert not contact.intersects(s.u)
        assert not crossings(mesh, s.u)
        nodes, forces = contact.forces(s.u)
        force[p] = -forces[y[nodes] > 0, 1].sum() / WALL / (STIFFNESS / RADIUS**2)

    free = Ring.flattened().at(5.0).at(5.0, drawn=OVAL)
    for p in (4.5, 3.5):
        free = free.at(p, drawn=OVAL)
        assert found[p] == pytest.approx([free.half_height, free.half_width], abs=2e-3)
        assert force[p] == 0.0
    at_a_point = (
        Ring.flattened().at(6.0, half_gap=0.0, drawn=OVAL).at(8.0, half_gap=found[8.0][0], drawn=OVAL)
    )
    assert found[8.0][1] == pytest.approx(at_a_point.half_width, abs=1e-3)
    assert force[8.0] == pytest.approx(at_a_point.force, rel=0.01)
    flat = at_a_point.at(12.0, half_gap=0.02, flat=True, drawn=OVAL)
    flat = flat.at(20.0, half_gap=found[20.0][0], flat=True, drawn=OVAL)
    assert found[20.0][1] == pytest.approx(flat.half_width, abs=1e-3)
    assert force[20.0] == pytest.approx(flat.force, rel=0.01)


def two_bodies(radius, side, apart):
    """A quarter of a round body above a flat one, meshes that do not match, a narrow space between them."""
    below, above = half_space(side, 7), half_space(side, 8)
    near = np.minimum((above.nodes[:, :2] ** 2).sum(axis=1), 9.0)
    lower = above.nodes - near[:, None] / (2 * radius) * np.exp(above.nodes[:, 2:] / 3.0) * (0, 0, 1)
    # Turned over about the x axis, then moved back across y = 0.
    turned = lower * (1, 1, -1) + (0, 0, apart)
    count = len(below.nodes)
    return attrs.evolve(
        below,
        nodes=np.vstack([below.nodes, turned]),
        tets=np.vstack([below.tets, _other_hand(above.tets) + count]).astype(below.tets.dtype),
        region=np.concatenate([below.region, above.region]),
    ), np.arange(count, count + len(turned))


def _other_hand(tets):
    """Quadratic tetrahedra of a mirror image: nodes 0 and 1 changed, and the edges with them."""
    return tets[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]


@pytest.mark.nightly("tests/fem/test_obstacle.py::test_hertz_elastic_ball_on_a_plane")
def test_a_round_body_on_a_flat_one_presses_as_hertz_says():
    """Both elastic, meshes that do not match: force and radius of the contact (Johnson, 1985, section 4.2).

    The blocks of 30 contact radii are held 2 % more stiffly than half-spaces; with six and seven elements
    along an edge in place of seven and eight the force is 2 % more.
    """
    radius, side, approach, gap = 10.0, 30.0, 0.1, 0.01
    mesh, upper = two_bodies(radius, side, apart=gap)
    z = mesh.nodes[:, 2]
    far = np.zeros(len(z), bool)
    far[upper] = z[upper] > gap + side * (1 - 1e-9)
    held = np.zeros(mesh.nodes.shape, bool)
    held[far, 2] = True
    model = Model(mesh, held, threads=1)
    contact = model.self_contact = SelfContact(mesh, gap, 0.1)
    eq = Equilibrium(model, bodies.uniform(mesh, E, NU), SELF_CONTACT_NEWTON)
    u, squeezed = np.zeros_like(mesh.nodes), np.zeros_like(mesh.nodes)
    # The surface that touches stays where it is, so that no start goes through the other one.
    squeezed[upper, 2] = (gap - z[upper]) / side
    u[upper, 2] = -0.1 * gap
    for step in np.diff([0.1 * gap, 0.02, 0.05, approach + gap]):
        u = eq.newton(u + step * squeezed, 0.0).u
        assert not contact.intersects(u)
    touch = contact.touch(u)
    nodes, forces = contact.forces(u)
    above = np.isin(nodes, upper)
    assert touch.force_N == pytest.approx(-4 * forces[above, 2].sum(), rel=0.01)
    # Hertz's pressure, p0 sqrt(1 - r^2/a^2), has a mean of r^2 of 2/5 a^2.
    far_mm2 = (mesh.nodes[nodes[above], :2] ** 2).sum(axis=1)
    wide = np.sqrt(2.5 * (forces[above, 2] @ far_mm2) / forces[above, 2].sum())
    # What keeps the surfaces apart counts as theirs.
    nearer = approach + touch.gap_mm
    both = E / (1 - NU**2) / 2
    assert touch.force_N == pytest.approx(4 / 3 * both * np.sqrt(radius * nearer**3), rel=0.05)
    assert wide == pytest.approx(np.sqrt(radius * nearer), rel=0.03)


def cut_short_without_crossing(count):
    """Waves of the whole body; told by ipctk, whose detection ends the steps, and by a test without it."""
    mesh = fork()
    contact = SelfContact(mesh, 0.05, 0.1)
    random = np.random.default_rng(2026)
    cut_short = 0
    while cut_short < count:
        u, size = np.zeros_like(mesh.nodes), random.uniform(0.2, 1.2)
        for _ in range(4):
            a, b = random.standard_normal((2, 3))
            to = u + size * np.sin(mesh.nodes @ a)[:, None] * b
            share = contact.free_share(u, to)
            cut_short += share < 1
            u = u + share * (to - u)
            assert not contact.intersects(u)
            assert not crossings(mesh, u)


def test_no_body_cuts_itself_in_steps_that_would():
    cut_short_without_crossing(25)


@pytest.mark.nightly("test_no_body_cuts_itself_in_steps_that_would")
def test_no_body_cuts_itself_in_a_thousand_steps_that_would():
    cut_short_without_crossing(1000)
