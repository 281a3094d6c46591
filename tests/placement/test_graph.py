"""The lattice's graph of steps, and its chains."""

import attrs
import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import outer_radius
from mu_addon.errors import InputError
from mu_addon.placement.graph import Limits, lattice_graph

UNIT = load_preset("mu-1.0x")
D = UNIT.dimensions
GRAPH = lattice_graph(D)


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
