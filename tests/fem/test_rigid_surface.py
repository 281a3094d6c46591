"""Closed surfaces as obstacles: distances of a box, a ball and a notch, and the patch test."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import CONTACT_NEWTON
from mu_addon.fem.obstacle import Obstacle
from mu_addon.fem.rigid import Box, Pose, Sphere
from mu_addon.fem.rigid_surface import Surface, _closest
from mu_addon.fem.state import rest

from .bodies import _grid, make

BOX = Box((1.2, 0.5, 1.1), (0.5, 0.2, 0.4))
CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def triangles(quads):
    return np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def box_surface(box):
    """The surface of a Box."""
    return Surface(box.centre + CUBE * box.half_mm, triangles(SIDES))


def ball_surface(centre, radius, halvings=3):
    """An icosahedron's triangles halved, their vertices on a sphere."""
    g = (1 + np.sqrt(5)) / 2
    one = [(0, s, t * g) for s in (-1, 1) for t in (-1, 1)]
    v = np.array([np.roll(p, k) for k in range(3) for p in one])
    for _ in range(halvings):
        hull = ConvexHull(v)
        edges = np.unique(np.sort(hull.simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        v = np.vstack([v, v[edges].mean(axis=1)])
        v /= np.linalg.norm(v, axis=1)[:, None]
    v /= np.linalg.norm(v, axis=1)[:, None]
    t = ConvexHull(v).simplices
    inward = (np.cross(v[t[:, 1]] - v[t[:, 0]], v[t[:, 2]] - v[t[:, 0]]) * v[t].mean(axis=1)).sum(axis=1) < 0
    t[inward] = t[inward][:, ::-1]
    return Surface(np.asarray(centre) + radius * v, t)


def notched():
    """An L of side 2, a unit wide, along y: its inner edge is at x = z = 1."""
    ring = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    v = np.array([(x, y, z) for y in (0.0, 1.0) for x, z in ring])
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    t = [*caps, *[(c + 6, b + 6, a + 6) for a, b, c in caps]]
    for k in range(6):
        n = (k + 1) % 6
        t += [(k, k + 6, n + 6), (k, n + 6, n)]
    return Surface(v, t)


SURFACE = box_surface(BOX)


def test_a_box_of_triangles_is_the_box():
    x = np.random.default_rng(0).uniform((0, -0.5, 0), (2.4, 1.5, 2.2), (4000, 3))
    (d, n, h), (distance, normal, bend) = SURFACE.distance(x), BOX.distance(x)
    np.testing.assert_allclose(d, distance, atol=1e-13)
    # Inside, points as near to two faces, to float32, may be told of either.
    one = np.partition(np.abs(np.abs(x - BOX.centre) - BOX.half_mm), 1, axis=1)
    clear = (distance > 0) | (one[:, 1] - one[:, 0] > 1e-5)
    np.testing.assert_allclose(n[clear], normal[clear], atol=1e-12)
    np.testing.assert_allclose(h[clear], bend[clear], atol=1e-9 * np.abs(bend).max())


def test_a_ball_of_triangles_is_nearly_the_ball():
    """It lies within by a facet's sagitta at most; a point outside sees a facet's tilt at most."""
    ball, inscribed = Sphere((1, 2, 3), 2.0), ball_surface((1, 2, 3), 2.0)
    x = np.random.default_rng(1).uniform(-3, 7, (4000, 3))
    (d, n, _), (distance, normal, _) = inscribed.distance(x), ball.distance(x)
    sides = inscribed._corners - np.roll(inscribed._corners, 1, axis=1)
    sagitta = (np.linalg.norm(sides, axis=2).max() ** 2 / 3) / (2 * 2.0)
    assert (d - distance > -1e-12).all()
    assert (d - distance).max() < sagitta
    outside = distance > 0
    assert (n * normal).sum(axis=1)[outside].min() > np.cos(0.12)
    assert ((d < 0) == (distance < 0))[np.abs(distance) > sagitta].all()


def test_derivatives_of_a_body_with_a_notch():
    body, h = notched(), 1e-6
    x = np.random.default_rng(3).uniform(-1, 3, (3000, 3))
    d, n, bend = body.distance(x)

    def near(points):
        which = body._nearest(points)
        return np.stack([which, _closest(points, *np.moveaxis(body._corners[which], 1, 0))[1]])

    # Where the nearest face, edge or vertex changes, the gradient may turn at once.
    far = [near(x + s) for s in 1e3 * h * np.vstack([np.eye(3), -np.eye(3)])]
    same = (np.array(far) == near(x)).all(axis=(0, 1)) & (np.abs(d) > 0.02)
    assert same.sum() > 1000
    for k, step in enumerate(h * np.eye(3)):
        ahead, behind = body.distance(x[same] + step), body.distance(x[same] - step)
        np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), n[same, k], atol=1e-8)
        np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), bend[same, k], atol=1e-6)


def test_the_sign_holds_next_to_edges_and_vertices():
    """Sharp and reentrant ones: points a little off them in every direction, against the L itself."""
    body = notched()
    random = np.random.default_rng(2)
    for place in [(1, 0.5, 1), (2, 1, 1), (0, 0, 0), (1, 1, 1), (2, 0.5, 0), (1, 0, 2)]:
        x = np.array(place) + 1e-3 * random.standard_normal((500, 3))
        lies = ((x >= 0) & (x <= (2, 1, 2))).all(axis=1) & ~((x[:, 0] > 1) & (x[:, 2] > 1))
        assert ((body.distance(x)[0] < 0) == lies).all()


def test_what_bounds_no_body_is_refused():
    v, t = SURFACE.body.vertices, SURFACE.body.triangles
    with pytest.raises(InputError, match="cannot be an obstacle: 3 edges are open"):
        Surface(v, t[1:])
    with pytest.raises(InputError, match="2 separate bodies"):
        Surface(np.vstack([v, v + 5]), np.vstack([t, t + 8]))


def ragged_slab(low, high, bottom, top):
    """A slab from z = bottom to top whose lower face is triangulated at random."""
    random = np.random.default_rng(4)
    corners = np.array([(low, low), (high, low), (high, high), (low, high)])
    inner = random.uniform(low + 0.05, high - 0.05, (30, 2))
    flat = np.vstack([corners, inner])
    t = Delaunay(flat).simplices
    v = np.vstack(
        [np.column_stack([flat, np.full(len(flat), bottom)]), np.column_stack([corners, [top] * 4])]
    )
    n = len(flat)
    area = np.cross(flat[t[:, 1]] - flat[t[:, 0]], flat[t[:, 2]] - flat[t[:, 0]])
    t[area > 0] = t[area > 0][:, ::-1]
    lid = [(n, n + 1, n + 2), (n, n + 2, n + 3)]
    walls = [f for a in range(4) for b in [(a + 1) % 4] for f in ((a, b, n + b), (a, n + b, n + a))]
    return Surface(v, np.vstack([t, lid, walls]))


def stack(order):
    """A unit cube of two materials, 1 and 3 MPa, that meet at z = 1/2; its nodes moved within faces."""
    nodes, tets = _grid((4, 4, 4), (1, 1, 1))
    noise = np.random.default_rng(5).uniform(-0.05, 0.05, nodes.shape)
    noise[(nodes == 0) | (nodes == 1)] = 0.0
    noise[nodes[:, 2] == 0.5, 2] = 0.0
    mesh = make(nodes + noise, tets, order, symmetry=("z",))
    upper = mesh.nodes[mesh.corners].mean(axis=1)[:, 2] > 0.5
    return mesh, Materials.neo_hooke(np.where(upper, 3.0, 1.0), np.full(len(upper), 0.3))


def confined_stress(stretch, modulus, poisson=0.3):
    """First Piola-Kirchhoff stress in MPa of a neo-Hookean bar that cannot widen."""
    mu, kappa = modulus / (2 * (1 + poisson)), modulus / (3 * (1 - 2 * poisson))
    i1 = 2 + stretch**2
    return mu * stretch ** (-2 / 3) * (stretch - i1 / (3 * stretch)) + kappa * (stretch - 1)


@pytest.mark.parametrize("order", [1, 2])
def test_patch_across_faces_that_do_not_match(order):
    """A stack of two materials, held at its sides, under a slab whose edges cross its own: one stress."""
    mesh, materials = stack(order)
    held = np.tile([True, True, False], (len(mesh.nodes), 1))
    model = Model(mesh, held, threads=1)
    depth, pressure, by = 0.01, 0.1, 0.1
    slab = Obstacle(mesh, ragged_slab(-0.2, 1.3, 1.0, 1.5), pressure, depth)
    model.obstacles = (slab,)
    eq, state = Equilibrium(model, materials, CONTACT_NEWTON), rest(mesh)
    for shift in (0.05, by):
        slab.pose = Pose(shift=(0, 0, -shift))
        state = eq.newton(state.u, 0.0)
    _, on = slab.pressures_MPa(state.u)
    np.testing.assert_allclose(on, on.mean(), rtol=1e-6)
    x, z = mesh.nodes[:, 2], mesh.nodes[:, 2] + state.u[:, 2]
    middle, top = z[x == 0.5].mean(), z[x == 1].mean()
    np.testing.assert_allclose(z, np.interp(x, [0, 0.5, 1], [0, middle, top]), atol=1e-8)
    assert top == pytest.approx(1 - by + slab.deepest_mm(state.u), rel=1e-9)
    for stretch, modulus in ((2 * middle, 1.0), (2 * (top - middle), 3.0)):
        assert confined_stress(stretch, modulus) == pytest.approx(-on.mean(), rel=1e-6)
