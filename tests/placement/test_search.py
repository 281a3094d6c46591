"""The prediction of a path's deviation, and the search against all paths solved one by one."""

import attrs
import numpy as np
import pytest
from scipy.stats import spearmanr

from mu_addon.design.anchors import anchor_points
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE, mirror
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.deviation import centreline, centreline_deviation
from mu_addon.placement.graph import Limits, lattice_graph
from mu_addon.placement.polyline import polyline_inclusion
from mu_addon.placement.response import reduced_response
from mu_addon.placement.search import SearchSettings, front, probability_of_better, search_paths
from mu_addon.placement.sensitivity_map import gradients_of, loaded, mean_deviation, shares_of_time

UNIT = load_preset("mu-1.0x")
D = UNIT.dimensions
POINTS = anchor_points(UNIT)
PRESSURES = np.array([0.0, -10.0, 20.0])
SENSOR_MPA = 2.5
WHOLE = lattice_graph(D)
_ENDS = WHOLE.nodes[WHOLE.steps]
# The upper part on the side of the anchors, where the unit moves most.
GRAPH = attrs.evolve(
    WHOLE,
    steps=WHOLE.steps[(_ENDS[..., 1].min(axis=1) > D.cell) & (_ENDS[..., 2].min(axis=1) > 2.4 * D.cell)],
)
# Every path through two struts or two axial steps there: few enough to solve for all.
EVERY = [c for c in GRAPH.chains(Limits(1.7, 2.0)) if len(c) == 3]


def materials(mesh):
    return materials_of(UNIT, mesh)


@pytest.fixture(scope="module")
def half():
    mesh = mesh_unit(UNIT, MeshSettings(refine=0.5, order=1))
    model = Model(mesh)
    return mesh, model, simulate(Equilibrium(model, materials(mesh)), np.arange(3.0), PRESSURES)


def exact(half_mesh, chains):
    """J_hat (c,) in mm of every chain, solved on the whole mesh: a path need not lie in the mirror plane."""
    mesh = mirror(half_mesh, "x")
    model, made = Model(mesh), materials(mesh)
    baseline = simulate(Equilibrium(model, made), np.arange(3.0), PRESSURES)
    monitor = probe(mesh, POINTS)
    lattice, corners = mesh.region == LATTICE, mesh.nodes[mesh.corners]
    shares = [
        polyline_inclusion(corners, lattice, GRAPH.nodes[list(c)], D.inclusion_radius).share for c in chains
    ]
    sweep = CandidateBatch(model, made, (POINTS, monitor), shares, SENSOR_MPA)
    moved = np.stack([sweep.at(state) for state in baseline.solved], axis=1)
    still = centreline(np.array([POINTS + monitor.displacement(s.u) for s in baseline.solved]), 21)
    curves = (baseline.of_time(centreline(points, 21)) for points in moved)
    return np.array([centreline_deviation(curve, baseline.of_time(still)).J_hat for curve in curves])


def predicted(half, chains, model=None, baseline=None):
    _, half_model, half_baseline = half
    model, baseline = model or half_model, baseline or half_baseline
    monitor = probe(model.mesh, POINTS)
    found = reduced_response(
        model, materials(model.mesh), SENSOR_MPA, baseline, monitor, GRAPH, D.inclusion_radius
    )
    moved = found.displacements(chains, np.array([s.pressure_MPa for s in loaded(baseline)]))
    return mean_deviation(gradients_of(baseline, POINTS, monitor, 21), moved, shares_of_time(baseline))


@pytest.fixture(scope="module")
def both(half):
    return exact(half[0], EVERY), predicted(half, EVERY)


def test_the_prediction_ranks_paths_as_solving_for_each_does(both):
    solved, found = both
    assert len(EVERY) > 25
    assert spearmanr(solved, found).statistic > 0.95
    assert np.argsort(np.argsort(found))[np.argmin(solved)] < 3


def test_the_search_finds_the_best_of_all_and_checks_only_some(both):
    solved, found = both
    asked = []

    def check(numbers):
        asked.extend(numbers.tolist())
        return solved[numbers]

    outcome = search_paths(found, check)
    assert outcome.complete
    assert outcome.risk <= 0.05
    assert outcome.best == int(np.argmin(solved))
    assert sorted(asked) == sorted(outcome.checked)
    assert len(asked) == len(set(asked)) < len(EVERY)
    np.testing.assert_array_equal(outcome.exact_mm[outcome.checked], np.sort(solved[outcome.checked]))


def test_the_half_mesh_predicts_what_the_whole_one_does(half):
    """Paths on one side from two parities or from one whole body; in the plane and across it nearly."""
    whole = mirror(half[0], "x")
    model = Model(whole)
    baseline = simulate(Equilibrium(model, materials(whole)), np.arange(3.0), PRESSURES)
    one = predicted(half, EVERY)
    other = predicted(half, EVERY, model, baseline)
    x = np.array([np.abs(GRAPH.nodes[list(c)][:, 0]).min() for c in EVERY])
    far, beside = x > 0.9 * D.cell, x > 0
    assert 0 < far.sum() < beside.sum() < len(EVERY)
    np.testing.assert_allclose(one[far], other[far], rtol=1e-6)
    # A step that ends in the plane leaves a part of its inclusion, and of the patch in which its patterns
    # relax, on the other side, which only the whole mesh has.
    np.testing.assert_allclose(one[beside], other[beside], rtol=0.02)
    np.testing.assert_allclose(one, other, rtol=0.15)


def test_a_path_and_its_mirror_image_are_predicted_alike(half):
    images = [tuple(int(i) for i in GRAPH.image[list(c)]) for c in EVERY]
    one, other = (predicted(half, chains) for chains in (EVERY, images))
    np.testing.assert_allclose(one, other, rtol=1e-9)


def test_a_perfect_prediction_needs_only_the_first_checks():
    J = np.linspace(1.0, 2.0, 200)
    outcome = search_paths(J, lambda numbers: J[numbers] * 1.3)
    assert outcome.best == 0
    assert outcome.complete
    assert len(outcome.checked) == SearchSettings().first


def test_a_useless_prediction_is_admitted():
    rng = np.random.default_rng(0)
    J = rng.uniform(1.0, 2.0, 300)
    outcome = search_paths(np.ones(300), lambda numbers: J[numbers], SearchSettings(most=40))
    assert not outcome.complete
    assert outcome.risk > 0.05
    assert len(outcome.checked) == 40


def test_the_risk_holds_over_many_searches():
    """With normal errors as assumed, the best is missed no more often than the risk allows."""
    missed = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        predicted_mm = np.exp(rng.normal(0, 0.5, 300))
        J = predicted_mm * np.exp(rng.normal(0.1, 0.08, 300))
        missed += search_paths(predicted_mm, lambda numbers, J=J: J[numbers]).best != np.argmin(J)
    # The bound is on each search, and a miss also needs the better path to be left unchecked.
    assert missed <= 200 * 0.05


def test_everything_checked_leaves_no_risk():
    J = np.array([0.3, 0.1, 0.2])
    assert probability_of_better(np.ones(3), J) == 0.0
    outcome = search_paths(np.ones(3), lambda numbers: J[numbers], SearchSettings(risk=0.0))
    assert outcome.complete
    assert outcome.best == 1


@pytest.mark.parametrize("wrong", [np.array([]), np.array([1.0, 0.0])])
def test_predictions_that_cannot_be_compared_are_refused(wrong):
    with pytest.raises(InputError, match="no path"):
        search_paths(wrong, lambda numbers: np.ones(len(numbers)))


def test_the_front_holds_what_is_neither_shorter_nor_worse_than_another():
    length = np.array([25.0, 25.0, 30.0, 40.0, 40.0, 50.0])
    J = np.array([0.10, 0.05, 0.04, 0.20, 0.30, np.nan])
    assert front(length, J).tolist() == [2, 3]


def test_paths_that_cannot_be_made_are_left_out_and_the_best_of_the_rest_is_found():
    J = np.linspace(1.0, 2.0, 40)
    impossible = np.arange(40) % 3 == 0

    def check(numbers):
        return np.where(impossible[numbers], np.nan, J[numbers])

    outcome = search_paths(J, check)
    assert outcome.best == 1
    assert set(outcome.left_out) <= set(np.flatnonzero(impossible))
    assert 0 in outcome.left_out
    assert not set(outcome.left_out) & set(outcome.checked)


def test_a_search_of_impossible_paths_alone_says_so():
    with pytest.raises(InputError, match="none of the paths is possible"):
        search_paths(np.ones(5), lambda numbers: np.full(len(numbers), np.nan))
