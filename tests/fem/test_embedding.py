"""A surface carried by a mesh: exact for what the elements can represent, inside and beyond."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.fem.embedding import embed
from mu_addon.meshing.mesh import FLIPPED_TET, mirror, mirror_displacement

from . import bodies

numbers = st.floats(-0.3, 0.3)
matrices = st.lists(numbers, min_size=9, max_size=9).map(lambda v: np.reshape(v, (3, 3)))


def scattered(count, low, high, seed=0):
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


@pytest.mark.parametrize("order", [1, 2])
@settings(max_examples=20)
@given(A=matrices, shift=st.lists(numbers, min_size=3, max_size=3))
def test_an_affine_motion_carries_every_point_exactly_inside_and_outside(order, A, shift):
    mesh = bodies.box((3, 2, 2), (3.0, 2.0, 2.0), order=order, jiggle=0.1)
    points = scattered(300, -0.5, [3.5, 2.5, 2.5])
    carried = embed(mesh, points)
    assert 0 < np.count_nonzero(carried.outside_mm) < len(points)
    moved = carried.displacement(mesh.nodes @ A.T + shift)
    assert np.allclose(moved, points @ A.T + shift, atol=1e-9)


def test_quadratic_elements_carry_a_quadratic_motion_exactly():
    mesh = bodies.box((2, 2, 2), (1.0, 1.0, 1.0))
    points = scattered(200, 0.0, 1.0)

    def bent(x):
        return np.column_stack([x[:, 0] * x[:, 2], x[:, 1] ** 2 - x[:, 0], x[:, 0] * x[:, 1]])

    carried = embed(mesh, points)
    assert not carried.outside_mm.any()
    assert np.allclose(carried.displacement(bent(mesh.nodes)), bent(points), atol=1e-12)


def test_in_curved_elements_a_point_is_where_its_weights_say():
    # Thin elements that bulge by as much as they are thick.
    mesh = bodies.sphere_octant(around=3, through=4, order=2)
    rng = np.random.default_rng(1)
    way = np.abs(rng.normal(size=(60, 3)))
    points = way / np.linalg.norm(way, axis=1)[:, None] * rng.uniform(10.05, 11.95, (60, 1))
    carried = embed(mesh, points)
    assert not carried.outside_mm.any()
    assert np.allclose(carried.displacement(mesh.nodes), points, atol=1e-9)


def test_the_distance_outside_is_that_to_the_surface():
    mesh = bodies.box((2, 2, 2), (1.0, 1.0, 1.0))
    points = np.array([[0.5, 0.5, 1.25], [1.3, 1.4, 0.5], [0.2, 0.3, 0.4]])
    assert np.allclose(embed(mesh, points).outside_mm, [0.25, 0.5, 0.0])


def test_what_hangs_below_the_held_base_stands_still():
    mesh = bodies.box((2, 2, 2), (1.0, 1.0, 1.0), clamp=True)
    u = np.zeros_like(mesh.nodes)
    u[:, 2] = mesh.nodes[:, 2] ** 2 + mesh.nodes[:, 2]
    below, above = np.array([[0.4, 0.5, -0.7]]), np.array([[0.4, 0.5, 1.1]])
    assert np.array_equal(embed(mesh, below).displacement(u), np.zeros((1, 3)))
    # Beyond the top it goes on with the slope there: 2 + 3 x 0.1.
    assert embed(mesh, above).displacement(u)[0, 2] == pytest.approx(2.3)


def test_a_half_mesh_carries_both_sides():
    half = bodies.box((2, 2, 2), (1.0, 1.0, 1.0), symmetry=("x",))
    rng = np.random.default_rng(2)
    u = rng.normal(size=half.nodes.shape)
    u[half.symmetry_nodes("x"), 0] = 0.0
    whole = mirror(half, "x")
    points = scattered(100, [-0.95, 0.05, 0.05], 0.95)
    carried = embed(half, points)
    found = carried.displacement(u)
    together = carried.displacements(np.array([u, -2.0 * u]))
    np.testing.assert_allclose(together, [found, -2.0 * found], atol=1e-6 * np.abs(u).max())
    assert np.allclose(found, embed(whole, points).displacement(mirror_displacement(half, u, "x")), atol=1e-9)
    other = attrs.evolve(half, nodes=half.nodes * [-1, 1, 1], tets=half.tets[:, FLIPPED_TET])
    assert np.allclose(embed(other, points).displacement(u * [-1, 1, 1]), found, atol=1e-9)


def test_rounding_does_not_choose_how_a_point_moves_where_elements_meet():
    """On and beyond nodes, edges and faces, where each element continues a motion in its own way."""
    mesh, random = bodies.box((3, 3, 3), (1.0, 1.0, 1.0)), np.random.default_rng(0)
    ticks = np.arange(-2, 9) / 6
    points = np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3)
    u = random.normal(size=mesh.nodes.shape)
    carried = embed(mesh, points).displacement(u)
    for _ in range(3):
        nearby = points + 1e-14 * random.normal(size=points.shape)
        assert np.allclose(embed(mesh, nearby).displacement(u), carried, atol=1e-9)
