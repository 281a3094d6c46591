"""The lattice's graph of steps, its chains, and bent inclusions."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import outer_radius
from mu_addon.errors import InputError
from mu_addon.placement.graph import Limits, lattice_graph
from mu_addon.placement.inclusion import cylinder_overlap
from mu_addon.placement.polyline import legs, polyline_inclusion, polyline_overlap

from ..fem.bodies import box

UNIT = load_preset("mu-1.0x")
D = UNIT.dimensions
GRAPH = lattice_graph(D)

BOX = box((8, 8, 8), (16.0, 16.0, 16.0), order=1)
CORNERS = BOX.nodes[BOX.corners]


def test_steps_rise_along_half_diagonals_or_the_axis():
    way = np.abs(np.diff(GRAPH.nodes[GRAPH.steps], axis=1)[:, 0]) / D.cell
    rise = np.diff(GRAPH.nodes[GRAPH.steps][:, :, 2], axis=1)
    assert (rise > 0).all()
    assert {tuple(w) for w in way.round(9)} == {(0.5, 0.5, 0.5), (0.0, 0.0, 1.0)}


def test_every_step_keeps_its_inclusion_clear_of_membrane_and_envelope():
    t = np.linspace(0, 1, 201)[:, None]
    ends = GRAPH.nodes[GRAPH.steps]
    points = ends[:, :1] + t * (ends[:, 1:] - ends[:, :1])
    (x0, x1), (y0, y1), (z0, z1) = D.bounds
    for axis, (low, high) in enumerate(((x0, x1), (y0, y1), (z0, z1))):
        assert points[..., axis].min() >= low + D.inclusion_radius
        assert points[..., axis].max() <= high - D.inclusion_radius
    # The nearest point of the profile lies on its own height for no step, but never nearer than this.
    z = np.linspace(0, D.height, 4001)
    wall = np.stack([outer_radius(D, z), z], axis=1)
    section = np.stack([np.hypot(points[..., 0], points[..., 1]), points[..., 2]], axis=-1).reshape(-1, 2)
    assert (section[:, 0] > outer_radius(D, section[:, 1])).all()
    nearest = min(np.linalg.norm(wall - p, axis=1).min() for p in section[::7])
    assert nearest >= D.inclusion_radius * 0.998


def test_more_clearance_leaves_fewer_steps_and_too_much_none():
    assert 0 < len(lattice_graph(D, 3.0).steps) < len(GRAPH.steps)
    with pytest.raises(InputError, match="clear of membrane"):
        lattice_graph(D, 10.0)


def test_the_windows_of_anchors_are_among_the_chains():
    points = anchor_points(UNIT)
    found = {tuple(map(tuple, GRAPH.nodes[list(c)].round(9))) for c in GRAPH.chains(Limits())}
    for w in windows(len(points)):
        assert tuple(map(tuple, points[list(w.indices)].round(9))) in found


def test_chains_obey_their_limits():
    limits = Limits(shortest_cells=2.5, longest_cells=4.0, sharpest_bend_deg=60.0)
    chains = list(GRAPH.chains(limits))
    assert chains
    for chain in chains:
        way = np.diff(GRAPH.nodes[list(chain)], axis=0)
        length = np.linalg.norm(way, axis=1)
        assert 2.5 * D.cell - 1e-6 <= length.sum() <= 4.0 * D.cell + 1e-6
        way /= length[:, None]
        assert ((way[1:] * way[:-1]).sum(axis=1) >= 0.5 - 1e-9).all()
        assert GRAPH.lengths[GRAPH.steps_of(chain)].sum() == pytest.approx(length.sum())


def test_of_two_mirror_images_one_is_listed_and_none_is_lost():
    """Against an enumeration that knows no mirror images: path by path along the steps."""
    limits = Limits(longest_cells=3.0)
    onward = {}
    for low, high in GRAPH.steps.tolist():
        onward.setdefault(low, []).append(high)
    every = set()

    def walk(chain):
        way = np.diff(GRAPH.nodes[chain], axis=0)
        length = np.linalg.norm(way, axis=1)
        way = way / length[:, None]
        cosine = (way[1:] * way[:-1]).sum(axis=1)
        if length.sum() > 3 * D.cell + 1e-6 or (cosine < np.cos(np.radians(75))).any():
            return
        if length.sum() >= 2 * D.cell - 1e-6:
            every.add(tuple(chain))
        for node in onward.get(chain[-1], []):
            walk([*chain, node])

    for start in range(len(GRAPH.nodes)):
        walk([start])
    listed = list(GRAPH.chains(limits))
    assert len(set(listed)) == len(listed) == GRAPH.count(limits)
    images = {tuple(int(i) for i in GRAPH.image[list(c)]) for c in listed}
    assert set(listed) | images == every
    assert all(c in images for c in set(listed) & images)


def test_two_nodes_without_a_step_between_them_are_no_chain():
    with pytest.raises(KeyError):
        GRAPH.steps_of((0, len(GRAPH.nodes) - 1))


@pytest.mark.parametrize("wrong", [{"shortest_cells": 0.0}, {"sharpest_bend_deg": -1.0}])
def test_limits_that_admit_nothing_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        Limits(**wrong)


def test_a_wider_lattice_has_more_chains():
    wide = attrs.evolve(UNIT, lattice=attrs.evolve(UNIT.lattice, cells_x=5))
    assert lattice_graph(wide.dimensions).count(Limits()) > 2 * GRAPH.count(Limits())


def test_a_straight_polyline_is_the_cylinder():
    points = np.array([[5.0, 6, 3], [5, 6, 7], [5, 6, 12]])
    assert len(legs(points)) == 2
    np.testing.assert_allclose(
        polyline_overlap(CORNERS, points, 1.0),
        cylinder_overlap(CORNERS, points[0], points[-1], 1.0),
        atol=1e-12,
    )


@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_a_bent_tube_has_the_volume_of_its_length_whatever_its_bends(seed):
    rng = np.random.default_rng(seed)
    # Three legs of 3 mm, each within 50 degrees of z: neighbours bend by up to 100.
    tilt, turn = rng.uniform(0, np.radians(50), 3), rng.uniform(0, 2 * np.pi, 3)
    way = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    points = np.array([8.0, 8.0, 3.0]) + np.vstack([np.zeros(3), np.cumsum(3 * way, axis=0)])
    overlap = polyline_overlap(CORNERS, points, 1.0)
    assert (overlap >= 0).all()
    assert overlap.sum() == pytest.approx(np.pi * 9.0, rel=2e-5)


def test_a_bent_tube_fills_each_element_by_its_own_share():
    """Against points thrown at random: inside the nearer leg's cylinder, on its side of the mitre."""
    points = np.array([[4.0, 4, 4], [9, 8, 8], [8, 12, 12]])
    radius = 1.5
    rng = np.random.default_rng(1)
    some = np.flatnonzero(polyline_overlap(CORNERS, points, radius) > 0)[::9]
    weights = rng.dirichlet(np.ones(4), (len(some), 20000))
    thrown = np.einsum("eqa,eai->eqi", weights, CORNERS[some])
    way = np.diff(points, axis=0)
    way /= np.linalg.norm(way, axis=1)[:, None]
    first = (thrown - points[1]) @ (way[0] + way[1]) < 0
    inside = np.zeros(thrown.shape[:2], bool)
    for leg, mine in ((0, first), (1, ~first)):
        along = (thrown - points[leg]) @ way[leg]
        off = np.linalg.norm(thrown - points[leg] - along[..., None] * way[leg], axis=2)
        # Flat at the two free ends, open at the mitre.
        within = along > 0 if leg == 0 else along < np.linalg.norm(points[2] - points[1])
        inside |= mine & (off < radius) & within
    share = inside.mean(axis=1)
    error = 4 * np.sqrt(np.maximum(share * (1 - share), 1e-4) / 20000)
    found = polyline_inclusion(CORNERS, np.ones(len(CORNERS), bool), points, radius).share[some]
    assert (np.abs(found - share) < error).all()


def test_a_bend_too_sharp_for_its_legs_is_refused():
    with pytest.raises(InputError, match="bends too sharply"):
        polyline_overlap(CORNERS, np.array([[5.0, 5, 5], [10, 5, 5], [5.5, 5.5, 5]]), 1.0)
