"""Shape functions and quadrature against what they must integrate."""

from math import factorial

import numpy as np
import pytest

from mu_addon.errors import MeshingError
from mu_addon.fem import elements

from . import bodies


@pytest.mark.parametrize("order", [1, 2])
def test_shape_functions_are_one_at_their_node(order):
    corners = np.eye(4)
    middles = np.array([corners[list(e)].mean(axis=0) for e in elements.TET_EDGES])
    nodes = corners if order == 1 else np.vstack([corners, middles])
    np.testing.assert_allclose(elements.shape_functions(nodes, order), np.eye(len(nodes)), atol=1e-14)


@pytest.mark.parametrize("order", [1, 2])
def test_gradients_of_a_linear_field_are_exact(order):
    mesh = bodies.box(jiggle=0.2, order=order)
    slope = np.array([[0.3, -1.2, 0.5], [0.1, 0.7, -0.4], [2.0, 0.2, 0.9]])
    reference = elements.reference_gradients(mesh.nodes, mesh.tets)
    field = mesh.nodes @ slope.T
    found = np.einsum("mni,mqnj->mqij", field[mesh.tets], reference.gradients)
    np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), atol=1e-12)
    assert reference.volumes.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("rule", "order", "degree"),
    [
        (elements.tet_quadrature, 1, 1),
        (elements.tet_quadrature, 2, 2),
        (elements.triangle_quadrature, 1, 2),
        (elements.triangle_quadrature, 2, 4),
    ],
)
def test_a_rule_is_exact_to_its_degree(rule, order, degree):
    """Of x^i y^j over a simplex of n dimensions: i! j!/(i + j + n)!."""
    points, weights = rule(order)
    more = 3 if rule is elements.tet_quadrature else 2
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            exact = factorial(i) * factorial(j) / factorial(i + j + more)
            assert (weights * points[:, 1] ** i * points[:, 2] ** j).sum() == pytest.approx(exact, rel=1e-12)


def test_an_inverted_element_is_named():
    mesh = bodies.box(order=1)
    tets = mesh.tets.copy()
    tets[5] = tets[5][[1, 0, 2, 3]]
    with pytest.raises(MeshingError, match=r"1 of .* inverted"):
        elements.reference_gradients(mesh.nodes, tets)
