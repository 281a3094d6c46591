"""What is repaired has one remedy and is measured; what has several is left and named."""

import numpy as np
import pytest

from mu_addon.design import shapes
from mu_addon.design.printing import repair
from mu_addon.design.printing.repair import GAP_MM, repaired
from mu_addon.design.surface import bad_edges, volume

from .parts import arrays, joined


@pytest.fixture(scope="module")
def part():
    return arrays(shapes.box([-5, -5, -5], [5, 5, 5]) - shapes.ball(3.0, 24))


def same(mended, part):
    """Whether a repair gave the part back."""
    assert mended.remains == []
    assert bad_edges(mended.triangles) == 0
    assert mended.volume_after_mm3 == pytest.approx(volume(*part), rel=1e-6)
    return len(mended.triangles) == len(part[1])


def count_of(mended, word):
    return sum(change.count for change in mended.changes if word in change.what)


def test_a_sound_part_is_not_touched(part):
    mended = repaired(*part)
    assert mended.changes == []
    assert mended.largest_move_mm == 0.0
    assert same(mended, part)
    assert mended.lines()[0] == "nothing was changed"


def test_flipped_and_doubled_faces(part):
    vertices, triangles = part
    rng = np.random.default_rng(4)
    flipped = rng.choice(len(triangles), 7, replace=False)
    broken = triangles.copy()
    broken[flipped] = broken[flipped][:, ::-1]
    again = np.concatenate([broken, triangles[:3], triangles[3:5, ::-1]])
    mended = repaired(vertices, again)
    assert same(mended, part)
    assert count_of(mended, "doubled") == 5
    # Of a doubled triangle either the flipped one or the other may be the one that stays.
    assert 1 <= count_of(mended, "flipped") <= 9
    assert mended.volume_before_mm3 != pytest.approx(mended.volume_after_mm3, rel=1e-3)


def test_a_part_that_is_inside_out_is_turned_and_its_void_with_it(part):
    mended = repaired(part[0], part[1][:, ::-1])
    assert same(mended, part)
    assert mended.volume_before_mm3 == pytest.approx(-mended.volume_after_mm3)
    assert count_of(mended, "inside out") == 2
    # A ball within that faces outward may be a void turned wrong, or a solid: it is left.
    inner = np.abs(part[0][part[1]]).max(axis=(1, 2)) < 4.0
    one = np.where(inner[:, None], part[1][:, ::-1], part[1])
    assert repaired(part[0], one).changes == []


def test_a_tiny_gap_closes_and_its_move_is_told(part):
    """Every triangle of one side has corners of its own, up to 0.8 of the gap apart."""
    vertices, triangles = part
    rng = np.random.default_rng(1)
    apart = triangles.copy()
    side = np.flatnonzero(vertices[triangles][:, :, 2].min(axis=1) > 4.9)
    own = vertices[triangles[side]].reshape(-1, 3) + rng.uniform(-1, 1, (3 * len(side), 3)) * 0.2 * GAP_MM
    apart[side] = len(vertices) + np.arange(3 * len(side)).reshape(-1, 3)
    mended = repaired(np.concatenate([vertices, own]), apart)
    assert mended.remains == []
    assert len(mended.triangles) == len(triangles)
    assert 0.0 < mended.largest_move_mm <= 0.5 * GAP_MM
    assert mended.volume_after_mm3 == pytest.approx(volume(*part), rel=1e-3)
    assert count_of(mended, "open edges were merged") == 3 * len(side)


def test_a_missing_triangle_is_put_back_and_a_larger_hole_is_not(part):
    vertices, triangles = part
    mended = repaired(vertices, triangles[1:])
    assert same(mended, part)
    assert count_of(mended, "filled") == 1
    # Two neighbours: four edges, which two ways of triangles could close.
    a, b = triangles[0, :2]
    (near,) = np.flatnonzero(((triangles == a).any(axis=1) & (triangles == b).any(axis=1))[1:]) + 1
    left = repaired(vertices, np.delete(triangles, [0, near], axis=0))
    assert "4 open edges" in left.remains[0]
    assert count_of(left, "filled") == 0


def test_a_wide_gap_and_bodies_that_cross_are_left_and_named(part):
    vertices, triangles = part
    top = vertices[triangles][:, :, 2].min(axis=1) > 4.9
    raised = vertices.copy()
    apart = triangles.copy()
    apart[top] += len(vertices)
    raised[:, 2] += 0.1
    wide = repaired(np.concatenate([vertices, raised]), apart)
    assert "open edges" in wide.remains[0]
    assert wide.largest_move_mm == 0.0
    other = arrays(shapes.ball(2.0, 24).translate([5.3, 0.2, 0.1]))
    crossing = repaired(*joined(part, other))
    assert "pass through" in crossing.remains[0]


def test_edges_of_three_faces_are_left_and_named(part):
    """A fin on an edge: whether it goes or the faces beside it cannot be known."""
    vertices, triangles = part
    a, b = triangles[0, :2]
    fin = np.array([[a, b, len(vertices)]])
    points = np.concatenate([vertices, [[9.0, 9.0, 9.0]]])
    mended = repaired(points, np.concatenate([triangles, fin]))
    assert any("more than two faces" in what for what in mended.remains)
    assert len(mended.triangles) == len(triangles) + 1


def test_triangles_on_their_own_are_no_holes(part):
    """Three open edges bound each, and filled it would lie on itself."""
    alone = np.arange(9).reshape(3, 3) + len(part[0])
    points = np.concatenate([part[0], np.random.default_rng(2).uniform(8, 9, (9, 3))])
    mended = repaired(points, np.concatenate([part[1], alone]))
    assert mended.changes == []
    assert "9 open edges" in mended.remains[0]


def test_dust_is_left(monkeypatch):
    """So many vertices in so little room belong together in no one way, and their pairs fill the memory."""
    monkeypatch.setattr(repair, "MOST_NEAR", 1000)
    rng = np.random.default_rng(6)
    for width in (0.5 * GAP_MM, 10.0 * GAP_MM):
        points = rng.uniform(0.0, width, (3000, 3))
        mended = repaired(points, np.arange(3000).reshape(-1, 3))
        assert mended.largest_move_mm == 0.0
        assert "3000 open edges" in mended.remains[0]
