"""Taking the printer's offsets off a drawing, and finding them on the gauge."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from mu_addon.design import coupons
from mu_addon.design.anchors import windows
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Chambers, Unit, load_preset
from mu_addon.design.profile import (
    cavity_polygon,
    cavity_volume,
    outer_polygon,
    outer_radius,
    revolved_volume,
)
from mu_addon.design.solid import QUALITY, build_solid, lattice_solid
from mu_addon.design.surface import bad_edges, volume
from mu_addon.errors import InputError

SMALL = Unit(chambers=Chambers(count=3))


def test_a_drawn_strut_is_thinner_by_twice_the_offset():
    """Mid-span of a strut: its surface is as far from its axis as nominal, less o."""
    d, facets = SMALL.dimensions, QUALITY["interactive"]
    lattice = lattice_of(d)
    drawn = lattice_solid(d, lattice, facets, -np.full(3, 0.17)).to_mesh64()
    points = np.asarray(drawn.vert_properties)[:, :3]
    start, end = lattice.nodes[lattice.struts[0]]
    axis = (end - start) / np.linalg.norm(end - start)
    along = (points - start) @ axis
    middle = np.abs(along - np.linalg.norm(end - start) / 2) < 0.1
    away = np.linalg.norm(points - start - along[:, None] * axis, axis=1)[middle]
    # Facets are enlarged to their circle's area: 12 sides have corners 1.024 times further out.
    corner = np.sqrt((2 * np.pi / 12) / np.sin(2 * np.pi / 12))
    assert away.min() == pytest.approx(corner * (1.0 - 0.17), abs=1e-3)


def test_the_profile_moves_by_its_offset():
    """By equal offsets every drawn point lies exactly o from the nominal curve, caps and cavity alike."""
    d = load_preset("mu-1.0x").dimensions
    offset = -np.full(3, 0.17)
    z = np.linspace(0, d.height, 200_001)
    curve = cKDTree(np.stack([outer_radius(d, z), z], axis=1))
    drawn = outer_polygon(d, 6, offset)[1:-1]
    inside = drawn[1:-1]
    assert curve.query(inside)[0] == pytest.approx(0.17, abs=1e-6)
    assert drawn[[0, -1], 1] == pytest.approx([0.17, d.height - 0.17])
    wall = curve.query(cavity_polygon(d, 6, offset)[2:-2])[0]
    assert wall == pytest.approx(d.wall - 0.17, abs=1e-6)


@given(st.floats(0.02, 0.3), st.floats(0.02, 0.3))
@settings(max_examples=20)
def test_drawn_cavity_is_larger_by_its_skin(xy, z):
    """The first order of the volume is the mean offset times the area: what is left is of second order."""
    d = load_preset("mu-1.0x").dimensions
    nominal = revolved_volume(cavity_polygon(d, 64))
    assert nominal == pytest.approx(cavity_volume(d), rel=1e-4)

    def grown(share):
        return revolved_volume(cavity_polygon(d, 64, -share * np.array([xy, xy, z]))) - nominal

    assert grown(1.0) > 0
    assert grown(1.0) == pytest.approx(2 * grown(0.5), rel=0.08)
    assert grown(0.02) == pytest.approx(2 * grown(0.01), rel=0.002)


def test_what_the_printer_adds_makes_the_drawing_nominal():
    """Every nominal surface point away from sharp edges lies one offset outside the drawn solid."""
    trimesh = pytest.importorskip("trimesh")
    window = windows(3)[0]
    nominal = build_solid(SMALL, window)
    drawn = build_solid(SMALL, window, take_off=(0.12, 0.12))
    assert drawn.gates.genus == nominal.gates.genus
    surface = trimesh.Trimesh(drawn.vertices, drawn.triangles, process=False)
    dense, _ = trimesh.sample.sample_surface(surface, 2_000_000, seed=1)
    wanted = trimesh.Trimesh(nominal.vertices, nominal.triangles, process=False)
    points, _ = trimesh.sample.sample_surface(wanted, 3_000, seed=2)
    distance = cKDTree(dense).query(points)[0]
    # Nowhere nearer but for facets; beyond sharp edges, and between samples 0.1 mm apart, a little further.
    assert distance.min() > 0.117
    assert np.median(distance) == pytest.approx(0.12, abs=0.01)
    assert np.quantile(distance, 0.9) < 0.15
    assert np.quantile(distance, 0.05) > 0.11
    assert np.mean(np.abs(distance - 0.12) < 0.04) > 0.93
    # The drawn solid lies within the nominal one, its cavity around the nominal cavity.
    assert drawn.gates.volume_mm3 < nominal.gates.volume_mm3
    assert drawn.gates.inner_volume_mm3 > nominal.gates.inner_volume_mm3
    skin = 0.12 * (drawn.gates.area_mm2 + nominal.gates.area_mm2) / 2
    assert nominal.gates.volume_mm3 - drawn.gates.volume_mm3 == pytest.approx(skin, rel=0.1)


def test_offsets_that_erase_or_contradict_are_refused():
    with pytest.raises(InputError, match="walls left when printed"):
        build_solid(SMALL, take_off=(0.45, 0.45))
    with pytest.raises(InputError, match="opposite signs"):
        build_solid(SMALL, take_off=(0.1, -0.1))


@given(st.floats(-0.2, 0.4), st.floats(-0.2, 0.4), st.floats(-0.02, 0.02))
@settings(max_examples=30)
def test_calipers_on_the_gauge_give_the_offsets_back(xy, z, scale):
    sizes = []
    for feature in coupons.FEATURES:
        offset = z if feature.axis == "z" else xy
        sign = 1.0 if feature.kind == "solid" else -1.0
        sizes.append(feature.nominal_mm * (1.0 + scale) + 2.0 * sign * offset)
    found = coupons.offsets(list(coupons.FEATURES), sizes)
    assert found["xy"][0] == pytest.approx(xy, abs=1e-9)
    assert found["z"][0] == pytest.approx(z, abs=1e-9)
    assert found["xy"][2] == pytest.approx(scale, abs=1e-9)


def test_the_standard_error_is_that_of_repeats():
    """200 noisy readings of the gauge: the scatter of what is found is what each said of itself."""
    rng = np.random.default_rng(4)
    nominal = np.array([feature.nominal_mm for feature in coupons.FEATURES])
    runs = [
        coupons.offsets(list(coupons.FEATURES), nominal + rng.normal(0, 0.02, len(nominal)))
        for _ in range(200)
    ]
    for direction in ("xy", "z"):
        values = np.array([run[direction][0] for run in runs])
        stated = np.sqrt(np.mean([run[direction][1] ** 2 for run in runs]))
        assert values.std() == pytest.approx(stated, rel=0.25)


def test_the_gauge_has_the_sizes_of_its_sheet():
    """Cut by a line through each feature, the solid is as long, or the gap as wide, as the sheet says."""
    from manifold3d import Manifold, Mesh64

    from mu_addon.design import shapes

    vertices, triangles = coupons.gauge()
    assert bad_edges(triangles) == 0
    body = Manifold(Mesh64(vertices, triangles.astype("uint64")))
    lines = {"x": ([-1, 3.9, 7.9], [50, 4.1, 8.1]), "y": ([4.9, 11.0, 7.9], [5.1, 20, 8.1])}
    ((low, high),) = [lines["x"]]
    pieces = sorted((shapes.box(low, high) ^ body).decompose(), key=lambda p: p.bounding_box()[0])
    spans = np.array([[p.bounding_box()[0], p.bounding_box()[3]] for p in pieces])
    widths = np.diff(spans, axis=1)[:, 0]
    assert widths[:4] == pytest.approx([0.9, 1.5, 2.0, 3.0], abs=1e-3)
    assert (spans[5:, 0] - spans[4:-1, 1]) == pytest.approx([1.0, 1.5, 2.0], abs=1e-3)
    tall = (shapes.box([43, 12, 5], [43.1, 12.1, 30]) ^ body).decompose()
    heights = sorted(p.bounding_box()[5] - p.bounding_box()[2] for p in tall)
    assert heights == pytest.approx([0.9, 1.5, 2.0], abs=1e-3)
    assert np.ptp(vertices, axis=0)[1:] == pytest.approx([18.0, 22.0], abs=1e-3)


@pytest.mark.parametrize("make", [coupons.strut_coupon, coupons.wall_coupon, coupons.beam_coupon])
def test_coupons_are_closed_and_of_their_gauge(make):
    d = load_preset("mu-1.0x").dimensions
    vertices, triangles = make(d)
    assert bad_edges(triangles) == 0
    assert volume(vertices, triangles) > 0
    if make is coupons.beam_coupon:
        expected = 24.0 * 12 * 8 / 2 + coupons.ARM_MM * d.waveguide_section**2
        assert volume(vertices, triangles) == pytest.approx(expected, rel=1e-6)
    if make is coupons.wall_coupon:
        assert np.ptp(vertices[:, 1]) == pytest.approx(d.wall, abs=1e-3)
        gauge = coupons.GAUGE_MM * coupons.STRIP_MM
        grips = 2 * 15 * 20 + 2 * 8 * (20 + 6) / 2
        assert volume(vertices, triangles) == pytest.approx((gauge + grips) * d.wall, rel=1e-3)
