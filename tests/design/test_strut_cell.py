"""The printed cell: closed forms of its volume and sections, offsets, mirror images, blocks and depth."""

from itertools import product

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.special import ellipe

from mu_addon.design import shapes, surface
from mu_addon.design.gates import GateError
from mu_addon.design.lattice_kinds import LatticeKind, constant
from mu_addon.design.parameters import Envelope, Printing, Unit, load_preset
from mu_addon.design.strut_cell import (
    Facets,
    StrutCell,
    depth_below_surface,
    mass_g,
    octant_surface,
    relative_density,
    specimen_solid,
    strut_cell,
)
from mu_addon.errors import InputError

from .kinds import BODY_CENTRED, CORNERS, FACES, STRAIGHT, octet, simple_cubic, thirds

COARSE = Facets(12, 6)
PAPER = StrutCell(BODY_CENTRED, 12.5, 0.75, 1.0)
CELLS = {
    "paper": PAPER,
    "overcured": attrs.evolve(PAPER, offset_xy_mm=0.2, offset_z_mm=0.2),
    "in plane": attrs.evolve(PAPER, offset_xy_mm=0.2),
    "upright": attrs.evolve(PAPER, offset_xy_mm=0.05, offset_z_mm=0.3),
    "undercured": attrs.evolve(PAPER, offset_xy_mm=-0.1, offset_z_mm=-0.2),
    "either way": attrs.evolve(PAPER, offset_xy_mm=0.1, offset_z_mm=-0.1),
    "straight": attrs.evolve(PAPER, kind=STRAIGHT),
    "cubic": StrutCell(simple_cubic(), 10.0, 1.0, 1.0, 0.1, 0.3),
    "octet": StrutCell(octet(), 12.5, 0.6, 0.6),
    "thirds": StrutCell(thirds(), 12.5, 0.6, 0.6),
}


@pytest.mark.parametrize("facets", [COARSE, Facets()], ids=str)
@pytest.mark.parametrize("name", CELLS)
def test_octant_is_closed_in_one_piece_and_flat_on_its_box(name, facets):
    cell = CELLS[name]
    vertices, triangles = octant_surface(cell, facets)
    assert surface.bad_edges(triangles) == 0
    assert surface.volume(vertices, triangles) > 0
    assert (vertices.min(axis=0) == 0.0).all()
    assert (vertices.max(axis=0) == cell.size_mm / 2).all()
    # A flat side lies on its plane to the last digit: no vertex is a little beside one.
    for plane in (0.0, cell.size_mm / 2):
        beside = np.abs(vertices - plane)
        assert not ((beside > 0) & (beside < 5e-5)).any()
    # No sliver so thin that a mesher would trip over it.
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert (areas / longest > 0).all()


def test_density_of_the_cubic_lattice_is_steinmetz():
    """Three round struts that cross: 3 pi r^2 U - 8 sqrt(2) r^3, after the volumes of crossing cylinders."""
    size = 10.0
    for radius, offset in ((0.5, 0.0), (1.0, 0.25), (2.0, -0.3)):
        cell = StrutCell(simple_cubic(), size, radius, radius, offset, offset)
        r = radius + offset
        exact = (3 * np.pi * r**2 * size - 8 * np.sqrt(2) * r**3) / size**3
        assert relative_density(cell, Facets(32, 2)) == pytest.approx(exact, rel=1e-3)
        assert mass_g(cell, 1.01, 3, Facets(32, 2)) == pytest.approx(exact * 27 * 1.01, rel=1e-3)


def test_thin_struts_have_the_density_of_their_length():
    """Without overlaps: pi times the mean of r^2, j^2 + j(m - j) + 3/8 (m - j)^2, along 4 sqrt(3) U."""
    junction, midspan = 0.008, 0.012
    swell = midspan - junction
    mean = junction**2 + junction * swell + 0.375 * swell**2
    density = relative_density(StrutCell(BODY_CENTRED, 1.0, junction, midspan), Facets(16, 24))
    assert density == pytest.approx(np.pi * mean * 4 * np.sqrt(3), rel=0.02)


def test_density_approaches_its_limit_from_any_facets():
    found = [relative_density(PAPER, Facets(n, m)) for n, m in ((12, 6), (24, 12), (48, 24))]
    assert abs(found[1] - found[2]) < 0.35 * abs(found[0] - found[1])
    assert found[1] == pytest.approx(found[2], rel=3e-3)


@given(st.floats(0.4, 1.2), st.floats(1.0, 1.5), st.floats(-0.3, 0.4))
@settings(max_examples=8)
def test_an_equal_offset_is_a_thicker_strut(junction, swell, offset):
    midspan = junction * swell
    thick = StrutCell(BODY_CENTRED, 12.5, junction + offset, midspan + offset)
    offset_cell = StrutCell(BODY_CENTRED, 12.5, junction, midspan, offset, offset)
    assert relative_density(offset_cell, COARSE) == pytest.approx(relative_density(thick, COARSE), rel=1e-4)


@pytest.mark.parametrize(("in_plane", "upright"), [(0.3, 0.1), (0.1, 0.3), (0.0, 0.2), (0.2, 0.0)])
def test_section_of_an_unequal_offset_is_minkowskis(in_plane, upright):
    """A strut along x: a disc grown by an ellipse has the area pi r^2 + r perimeter + pi a b."""
    r, size = 1.0, 12.5
    cell = StrutCell(simple_cubic(), size, r, r, in_plane, upright)
    vertices, triangles = octant_surface(cell, Facets(64, 1))
    on_end = (vertices[triangles][:, :, 0] == size / 2).all(axis=1)
    end = vertices[np.unique(triangles[on_end])]
    assert end[:, 1].max() == pytest.approx(r + in_plane, rel=3e-3)
    assert end[:, 2].max() == pytest.approx(r + upright, rel=3e-3)
    a, b = sorted((in_plane, upright))
    perimeter = 4 * b * ellipe(1 - (a / b) ** 2)
    area = surface.area(vertices, triangles[on_end])
    assert area == pytest.approx((np.pi * r**2 + r * perimeter + np.pi * a * b) / 4, rel=3e-3)
    upright_strut = (vertices[triangles][:, :, 2] == size / 2).all(axis=1)
    assert surface.area(vertices, triangles[upright_strut]) == pytest.approx(
        np.pi * (r + in_plane) ** 2 / 4, rel=1e-3
    )


@given(st.floats(-1, 1), st.floats(-np.pi, np.pi), st.floats(0, 1), st.floats(0, 1))
def test_offset_is_the_support_of_its_ellipsoid(height, angle, in_plane, upright):
    side = np.sqrt(1 - height**2)
    normal = np.array([[side * np.cos(angle), side * np.sin(angle), height]])
    axes = np.array([in_plane, in_plane, upright])
    moved = shapes.offset_along(normal, axes)
    assert np.sum(moved * normal) == pytest.approx(np.linalg.norm(axes * normal), abs=1e-8)
    assert shapes.offset_along(normal, -axes) == pytest.approx(-moved)
    assert shapes.offset_along(normal, [in_plane] * 3) == pytest.approx(in_plane * normal, abs=1e-8)


def test_the_same_design_is_the_same_shape_at_every_scale():
    shaped = [strut_cell(load_preset(name)) for name in ("mu-0.75x", "mu-1.0x", "mu-1.5x")]
    assert [c.size_mm for c in shaped] == [9.375, 12.5, 18.75]
    first, *others = (octant_surface(c) for c in shaped)
    for cell, (vertices, triangles) in zip(shaped[1:], others, strict=True):
        assert np.array_equal(triangles, first[1])
        assert vertices / cell.size_mm == pytest.approx(first[0] / 9.375, abs=1e-15)


def test_the_same_offset_counts_more_in_a_smaller_cell():
    def gain(name):
        unit = load_preset(name)
        printed = attrs.evolve(unit, print=Printing(offset_xy_mm=0.1, offset_z_mm=0.1))
        return relative_density(strut_cell(printed), COARSE) / relative_density(strut_cell(unit), COARSE)

    assert gain("mu-0.75x") > gain("mu-1.0x") > gain("mu-1.5x") > 1.05


def test_a_units_cell_is_nominal_with_its_printers_offsets():
    unit = Unit(
        scale=1.5,
        lattice=Envelope(kind="body-centred-straight"),
        print=Printing(0.1, 0.2, skin_depth_mm=0.3, skin_factor=2.0),
    )
    assert strut_cell(unit) == StrutCell(STRAIGHT, 18.75, 1.125, 1.5, 0.1, 0.2, 0.3, 2.0)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("name", ["paper", "upright", "cubic", "octet"])
def test_blocks_are_watertight_for_another_reader(name, n):
    import trimesh

    cell = CELLS[name]
    vertices, triangles = specimen_solid(cell, n, COARSE)
    side = n * cell.size_mm
    assert (vertices.min(axis=0) == 0.0).all()
    assert vertices.max(axis=0) == pytest.approx(side, rel=1e-15)
    reread = surface.stl_surface(surface.stl_bytes(vertices, triangles))
    mesh = trimesh.Trimesh(*reread, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(relative_density(cell, COARSE) * side**3, rel=1e-6)
    # Genus by the reader's own count of edges: E - V + 1 of the graph is checked within.
    assert 1 - mesh.euler_number // 2 == surface.genus(vertices, triangles)
    # The block is its own mirror image across every mid-plane.
    rows = {tuple(v) for v in np.round(vertices, 6).tolist()}
    for axis in range(3):
        image = vertices.copy()
        image[:, axis] = side - image[:, axis]
        assert {tuple(v) for v in np.round(image, 6).tolist()} == rows


def test_genus_of_the_paper_blocks():
    """E - V + 1 of n^3 body-centred cells: 8 n^3 - n^3 - (n + 1)^3 + 1."""
    for n in (1, 2):
        found = surface.genus(*specimen_solid(PAPER, n, COARSE))
        assert found == 7 * n**3 - (n + 1) ** 3 + 1


def test_depth_in_a_straight_strut_is_its_radius_less_the_distance():
    cell = StrutCell(simple_cubic(), 10.0, 1.0, 1.0, 0.2, 0.2)
    y = np.linspace(0.0, 1.5, 31)
    points = np.stack([np.full_like(y, 5.0), y * 0.6, y * 0.8], axis=1)
    assert depth_below_surface(cell, points) == pytest.approx(np.maximum(0.0, 1.2 - y))
    # At the node each strut counts alone.
    assert depth_below_surface(cell, [[0.0, 0.0, 0.0]]) == pytest.approx([1.2])


# Opposite offsets are no Minkowski sum. A list, since test processes must agree on the order.
@pytest.mark.parametrize("name", [name for name in CELLS if name != "either way"])
def test_depth_is_zero_on_the_surface_and_no_more_than_the_distance_inside(name):
    cell = CELLS[name]
    half = cell.size_mm / 2
    largest = max(cell.junction_radius_mm, cell.midspan_radius_mm)
    vertices, triangles = octant_surface(cell, Facets(32, 16))
    inner = ((vertices > 0) & (vertices < half)).all(axis=1)
    assert depth_below_surface(cell, vertices[inner]).max(initial=0.0) < 0.08 * largest

    corners = vertices[triangles]
    flat = np.isin(corners, (0.0, half)).all(axis=1).any(axis=1)
    rng = np.random.default_rng(7)
    weights = rng.dirichlet(np.ones(3), (np.count_nonzero(~flat), 30))
    sample = np.einsum("fsk,fkd->fsd", weights, corners[~flat]).reshape(-1, 3)
    images = [
        np.where(m == 0, sample, np.where(m == 1, -sample, 2 * half - sample))
        for m in np.array(list(product(range(3), repeat=3)))
    ]
    points = rng.uniform(0, half, (8000, 3))
    depth = depth_below_surface(cell, points)
    distance = cKDTree(np.concatenate(images)).query(points[depth > 0])[0]
    assert np.count_nonzero(depth) > 100
    assert (depth[depth > 0] <= distance + 0.03 * largest).all()


def test_depth_is_the_same_in_every_image():
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 6.25, (200, 3))
    here = depth_below_surface(CELLS["upright"], points)
    assert here.max() > 0
    for sign in product((-1, 1), repeat=3):
        assert depth_below_surface(CELLS["upright"], points * sign) == pytest.approx(here)
    assert depth_below_surface(CELLS["upright"], points + np.array([12.5, -25.0, 12.5])) == pytest.approx(
        here
    )


def kind(nodes, struts):
    return LatticeKind("mine", nodes, struts, constant)


CENTRE = [(0.5, 0.5, 0.5)]
MISSING = {
    "no path along z": (kind(CENTRE + FACES[:4], [(0, k) for k in range(1, 5)]), "no load path along z"),
    "rods that pass": (
        kind(
            [(0, 0.5, 0), (1, 0.5, 0), (0.5, 0, 0.5), (0.5, 1, 0.5), (0, 0, 0), (0, 0, 1)],
            [(0, 1), (2, 3), (4, 5)],
        ),
        "it falls into 3 pieces",
    ),
    "two lattices": (
        kind(
            CENTRE + FACES + CORNERS,
            [(0, k) for k in range(1, 7)] + (simple_cubic().struts + 7).tolist(),
        ),
        "it falls into 2 pieces",
    ),
}


@pytest.mark.parametrize("case", MISSING)
def test_struts_that_miss_each_other_are_named(case):
    lattice, what = MISSING[case]
    with pytest.raises(InputError, match="struts of lattice 'mine' are not connected") as caught:
        StrutCell(lattice, 10.0, 0.5, 0.5)
    assert what in caught.value.what
    assert caught.value.remedy


REFUSED = {
    "erased": ({"offset_xy_mm": -0.75}, "leave no material of struts of 1.5 mm"),
    "erased upright": ({"offset_z_mm": -0.8}, "leave no material of struts"),
    "filled": (
        {"offset_xy_mm": 3.5, "offset_z_mm": 3.5},
        "struts printed 9 mm wide fill the cell of 12.5 mm",
    ),
    "thick": ({"midspan_radius_mm": 4.5}, "openings, 8.839 mm across, close"),
    "size": ({"size_mm": 0.0}, "size_mm = 0 is not positive"),
    "radius": ({"junction_radius_mm": -1.0}, "junction_radius_mm = -1 is not positive"),
    "nan": ({"offset_xy_mm": np.nan}, "offset_xy_mm = nan is not a number"),
    "skin": ({"skin_depth_mm": -0.1}, "skin_depth_mm = -0.1 is negative"),
    "soft": ({"skin_factor": 0.0}, "skin_factor = 0 is not positive"),
    "slanted": (
        {"kind": LatticeKind("slanted", CENTRE + CORNERS, [(0, 1), (0, 8)])},
        "lattice 'slanted' is not its own mirror image across x and y and z",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_cell_that_cannot_be_is_refused(case):
    change, what = REFUSED[case]
    with pytest.raises(InputError) as caught:
        attrs.evolve(PAPER, **change)
    assert what in caught.value.what
    assert caught.value.remedy


def test_a_block_of_no_cells_is_refused():
    with pytest.raises(InputError, match="0 cells a side"):
        specimen_solid(PAPER, 0)
    for around, along in ((18, 4), (4, 4), (12, 0)):
        with pytest.raises(InputError, match="are not offered"):
            Facets(around, along)


def test_a_block_whose_windows_close_fails_its_gate():
    """Struts just under the opening, whose coarse facets touch: the genus tells."""
    cell = StrutCell(STRAIGHT, 1.0, 0.3535, 0.3535)
    with pytest.raises(GateError, match=r"gate: (genus|one component)"):
        specimen_solid(cell, 2, Facets(12, 6))
