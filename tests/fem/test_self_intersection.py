"""Walls that meet: prescribed motions with known answers, and a pouch that a vacuum closes."""

import numpy as np
import pytest

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.self_intersection import crossings, first_self_intersection
from mu_addon.fem.state import State, rest
from mu_addon.meshing.mesh import boundary_faces

from . import bodies

GAP, THICKNESS = 0.4, 0.5


def fork(order=2, prongs=2):
    """Prongs 1 wide and 1 apart, 3 high, that stand on a common foot; all of it 1 deep, without cavity."""
    cells = 2 * prongs - 1
    nodes, tets = bodies._grid((cells, 2, 6), (cells, 1.0, 3.0))
    centre = nodes[tets].mean(axis=1)
    kept = (centre[:, 2] < 0.5) | (centre[:, 0] % 2 < 1)
    used, tets = np.unique(tets[kept], return_inverse=True)
    return bodies.make(nodes[used], tets.reshape(-1, 4), order)


def lean(mesh, *tips):
    """Prongs lean toward each other, pair by pair, by their `tip`; one slides lest edges meet exactly."""
    x, _, z = mesh.nodes.T
    prong = np.round((x - 0.5) / 2).astype(int)
    height = np.maximum(z - 0.5, 0)
    u = np.zeros_like(mesh.nodes)
    u[:, 0] = np.array(tips)[prong // 2] * np.where(prong % 2, -1, 1) * height / 2.5
    u[:, 1:] = np.outer((prong % 2) * height, [0.02, 0.01])
    return u


def pouch(cells=6, size=6.0, rim=1.0, order=2):
    """An eighth of two plates, welded along their rim, with a gap between them; mirrored at three planes."""
    nodes, tets = bodies._grid((cells, cells, 2), (size, size, 2.0))
    nodes[:, 2] = np.array([0.0, GAP / 2, GAP / 2 + THICKNESS])[nodes[:, 2].round().astype(int)]
    centre = nodes[tets].mean(axis=1)
    void = (centre[:, :2] < size - rim).all(axis=1) & (centre[:, 2] < GAP / 2)
    used, tets = np.unique(tets[~void], return_inverse=True)
    nodes, tets = nodes[used], tets.reshape(-1, 4)
    faces, _ = boundary_faces(tets)
    low = (nodes[faces][:, :, 2] < GAP / 2 + 1e-9).all(axis=1)
    within = (nodes[faces][:, :, :2] < size - rim + 1e-9).all(axis=(1, 2))
    flat = (nodes[faces] == 0).all(axis=1).any(axis=1)
    return bodies.make(nodes, tets, order, faces[low & within & ~flat], symmetry=("x", "y", "z"))


@pytest.mark.parametrize("order", [1, 2])
def test_prongs_cross_where_their_tips_meet(order):
    mesh = fork(order)
    assert crossings(mesh, lean(mesh, 0.49)) == ()
    (found,) = crossings(mesh, lean(mesh, 0.53))
    # Only the top 6 % of the prongs' inward faces have passed the middle.
    assert found.place == pytest.approx([1.5, 0.5, 2.9], abs=0.15)
    left, right = sorted(found.walls[:, 0])
    assert left <= 1.0
    assert right >= 2.0
    assert (found.walls[:, 2] > 2.5).all()
    assert found.inner == (False, False)
    assert "outer wall that was at" in str(found)


def test_each_contact_is_told_apart_the_larger_first():
    mesh = fork(prongs=4)
    found = crossings(mesh, lean(mesh, 0.53, 0.6))
    assert [round(c.place[0] - 1.5) for c in found] == [4, 0]
    assert found[0].facets > found[1].facets
    assert [sorted(c.walls[:, 0] // 2) for c in found] == [[2, 3], [0, 1]]


def test_the_undeformed_body_and_rigid_motions_are_free_of_contact():
    for mesh in (fork(), pouch(), bodies.sphere_octant(10, 12, 3), bodies.hollow_box(1)):
        assert crossings(mesh, np.zeros_like(mesh.nodes)) == ()
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    mesh = fork()
    x = mesh.nodes + lean(mesh, 0.53)
    (one,), (other,) = crossings(mesh, x - mesh.nodes), crossings(mesh, x @ turn.T - mesh.nodes)
    assert other.facets == one.facets
    np.testing.assert_allclose(other.place, turn @ one.place, atol=1e-9)


def test_the_first_contact_lies_between_two_states():
    mesh = fork()
    states = [State(-0.01 * k, lean(mesh, 0.2 * k)) for k in range(5)]
    found = first_self_intersection(mesh, states)
    # The left tip meets the right prong at its height, to which that slid up by 1 %.
    expected = -0.05 / (1 + 1 / 1.01)
    assert found.pressure_MPa == pytest.approx(expected, abs=1.1e-5)
    assert found.crossings[0].place == pytest.approx([1.5, 0.5, 3.0], abs=0.3)
    assert first_self_intersection(mesh, states[:3]) is None


def test_a_vacuum_closes_a_pouch_and_says_where_and_when():
    """Both plates meet in their middle as it has sunk by half the gap; the other wall is a mirror image."""
    mesh = pouch()
    body = Equilibrium(
        Model(mesh, threads=1), bodies.uniform(mesh, 1.0, 0.4), NewtonSettings(min_step_MPa=1e-6)
    )
    start = rest(mesh)
    states = [start, *body.path(-np.arange(1, 8) * 5e-5, start)]
    found = first_self_intersection(mesh, states)
    middle = np.flatnonzero((mesh.nodes == [0, 0, GAP / 2]).all(axis=1))[0]
    sunk = np.array([-s.u[middle, 2] for s in states])
    expected = np.interp(GAP / 2, sunk, [s.pressure_MPa for s in states])
    assert sunk[-1] > GAP / 2
    assert found.pressure_MPa == pytest.approx(expected, rel=0.02)
    first = found.crossings[0]
    assert first.inner == (True, True)
    assert np.abs(first.place).max() < 0.8
    np.testing.assert_allclose(np.sort(first.walls[:, 2]), [-GAP / 2, GAP / 2], atol=1e-9)
