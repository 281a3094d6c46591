"""The cylinder in the mesh, against closed forms and against counting points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.placement.inclusion import cylinder_overlap, straight_inclusion

from ..fem import bodies

BOX = bodies.box((5, 5, 6), (5.0, 5.0, 6.0), order=1, jiggle=0.3)
CORNERS = BOX.nodes[BOX.tets]
VOLUMES = np.linalg.det(CORNERS[:, 1:] - CORNERS[:, :1]) / 6


@pytest.mark.parametrize(
    ("start", "end", "radius"),
    [
        ([2.5, 2.5, 1.0], [2.5, 2.5, 5.0], 1.0),
        ([2.1, 2.7, 0.5], [3.0, 2.2, 5.5], 0.8),
        ([1.0, 1.0, 1.0], [4.0, 4.0, 5.0], 0.05),
        ([2.0, 2.0, 3.0], [2.0, 3.5, 3.0], 1.3),
    ],
)
def test_the_elements_of_a_mesh_add_up_to_the_cylinder(start, end, radius):
    found = cylinder_overlap(CORNERS, start, end, radius).sum()
    exact = np.pi * radius**2 * np.linalg.norm(np.subtract(end, start))
    assert found == pytest.approx(exact, rel=1e-5)


def test_one_element_against_counting_points():
    tet = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]])
    start, end, radius = np.array([0.2, 0.3, 0.1]), np.array([0.6, 0.5, 1.2]), 0.4
    points = np.random.default_rng(0).uniform(0, 2, (2_000_000, 3))
    axis = (end - start) / np.linalg.norm(end - start)
    along = (points - start) @ axis
    away = np.linalg.norm(points - start - along[:, None] * axis, axis=1)
    inside = (points.sum(axis=1) < 2) & (along > 0) & (along < np.linalg.norm(end - start)) & (away < radius)
    # Three standard errors of the count.
    error = 3 * 8 * np.sqrt(inside.mean() / len(points))
    assert cylinder_overlap(tet, start, end, radius)[0] == pytest.approx(8 * inside.mean(), abs=error)


def test_an_element_inside_the_cylinder_counts_whole():
    tet = np.array([[[0.1, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0], [0.1, 0, 0.1]]])
    overlap = cylinder_overlap(tet, [0, 0, -1], [0, 0, 1], 1.0)[0]
    assert overlap == pytest.approx(0.001 / 6, rel=1e-12)


@settings(max_examples=12)
@given(st.integers(0, 2**32 - 1))
def test_an_overlap_is_never_negative_nor_more_than_the_element_and_ignores_numbering(seed):
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(0.5, 4.5, (2, 3))
    radius = rng.uniform(0.05, 1.5)
    overlap = cylinder_overlap(CORNERS, start, end, radius)
    assert (overlap >= 0).all()
    assert (overlap <= VOLUMES * (1 + 1e-9)).all()
    shuffled = CORNERS[:, rng.permutation(4)]
    np.testing.assert_allclose(cylinder_overlap(shuffled, start, end, radius), overlap, atol=1e-9)
    # From the other end the slices are the same, each met at the same heights.
    np.testing.assert_allclose(cylinder_overlap(CORNERS, end, start, radius), overlap, atol=2e-4)


def test_shares_keep_the_cylinders_volume_in_the_lattice_alone():
    lattice = CORNERS.mean(axis=1)[:, 0] > 1.0
    found = straight_inclusion(CORNERS, lattice, [2.5, 2.5, 1.0], [2.5, 2.5, 5.0], 0.3)
    assert not found.touched[~lattice].any()
    assert found.share.max() < 1
    assert (found.share * VOLUMES).sum() == pytest.approx(found.cylinder_volume_mm3, rel=1e-4)
