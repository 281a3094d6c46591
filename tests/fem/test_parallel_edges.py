"""Nearly parallel edges within the gap: an energy without jumps, where ipctk's own weights jump."""

import ipctk
import numpy as np
import pytest

from mu_addon.fem.parallel_edges import reweigh

GAP = 0.1
# Two triangles; an edge of each runs along x, one above the other and shifted along it.
REST = np.array(
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [1.3, 0.0, 0.6], [0.3, 0.0, 0.6], [0.8, -1.0, 0.6]]
)
FACES = np.array([[0, 1, 2], [3, 4, 5]], np.int32)


def energies(turns, weighed, gap=GAP):
    """Energies (t,) of the triangles, the upper edge at 0.9 gaps and turned by small angles (t,)."""
    ipctk.set_num_threads(1)
    places = np.asfortranarray(REST)
    faces = np.asfortranarray(FACES)
    surface = ipctk.CollisionMesh(places, ipctk.edges(faces), faces)
    potential = ipctk.BarrierPotential(gap, 0.1, True)
    found = []
    for turn in turns:
        at = REST.copy()
        at[3:, 2] -= 0.6 - 0.9 * gap
        at[3, 2] += turn
        at = np.asfortranarray(at)
        candidates = ipctk.Candidates()
        candidates.build(surface, at, gap)
        near = ipctk.NormalCollisions()
        near.use_area_weighting = True
        near.collision_set_type = ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        near.build(candidates, surface, at, gap)
        if weighed:
            reweigh(ipctk, surface, near, candidates, at, gap)
        found.append(potential(near, surface, at))
    return np.array(found)


TURNS = np.linspace(0.0, 0.03, 3001)


def test_the_energy_does_not_jump_where_an_end_leaves_the_gap():
    """As the upper edge turns the lower one's end beneath it leaves the gap, at 0.0143 mm."""
    steps = np.abs(np.diff(energies(TURNS, weighed=True)))
    assert steps.max() < 1.01 * steps[0]


def test_weights_of_ipctk_alone_jump():
    """If this fails ipctk tells its terms apart, and `parallel_edges` can go."""
    steps = np.abs(np.diff(energies(TURNS, weighed=False)))
    assert steps.max() > 50 * steps[0]


def test_without_parallel_edges_nothing_changes():
    turns = np.array([0.2, 0.3])
    np.testing.assert_array_equal(energies(turns, True), energies(turns, False))


@pytest.mark.parametrize("turn", [0.005, 0.01])
def test_gradients_of_weights_are_those_of_areas(turn):
    """Each term's weight is linear in the areas of its edges, and so is its gradient in theirs."""
    at = REST.copy()
    at[3:, 2] -= 0.6 - 0.9 * GAP
    at[3, 2] += turn
    at = np.asfortranarray(at)
    weights, gradient = [], None
    h = 1e-6
    moved = np.zeros_like(REST)
    moved[1] = [0.3, -0.2, 0.1]
    for factor in (0.0, -h, h):
        rest, faces = np.asfortranarray(REST + factor * moved), np.asfortranarray(FACES)
        surface = ipctk.CollisionMesh(rest, ipctk.edges(faces), faces)
        surface.init_area_jacobians()
        candidates = ipctk.Candidates()
        candidates.build(surface, at, GAP)
        near = ipctk.NormalCollisions()
        near.enable_shape_derivatives = True
        near.use_area_weighting = True
        near.collision_set_type = ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        near.build(candidates, surface, at, GAP)
        reweigh(ipctk, surface, near, candidates, at, GAP)
        weights.append(np.array([one.weight for one in near.ee_collisions]))
        if factor == 0.0:
            gradient = np.array(
                [
                    np.asarray(one.weight_gradient.data) @ moved.ravel()[one.weight_gradient.indices]
                    for one in near.ee_collisions
                ]
            )
    assert len(gradient) > 1
    np.testing.assert_allclose(gradient, (weights[2] - weights[1]) / (2 * h), rtol=1e-6, atol=1e-9)
