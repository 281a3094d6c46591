"""Runs of cells and their parts against scipy's labels, and distances against its Euclidean transform."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt, label

from mu_addon.design import shapes
from mu_addon.design.printing.cell_runs import meeting, parts_of, runs_of
from mu_addon.design.printing.chambers import DEEP, distance_field
from mu_addon.design.printing.layers import regions
from mu_addon.design.printing.slices import Layers, slices
from mu_addon.design.printing.voxels import voxel_rows

from .parts import arrays

grids = st.builds(
    lambda seed, shape, share: np.random.default_rng(seed).random(shape) < share,
    st.integers(0, 10_000),
    st.tuples(st.integers(1, 6), st.integers(1, 7), st.integers(1, 9)),
    st.floats(0.0, 1.0),
)


def filled(runs, shape):
    found = np.zeros((int(np.prod(shape[:-1])), shape[-1]), int)
    for line, start, end in zip(runs.line, runs.start, runs.end, strict=True):
        found[line, start:end] += 1
    return found.reshape(shape)


@settings(max_examples=60)
@given(grids)
def test_runs_and_their_complement_are_every_cell_once(marked):
    runs = runs_of(marked)
    assert (filled(runs, marked.shape) == marked).all()
    other = runs.complement(0, marked.shape[0] * marked.shape[1])
    assert (filled(other, marked.shape) == ~marked).all()
    # A view of other order gives the runs of what it shows.
    turned = marked.transpose(2, 0, 1)
    assert (filled(runs_of(turned), turned.shape) == turned).all()


@settings(max_examples=60)
@given(grids)
def test_parts_are_those_of_labels(marked):
    parts = parts_of(marked)
    named, count = label(marked)
    assert parts.count == count
    cells = np.argwhere(np.ones_like(marked))
    mine = parts.at(cells).reshape(marked.shape)
    assert ((mine >= 0) == marked).all()
    # Each part is one label and each label one part.
    pairs = np.unique(np.stack([mine[marked], named[marked]]), axis=1)
    assert pairs.shape[1] == count


@settings(max_examples=40)
@given(grids, st.integers(0, 1))
def test_runs_meet_where_their_cells_do(marked, reach):
    runs = runs_of(marked)
    one, other = meeting(runs, runs, 1, reach)
    expected = {
        (a, b)
        for a in range(len(runs.line))
        for b in range(len(runs.line))
        if runs.line[b] == runs.line[a] + 1
        and runs.start[b] < runs.end[a] + reach
        and runs.end[b] > runs.start[a] - reach
    }
    assert set(zip(one.tolist(), other.tolist(), strict=True)) == expected


@pytest.mark.parametrize("free", [True, False])
def test_regions_are_those_of_each_layers_labels(free):
    body = shapes.box([-6, -6, -3], [6, 6, 3]) - shapes.ball(2.5, 16) - shapes.cylinder(1, -4, 4, 12)
    grid = voxel_rows(*arrays(body.rotate([17, 31, 0])), 0.4, 0.3)
    found = regions(grid, free, at_once=3 * grid.shape[1] * grid.shape[2])
    solid = grid.slab(0, grid.shape[0])
    touching = None if free else np.ones((3, 3))
    counts = [label(layer if not free else ~layer, touching)[1] for layer in solid]
    assert np.bincount(found.layer, minlength=len(counts)).tolist() == counts
    assert found.cells.sum() == np.count_nonzero(~solid if free else solid)


def test_distances_are_euclidean_up_to_the_depth_that_is_asked_for():
    body = shapes.box([-9, -9, -9], [9, 9, 9]) - shapes.ball(7.5, 48) - shapes.cylinder(1, 0, 10, 24)
    grid = voxel_rows(*arrays(body), 0.3)
    field = distance_field(grid)
    step = float(grid.step[0])
    exact = distance_transform_edt(~grid.slab(0, grid.shape[0]), sampling=step)
    inner = (slice(1, -1),) * 3
    mine = field.radius(field.squared)[inner]
    expected = np.where(exact > 0, np.clip(exact - 0.5 * step, 0.5 * step, DEEP), 0.0)[inner]
    assert mine == pytest.approx(expected, abs=1e-9)
    assert mine.max() == DEEP


def test_a_filled_layer_has_the_areas_of_its_outlines():
    body = shapes.box([-6, -5, -3], [6, 5, 3]) - shapes.cylinder(2.0, -1, 1, 48)
    part = arrays(body)
    layers = Layers(*part, (0, 0, 1))
    assert layers.height_mm == pytest.approx(6.0)
    (outlined,) = slices(*part, (0, 0, 1), [3.0])
    layer = layers.filled(3.0)
    assert [layer.area_mm2, layer.enclosed_mm2] == pytest.approx([outlined.area_mm2, outlined.enclosed_mm2])
    for triangles, area in ((layer.material, layer.area_mm2), (layer.enclosed, layer.enclosed_mm2)):
        p, q, r = layer.vertices[triangles.T]
        assert 0.5 * np.linalg.norm(np.cross(q - p, r - p), axis=1).sum() == pytest.approx(area, rel=1e-6)
    assert layer.vertices[:, 2] == pytest.approx(np.zeros(len(layer.vertices)), abs=1e-9)
    # Above and below the hole nothing is enclosed.
    assert layers.filled(0.5).enclosed_mm2 == 0.0
