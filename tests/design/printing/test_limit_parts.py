"""Parts that show a printer's limits: every feature of its row has the size that the sheet says."""

from functools import cache

import numpy as np
import pytest
import trimesh

from mu_addon.design.printing.check import check
from mu_addon.design.printing.limit_parts import RATIOS, limit_parts
from mu_addon.design.printing.printer import MEANING, load_printer

PRINTER = load_printer()
STRUT_mm = 10.8
PARTS = {part.limit: part for part in limit_parts(PRINTER, STRUT_mm)}


@cache
def surface(limit):
    return PARTS[limit].make()


@cache
def mesh(limit):
    return trimesh.Trimesh(*surface(limit), process=True)


def test_every_limit_has_a_part_but_settings():
    settings = {"build_x_mm", "build_y_mm", "build_z_mm", "support_mm", "layer_mm", "layer_s"}
    assert set(PARTS) == set(MEANING) - settings
    for name, part in PARTS.items():
        assert np.all(np.diff(part.sizes) > 0)
        if name == "density_g_per_ml":
            continue
        assert part.sizes[RATIOS.index(1.0)] == pytest.approx(PRINTER[name], rel=0.05)
        assert str(part.sizes[0]) in part.measure


@pytest.mark.parametrize("limit", PARTS)
def test_a_part_is_one_closed_piece_that_fits_its_printer(limit):
    found = mesh(limit)
    assert found.is_watertight
    assert found.body_count == 1
    assert np.all(np.ptp(found.vertices, axis=0) < PRINTER.room)


@pytest.mark.parametrize(
    ("limit", "stage", "finding", "within"),
    [
        ("solid_mm", "thickness", "thinnest solid", 0.02),
        ("wall_mm", "thickness", "thinnest solid", 0.02),
        ("strut_mm", "thickness", "thinnest solid", 0.02),
        ("gap_mm", "thickness", "narrowest gap", 0.02),
        ("well_width_mm", "thickness", "narrowest gap", 0.02),
        ("leak_diameter_mm", "thickness", "narrowest gap", 0.02),
        ("drain_diameter_mm", "chambers", "drain", 0.05),
    ],
)
def test_the_check_measures_the_finest_of_the_row(limit, stage, finding, within):
    found = check(*surface(limit), PRINTER, stages=(stage,))
    (value,) = (f.value for f in found.findings if f.check == finding)
    assert value == pytest.approx(PARTS[limit].sizes[0], rel=within)


def test_the_cube_that_is_weighed_has_the_volume_that_it_says():
    part = PARTS["density_g_per_ml"]
    assert mesh("density_g_per_ml").volume / 1e3 == pytest.approx(8.0, rel=1e-6)
    assert "8 as drawn" in part.measure
    low, high = part.sizes
    assert low < PRINTER["density_g_per_ml"] < high


def test_slopes_lean_by_their_angles():
    found = mesh("overhang_deg")
    down = found.face_normals[(found.face_normals[:, 2] < -0.5) & (found.triangles_center[:, 2] > 5.0)]
    angles = np.unique(np.degrees(np.arccos(-down[:, 2])).round(3))
    assert angles == pytest.approx(PARTS["overhang_deg"].sizes, abs=0.01)


def test_ledges_and_bridges_reach_as_far_as_they_say():
    low = mesh("overhang_mm").section(plane_origin=[0, 0, 5], plane_normal=[0, 0, 1])
    high = mesh("overhang_mm").section(plane_origin=[0, 0, 11], plane_normal=[0, 0, 1])
    reach = [np.sort([np.ptp(p.vertices[e.points][:, 1]) for e in p.entities]) for p in (low, high)]
    assert reach[1] - reach[0] == pytest.approx(PARTS["overhang_mm"].sizes, abs=1e-4)
    posts = mesh("bridge_mm").section(plane_origin=[0, 0, 4], plane_normal=[0, 0, 1])
    boxes = np.array(
        [[p.min(axis=0), p.max(axis=0)] for p in (posts.vertices[e.points] for e in posts.entities)]
    )
    left = np.unique(boxes[:, 0, 0].round(3))
    spans = [
        np.diff(np.sort(boxes[np.isclose(boxes[:, 0, 0], x, atol=1e-2)][:, :, 1].ravel()))[1] for x in left
    ]
    assert spans == pytest.approx(PARTS["bridge_mm"].sizes, abs=1e-4)


def test_grooves_are_as_deep_and_cups_as_large_as_they_say():
    part = PARTS["well_depth_mm"]
    grooves = mesh("well_depth_mm")
    up = (grooves.face_normals[:, 2] > 0.99) & (grooves.triangles_center[:, 2] > 5.0)
    levels = np.unique(grooves.triangles_center[up, 2].round(4))
    assert 10.0 - levels[:-1][::-1] == pytest.approx(part.sizes, abs=1e-3)
    cups = mesh("cup_ml")
    down, middle = cups.face_normals[:, 2] < -0.99, cups.triangles_center
    levels = np.unique(middle[down, 2].round(3))
    # From below: feet, rims of the larger cups before those of the smaller, the ceiling of all, the rail.
    rims, ceiling = levels[-9:-2][::-1], levels[-2]
    discs = down & np.isclose(middle[:, 2], ceiling, atol=1e-2)
    at = np.digitize(middle[discs, 0], np.sort(ends_between(middle[discs, 0], 7)))
    areas = np.bincount(at, cups.area_faces[discs])
    assert areas * (ceiling - rims) / 1000 == pytest.approx(PARTS["cup_ml"].sizes, rel=0.01)


def ends_between(x, count):
    """Middles of the widest gaps between numbers, which part them into so many groups."""
    x = np.sort(x)
    widest = np.argsort(np.diff(x))[-(count - 1) :]
    return (x[widest] + x[widest + 1]) / 2
