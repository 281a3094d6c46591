"""Thickness, gaps, grids, layers and chambers against bodies whose answers are known."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design import shapes
from mu_addon.design.printing import chambers, faces, layers, trapped_resin
from mu_addon.design.printing.check import check
from mu_addon.design.printing.crossing import MOST_CROSSINGS, crossings, near_pairs
from mu_addon.design.printing.drainage import necks
from mu_addon.design.printing.finding import clustered
from mu_addon.design.printing.orientation import Build, build, directions, fits, ranked, tilted
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.printing.thickness import cast_rays, samples
from mu_addon.design.printing.voxels import frame_along, voxel_rows
from mu_addon.design.surface import winding_number

from .parts import arrays


def rays(body, side, reach=6.0):
    vertices, triangles = arrays(body)
    surface = samples(vertices, triangles, 0.3)
    return surface, cast_rays(body, surface, side, reach)


def box(*size):
    return shapes.box(-np.array(size) / 2.0, np.array(size) / 2.0)


# Thickness and gaps.


def test_samples_cover_every_surface_alike():
    fine, coarse = (samples(*arrays(shapes.ball(5.0, n)), 0.5) for n in (128, 16))
    for surface in (fine, coarse):
        assert surface.area.sum() == pytest.approx(4 * np.pi * 25, rel=0.02)
        assert len(surface.points) == pytest.approx(4 * np.pi * 25 / 0.25, rel=0.02)
        assert surface.points.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.2)
        # Each eighth of the ball has its eighth of the points.
        octant = (surface.points > 0.0) @ [1, 2, 4]
        assert np.bincount(octant) == pytest.approx(np.full(8, len(octant) / 8), rel=0.15)


def test_a_slab_is_as_thick_as_it_is():
    surface, found = rays(box(10, 10, 0.37), -1)
    top = np.abs(surface.normals[:, 2]) > 0.9
    assert found.distance[top] == pytest.approx(0.37, abs=1e-6)
    assert found.cosine[top] == pytest.approx(-1.0)


def test_balls_and_rods_are_as_thick_as_they_are():
    """Facets cost cos(pi/n) at the most: a ray square to a facet meets the opposite one."""
    _, found = rays(shapes.ball(1.5, 64), -1)
    assert found.distance == pytest.approx(3.0, rel=0.01)
    surface, found = rays(shapes.cylinder(0.4, -5, 5, 48), -1)
    side = np.abs(surface.normals[:, 2]) < 0.1
    assert found.distance[side] == pytest.approx(0.8, rel=0.005)


def test_a_wedge_is_no_thin_wall():
    """Near its edge a wedge is as thin as one likes; its faces are not opposed."""
    from manifold3d import CrossSection

    wedge = CrossSection([np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 6.0]])]).extrude(5.0)
    _, found = rays(wedge, -1)
    thin = found.distance < 0.3
    assert thin.any()
    assert (found.cosine[thin] > -0.9).all()


@settings(max_examples=15)
@given(width=st.floats(0.05, 2.0), turn=st.floats(0.0, 360.0))
def test_a_slot_is_as_wide_as_it_is(width, turn):
    body = box(8, 8, 8) - box(width, 10, 6).translate([0, 0, 3])
    _, found = rays(body.rotate([turn, 0.3 * turn, 0]), 1)
    facing = found.cosine < -0.999
    assert facing.any()
    assert found.distance[facing].min() == pytest.approx(width, abs=2e-4)


# Grids.


@settings(max_examples=15)
@given(way=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda w: sum(x * x for x in w) > 0.1))
def test_rows_fill_the_same_volume_along_any_direction(way):
    body = shapes.ball(4.0, 48) - shapes.cylinder(1.0, -6, 6, 32)
    vertices, triangles = arrays(body)
    grid = voxel_rows(vertices, triangles, 0.2, frame=frame_along(np.array(way)))
    solid = grid.slab(0, grid.shape[0])
    assert np.count_nonzero(solid) * grid.cell_volume == pytest.approx(body.volume(), rel=0.01)
    # The middle of the cells, brought back to the body's frame, is its centroid.
    assert grid.points(np.argwhere(solid)).mean(axis=0) == pytest.approx(np.zeros(3), abs=0.03)


def test_slabs_are_the_whole():
    grid = voxel_rows(*arrays(shapes.ball(4.0, 32)), 0.3)
    whole = grid.slab(0, grid.shape[0])
    parts = [grid.slab(k, min(k + 7, grid.shape[0])) for k in range(0, grid.shape[0], 7)]
    assert (np.concatenate(parts) == whole).all()


def test_overlapping_bodies_count_once():
    one, other = arrays(box(4, 4, 4)), arrays(box(4, 4, 4).translate([2, 0, 0]))
    grid = voxel_rows(
        np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + len(one[0])]), 0.25
    )
    solid = grid.slab(0, grid.shape[0])
    assert np.count_nonzero(solid) * grid.cell_volume == pytest.approx(2 * 64.0 - 32.0, rel=0.05)


# Layers.


def built(body, up=(0, 0, 1), step=0.2):
    return voxel_rows(*arrays(body), step, 0.1, frame_along(np.array(up, float)))


def cups_of(body, up=(0, 0, 1)):
    grid = built(body, up)
    return trapped_resin.cups(grid, layers.regions(grid, free=True, at_once=20_000))


def bowl():
    """A tumbler of 8 x 8 x 9 mm inside, open to +z."""
    return box(10, 10, 10) - box(8, 8, 10).translate([0, 0, 1])


def test_a_bowl_is_a_cup_from_the_bottom_up_and_none_upside_down():
    """Built from its bottom the bowl opens toward the film and holds its whole volume under it."""
    cup = cups_of(bowl())
    assert cup.volume[0] == pytest.approx(8 * 8 * 9, rel=0.02)
    assert cup.places[0] == pytest.approx([0, 0, 0.5], abs=0.1)
    assert not cup.sealed[0]
    assert cups_of(bowl(), (0, 0, -1)).volume[:1].sum() == 0.0


def test_a_hole_in_the_bottom_vents_a_bowl():
    assert cups_of(bowl() - shapes.cylinder(1.0, -6, 0, 24)).volume[:1].sum() == 0.0
    # One at half height lets go at half height.
    vented = bowl() - shapes.cylinder(1.0, 0, 6, 24).rotate([0, 90, 0])
    assert cups_of(vented).volume[0] == pytest.approx(8 * 8 * 3, rel=0.05)


def test_a_hollow_ball_never_opens():
    cup = cups_of(shapes.ball(5.0, 48) - shapes.ball(3.0, 48))
    assert cup.volume[0] == pytest.approx(36 * np.pi, rel=0.02)
    assert cup.sealed.tolist() == [True]


def test_islands_are_what_begins_on_nothing():
    table = box(10, 10, 1) + box(1, 1, 4).translate([4.5, 4.5, -2]) + box(2, 1, 3).translate([-4, -4.5, -1.5])
    grid = built(table)
    found = layers.islands(grid, layers.regions(grid, free=False, at_once=20_000))
    # The long leg is the first layer; the short one hangs in the air until the top joins them.
    assert len(found.area) == 1
    assert found.places[0] == pytest.approx([-4, -4.5, -2.95], abs=0.1)
    assert found.area[0] == pytest.approx(2.0, rel=0.1)
    upside_down = built(table, (0, 0, -1))
    assert len(layers.islands(upside_down, layers.regions(upside_down, free=False)).area) == 0


def test_a_shelf_overhangs_and_a_bridge_spans():
    post = box(2, 4, 10).translate([-4, 0, 0])
    shelf = post + box(6, 4, 1).translate([-2, 0, 4.5])
    grid = built(shelf, step=0.1)
    over = layers.overhangs(grid, 19.0, at_once=20_000)
    worst = int(over.reach.argmax())
    # From the post's face at -3 to the shelf's end at 1, less what 19 degrees carry of one layer.
    assert over.reach[worst] == pytest.approx(4.0 - 0.1 / np.tan(np.radians(19)), abs=0.15)
    assert not over.bridge[worst]
    assert over.places[worst][[0, 2]] == pytest.approx([1.0, 4.0], abs=0.15)

    over = layers.overhangs(built(shelf + post.translate([6, 0, 0]), step=0.1), 19.0)
    worst = int(over.reach.argmax())
    assert over.bridge[worst]
    assert 2.0 * over.reach[worst] == pytest.approx(4.0 - 0.2 / np.tan(np.radians(19)), abs=0.3)


@pytest.mark.parametrize(("half_deg", "bridge"), [(25.0, True), (40.0, False)])
def test_a_roof_over_a_wedge_is_a_bridge_where_its_sides_face_each_other(half_deg, bridge):
    """By more than 120 degrees: the ways to both sides are apart by 180 less the wedge's angle."""
    from manifold3d import CrossSection

    half = 11.0 * np.tan(np.radians(half_deg))
    pit = CrossSection([np.array([[-4.0, 0.0], [7.0, -half], [7.0, half]])]).extrude(6.0)
    body = box(12, 24, 5).translate([0, 0, 2.5]) - pit + box(12, 24, 1).translate([0, 0, 5.5])
    over = layers.overhangs(built(body, step=0.2), 30.0)
    worst = int(over.reach.argmax())
    assert over.reach[worst] == pytest.approx(10.0 * np.sin(np.radians(half_deg)), abs=0.6)
    assert over.places[worst][:2] == pytest.approx([6.0, 0.0], abs=0.3)
    assert over.bridge[worst] == bridge


@pytest.mark.parametrize(("slope", "hangs"), [(30.0, False), (10.0, True)])
def test_slopes_steeper_than_the_limit_need_no_support(slope, hangs):
    from manifold3d import CrossSection

    rise = 6.0 * np.tan(np.radians(slope))
    outline = np.array([[0.0, 0.0], [1.0, 0.0], [7.0, rise], [7.0, rise + 1.0], [0.0, rise + 1.0]])
    arm = CrossSection([outline]).extrude(4.0).rotate([90, 0, 0])
    over = layers.overhangs(built(arm, step=0.1), 19.0)
    assert bool((over.reach > 0.15).any()) == hangs


# Chambers.


def test_a_chamber_and_its_ways_out():
    """A ball's hollow with a bore of 2 mm to the top and one of 1 mm to the side."""
    hollow = box(14, 14, 14) - shapes.ball(5.0, 64)
    body = hollow - shapes.cylinder(1.0, 0, 9, 32) - shapes.cylinder(0.5, 0, 9, 32).rotate([0, 90, 0])
    found = chambers.chambers(chambers.distance_field(voxel_rows(*arrays(body), 0.2))).found
    assert len(found) == 1
    assert found[0].volume == pytest.approx(4 / 3 * np.pi * 125, rel=0.02)
    assert np.linalg.norm(found[0].place) < 0.7
    top, side = found[0].openings
    assert top.radius == pytest.approx(1.0, abs=0.15)
    assert side.radius == pytest.approx(0.5, abs=0.2)
    assert abs(top.along @ [0, 0, 1]) > 0.95
    assert top.place == pytest.approx([0, 0, 6], abs=0.8)
    assert side.place == pytest.approx([6, 0, 0], abs=0.8)


@pytest.mark.parametrize("near", [0.5, 12.0, 1000.0])
def test_a_way_out_is_the_widest_however_far_it_leads(near, monkeypatch):
    """A bore of 2 mm, 30 mm long, is found before one of 1 mm to the side, wherever the search begins."""
    monkeypatch.setattr(chambers, "NEAR", near)
    hollow = box(12, 12, 42).translate([0, 0, 14]) - shapes.ball(4.0, 48)
    body = hollow - shapes.cylinder(1.0, 0, 40, 24) - shapes.cylinder(0.5, 0, 9, 24).rotate([0, 90, 0])
    (found,) = chambers.chambers(chambers.distance_field(voxel_rows(*arrays(body), 0.25))).found
    far, side = found.openings
    assert [far.radius, side.radius] == pytest.approx([1.0, 0.5], abs=0.2)
    assert far.place[:2] == pytest.approx([0, 0], abs=0.3)
    assert 4.0 < far.place[2] < 35.0
    assert side.place == pytest.approx([5, 0, 0], abs=1.2)
    # The bores are ways, as narrow at their inner ends as anywhere.
    assert found.volume == pytest.approx(4 / 3 * np.pi * 64, rel=0.06)


def test_a_sealed_chamber_has_no_way_out_and_an_open_frame_is_no_chamber():
    sealed = chambers.chambers(
        chambers.distance_field(voxel_rows(*arrays(box(12, 12, 12) - shapes.ball(4.0, 48)), 0.25))
    )
    assert [len(chamber.openings) for chamber in sealed.found] == [0]
    assert sealed.hold(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]])).tolist() == [True, False]
    frame = box(12, 12, 12) - box(9, 9, 14) - box(9, 14, 9) - box(14, 9, 9)
    assert chambers.chambers(chambers.distance_field(voxel_rows(*arrays(frame), 0.25))).found == []


def test_the_shortest_cut_of_a_surface_is_its_waist():
    """Two balls joined by a rod of 0.2 mm: the cut is the rod's girth."""
    body = shapes.ball(3.0, 32) + shapes.ball(3.0, 32).translate([8, 0, 0])
    body += shapes.cylinder(0.1, 2, 6, 16).rotate([0, 90, 0])
    vertices, triangles = arrays(body)
    x = vertices[triangles].mean(axis=1)[:, 0]
    curves = necks(vertices, triangles, x < 0.0, x > 8.0)
    assert len(curves) == 1
    assert curves[0].mean(axis=0)[1:] == pytest.approx([0, 0], abs=0.02)
    assert 2.5 < curves[0][:, 0].mean() < 5.5
    assert np.hypot(*curves[0][:, 1:].T).max() < 0.11


# Faces.


def test_pieces_are_told_by_what_encloses_them():
    hollow = arrays(box(10, 10, 10) - box(6, 6, 6))
    loose = arrays(box(1, 1, 1).translate([8, 0, 0]))
    within = arrays(box(1, 1, 1).translate([4, 0, 0]))
    floating = arrays(box(2, 2, 2))
    vertices, triangles = hollow
    for more in (loose, within, floating):
        triangles = np.concatenate([triangles, more[1] + len(vertices)])
        vertices = np.concatenate([vertices, more[0]])
    found = faces.pieces(vertices, triangles)
    assert [round(s.volume) for s in found.bodies] == [1000, 8, 1]
    assert [round(s.volume) for s in found.voids] == [-216]
    assert [s.centroid[0] for s in found.nested] == pytest.approx([4.0])
    assert found.inside_out == []


def several(rng, count):
    """Vertices and triangles of balls at random places, of random sizes, half of them inside out."""
    points, corners, shell = [], [], []
    for number in range(count):
        vertices, triangles = arrays(shapes.ball(rng.uniform(0.3, 3.0), 12))
        corners.append(triangles[:, ::-1] if rng.random() < 0.5 else triangles)
        corners[-1] = corners[-1] + sum(map(len, points))
        points.append(vertices + rng.uniform(-4, 4, 3))
        shell += [number] * len(triangles)
    return np.concatenate(points), np.concatenate(corners), np.array(shell)


@pytest.mark.parametrize("seed", range(4))
def test_the_kind_of_each_of_many_shells_is_that_by_all_others(seed):
    rng = np.random.default_rng(seed)
    vertices, triangles, shell = several(rng, 40)
    mixed = rng.permutation(len(triangles))
    found = faces.pieces(vertices, triangles[mixed])
    kinds = {"bodies": found.bodies, "voids": found.voids, "nested": found.nested, "over": found.inside_out}
    seen = set()
    for kind, members in kinds.items():
        for piece in members:
            (number,) = set(shell[mixed][piece.triangles].tolist())
            seen.add(number)
            own = vertices[triangles[shell == number]]
            at = vertices[triangles[mixed][piece.triangles[0]]].mean(axis=0)
            around = winding_number(vertices, triangles[shell != number], at[None])[0]
            middle = own.reshape(-1, 3).mean(axis=0)
            outward = winding_number(vertices, triangles[shell == number], middle[None])[0] > 0.0
            largest = abs(piece.volume) == max(abs(p.volume) for group in kinds.values() for p in group)
            inside = around > 0.5 and not (largest and outward)
            assert kind == (("nested" if inside else "bodies") if outward else "voids" if inside else "over")
            assert piece.centroid == pytest.approx(middle, abs=0.02)
    assert seen == set(range(40))


def test_of_each_of_many_shells_the_smaller_part_is_turned():
    rng = np.random.default_rng(3)
    vertices, triangles, shell = several(rng, 60)
    flipped = np.zeros(len(triangles), bool)
    for number in range(0, 60, 2):
        members = np.flatnonzero(shell == number)
        # Some patches, of a quarter of the triangles.
        height = vertices[triangles[members]].mean(axis=1) @ rng.normal(size=3)
        flipped[members[np.argsort(height)[: len(members) // 4]]] = True
    broken = np.where(flipped[:, None], triangles[:, ::-1], triangles)
    assert (faces.turned(vertices, broken) == flipped).all()
    assert not faces.turned(vertices, triangles).any()


def test_winding_counts_how_often_a_surface_goes_round():
    vertices, triangles = arrays(shapes.ball(2.0, 24))
    points = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    assert winding_number(vertices, triangles, points) == pytest.approx([1.0, 0.0], abs=1e-9)
    assert winding_number(vertices, triangles[:, ::-1], points) == pytest.approx([-1.0, 0.0], abs=1e-9)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.booleans())
def test_near_pairs_are_those_whose_boxes_overlap(seed, of_all_sizes):
    """From a hundredth of a micrometre to a kilometre too: more cells than one grid has numbers for."""
    rng = np.random.default_rng(seed)
    if of_all_sizes:
        low = rng.uniform(0, 1, (80, 1, 3)) * 10.0 ** rng.integers(-3, 7)
        corners = low + 10.0 ** rng.uniform(-5, 6, (80, 1, 1)) * rng.uniform(0, 1, (80, 3, 3))
    else:
        corners = rng.uniform(0, 5, (60, 1, 3)) + rng.uniform(0, rng.choice([0.3, 2.0]), (60, 3, 3))
    low, high = corners.min(axis=1), corners.max(axis=1)
    meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    found = [tuple(sorted(pair)) for pairs in near_pairs(corners) for pair in pairs.tolist()]
    assert sorted(found) == [(a, b) for a, b in np.argwhere(meet).tolist() if a < b]


def test_of_triangles_without_order_not_all_crossings_are_sought():
    rng = np.random.default_rng(1)
    soup = rng.uniform(0, 100, (9000, 3)), np.arange(9000).reshape(-1, 3)
    assert len(crossings(*soup)) == MOST_CROSSINGS
    (found,) = (f for f in check(*soup, load_printer()).findings if f.check == "self-intersection")
    assert found.what == f"{MOST_CROSSINGS} edges or more pass through other triangles"


def test_crossing_bodies_cross_along_a_known_curve():
    one, other = arrays(shapes.ball(2.0, 32)), arrays(shapes.ball(2.0, 32).translate([2.3, 0.2, 0.1]))
    joined = np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + len(one[0])])
    places = crossings(*joined)
    assert len(places) > 20
    for middle in ([0, 0, 0], [2.3, 0.2, 0.1]):
        assert np.linalg.norm(places - middle, axis=1) == pytest.approx(2.0, abs=0.05)
    assert len(crossings(*one)) == 0


def test_places_are_gathered_by_groups_the_worst_first():
    points = np.array([[0, 0, 0], [0.3, 0, 0], [5, 0, 0], [5.2, 0, 0], [5.4, 0, 0.0]])
    assert clustered(points) == pytest.approx(np.array([[5.2, 0, 0], [0.15, 0, 0]]))
    assert clustered(points, np.array([1.0, 9, 2, 3, 1])) == pytest.approx(
        np.array([[0.3, 0, 0], [5.2, 0, 0]])
    )


# Build directions.


def test_directions_are_those_of_a_cube_and_tilts_lean_as_far_as_they_should():
    ways = directions()
    assert len(np.unique(ways.round(9), axis=0)) == 26
    assert np.linalg.norm(ways, axis=1) == pytest.approx(np.ones(26))
    assert np.abs(ways[:6]).sum() == pytest.approx(6.0)
    leaning = tilted(np.array([0.0, 1.0, 0.0]), 20.0)
    assert leaning[:, 1] == pytest.approx(np.full(8, np.cos(np.radians(20))))


def test_a_direction_is_beaten_by_one_that_is_as_good_in_all_and_better_in_one():
    def way(cup, islands, support):
        return Build((0.0, 0.0, 1.0), cup, islands, support, 0.0, 80.0, True)

    cupless, few, beaten, small = (
        way(0.0, 20, 500.0),
        way(6.0, 5, 200.0),
        way(6.0, 9, 300.0),
        way(9.0, 9, 20.0),
    )
    order = ranked([beaten, small, few, cupless])
    assert [b.cup_ml for b in order] == [0.0, 6.0, 6.0, 9.0]
    assert [b.best_among for b in order] == [True, True, False, True]
    assert way(6.0, 5, 198.0).costs == few.costs, "supports count in steps of 5 mm2"


def test_a_part_may_be_turned_about_the_vertical_to_fit():
    room = (200.0, 125.0, 210.0)
    assert fits(np.array([120.0, 190.0, 50.0]), room)
    assert not fits(np.array([130.0, 190.0, 50.0]), room)
    assert not fits(np.array([10.0, 10.0, 211.0]), room)


@pytest.mark.parametrize(("slope_deg", "needs"), [(20.0, 0.0), (40.0, 1.0)])
def test_what_is_flatter_than_the_slope_needs_support(slope_deg, needs):
    """A roof upside down, of sides that rise by 30 degrees from level over 4 by 10 mm each."""
    rise = 4.0 * np.tan(np.radians(30.0))
    ends = [[-4.0, rise], [0.0, 0.0], [4.0, rise], [4.0, rise + 1.0], [-4.0, rise + 1.0]]
    roof = trimesh.convex.convex_hull(np.array([[x, y, z] for y in (0.0, 10.0) for x, z in ends]))
    surface = samples(roof.vertices, roof.faces, 0.5)
    none = np.zeros(len(surface.area), bool)
    up = np.array([0.0, 0.0, 1.0])
    found = build(roof.vertices, roof.faces, surface, none, up, 0.1, slope_deg, (50.0, 50.0, 50.0))
    assert found.support_mm2 == pytest.approx(needs * 80.0 / np.cos(np.radians(30.0)), rel=0.05)
    assert (found.inner_mm2, found.height_mm, found.fits) == (0.0, pytest.approx(rise + 1.0), True)
