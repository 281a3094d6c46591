"""A body of the user's own: what is wrong with it is found, and where; a sound one holds the lattice."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.anchors import window
from mu_addon.design.body import (
    Body,
    body_of,
    covering,
    envelope,
    flaws,
    half,
    inside,
    misfits,
    read_body,
    section,
)
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.solid import build_solid
from mu_addon.design.steps import Stack, StepInputs, along
from mu_addon.design.surface import stl_bytes, volume
from mu_addon.errors import InputError

from .bodies import arrays, box, cylinder

UNIT = load_preset("mu-1.0x")
D = UNIT.dimensions


def test_its_section_is_the_outline_in_the_plane_of_bending():
    [outline] = section(box([-3.0, -2.0, 1.0], [4.0, 5.0, 9.0]))
    assert np.ptp(outline, axis=0) == pytest.approx([7.0, 8.0])
    assert outline.min(axis=0) == pytest.approx([-2.0, 1.0])


@pytest.fixture(scope="module")
def ellipse():
    """As wide as the lattice's box, longer than the unit."""
    return cylinder(18.75, 25.0, 6.25, -2.0, 80.0)


def test_a_sound_body_has_no_flaws(ellipse):
    assert flaws(ellipse) == []
    assert misfits(ellipse, D) == []


def test_it_is_cut_flat_at_the_units_ends(ellipse):
    cut = envelope(ellipse, D)
    assert cut.bounds[:, 2].tolist() == [0.0, D.height]
    area = 32 * np.sin(2 * np.pi / 64) * 18.75 * 25.0  # of the polygon
    # Vertices are rounded to 1e-5 mm.
    assert volume(cut.vertices, cut.triangles) == pytest.approx(area * D.height, rel=1e-6)
    again = envelope(cut, D)
    assert volume(again.vertices, again.triangles) == volume(cut.vertices, cut.triangles)


def test_holes_are_found_where_they_are(ellipse):
    gone = 17
    torn = Body(ellipse.vertices, np.delete(ellipse.triangles, gone, axis=0))
    (flaw,) = flaws(torn)
    corners = ellipse.vertices[ellipse.triangles[gone]]
    middles = (corners + np.roll(corners, 1, axis=0)) / 2
    assert "3 edges are open" in flaw.what
    assert sorted(flaw.places.round(6).tolist()) == sorted(middles.round(6).tolist())
    with pytest.raises(InputError, match="3 edges are open") as error:
        envelope(torn, D)
    assert "first at (" in error.value.where
    assert "fill the holes" in error.value.remedy


def test_one_face_that_looks_inward_is_found_and_all_of_them_are_turned(ellipse):
    turned = ellipse.triangles.copy()
    turned[5] = turned[5, ::-1]
    (flaw,) = flaws(Body(ellipse.vertices, turned))
    assert "3 edges are open or have inconsistently oriented neighbours" in flaw.what
    inside_out = body_of(ellipse.vertices, ellipse.triangles[:, ::-1])
    assert volume(inside_out.vertices, inside_out.triangles) > 0
    assert flaws(inside_out) == []


def test_a_surface_that_cuts_itself_is_found_where_it_does():
    left, right = box([-20, -20, 0], [5, 20, 75]), box([-5, -15, 10], [20, 15, 65])
    both = Body(
        np.concatenate([left.vertices, right.vertices]),
        np.concatenate([left.triangles, right.triangles + len(left.vertices)]),
    )
    (flaw,) = flaws(both)
    assert "intersects itself" in flaw.what
    # Where they pass through each other: the face x = 5 of one, along the sides of the other.
    assert np.allclose(flaw.places[:, 0], 5.0)
    y, z = flaw.places[:, 1], flaw.places[:, 2]
    assert (np.isclose(abs(y), 15) | np.isclose(z, 10) | np.isclose(z, 65)).all()


def test_doubled_faces_and_separate_bodies_are_found(ellipse):
    doubled = Body(ellipse.vertices, np.concatenate([ellipse.triangles, ellipse.triangles[:1]]))
    assert any("more than two faces" in flaw.what for flaw in flaws(doubled))
    far = box([100, 0, 0], [110, 10, 10])
    two = Body(
        np.concatenate([ellipse.vertices, far.vertices]),
        np.concatenate([ellipse.triangles, far.triangles + len(ellipse.vertices)]),
    )
    (flaw,) = flaws(two)
    assert "2 separate bodies" in flaw.what
    assert np.allclose(flaw.places[np.argmax(flaw.places[:, 0])], [105, 5, 5])


def test_a_body_must_hold_the_chambers_from_end_to_end():
    (flaw,) = misfits(cylinder(20.0, 20.0, 0.0, 0.0, 60.0), D)
    assert "from z = 0 to 60 mm" in flaw.what
    (flaw,) = misfits(cylinder(12.0, 20.0, 0.0, 0.0, 75.0), D)
    # Six bladders of radius 12.5 come out on either side.
    assert "in 12 places" in flaw.what
    chamber = flaw.places[:, 2] / 12.5 - 0.5
    assert np.abs(chamber - np.rint(chamber)).max() < 0.2
    assert len(np.unique(np.rint(chamber))) == 6
    # On the actuator and outside the body, or on both.
    reach = np.hypot(flaw.places[:, 0] / 12.0, flaw.places[:, 1] / 20.0)
    assert reach.min() > 1.0 - 1e-3
    assert np.hypot(*flaw.places[:, :2].T).max() < 12.51
    assert misfits(cylinder(12.7, 12.7, 0.0, 0.0, 75.0, 256), D) == []


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_inside_is_what_winding_says(seed):
    from mu_addon.design.surface import winding_number

    random = np.random.default_rng(seed)
    body = cylinder(*random.uniform(5, 30, 2), random.uniform(-9, 9), -3.0, 40.0, int(random.integers(3, 30)))
    points = random.uniform(-35, 45, (200, 3))
    assert np.array_equal(inside(body, points), winding_number(body.vertices, body.triangles, points) > 0.5)


def test_inside_of_a_box_on_its_own_grid():
    """Points straight above corners and edges of triangles, as lattice nodes are."""
    body = box([-12.5, -12.5, 0.0], [12.5, 12.5, 75.0])
    ticks = np.array([-18.75, -6.25, 0.0, 6.25, 12.4, 12.6])
    points = np.stack(np.meshgrid(ticks, ticks, [-1.0, 1.0, 37.5, 74.0, 76.0]), axis=-1)
    within = (abs(points[..., :2]) < 12.5).all(axis=-1) & (points[..., 2] > 0) & (points[..., 2] < 75)
    assert np.array_equal(inside(body, points), within)


def test_half_of_a_mirror_image_and_none_of_another(ellipse):
    right = half(envelope(ellipse, D))
    whole = volume(*arrays(envelope(ellipse, D).manifold))
    assert volume(right.vertices, right.triangles) == pytest.approx(whole / 2, rel=1e-6)
    assert right.bounds[0, 0] == 0.0
    sheared = ellipse.vertices + 0.1 * ellipse.vertices[:, [1]] * [1.0, 0.0, 0.0]
    assert half(envelope(Body(sheared, ellipse.triangles), D)) is None


def test_files_bring_the_same_body(ellipse, tmp_path):
    (tmp_path / "a.obj").write_text(ellipse.text())
    (tmp_path / "a.stl").write_bytes(stl_bytes(ellipse.vertices, ellipse.triangles))
    exact = read_body(tmp_path / "a.obj")
    assert exact.hash == ellipse.hash
    rounded = read_body(tmp_path / "a.stl")
    assert flaws(rounded) == []
    assert len(rounded.triangles) == len(ellipse.triangles)
    assert np.abs(rounded.bounds - ellipse.bounds).max() < 1e-5


def test_too_fine_or_broken_arrays_are_refused():
    with pytest.raises(InputError, match="no surface"):
        body_of(np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(InputError, match="not a number"):
        body_of([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(InputError, match="60001 triangles"):
        Body(np.zeros((3, 3)), np.tile([0, 1, 2], (60_001, 1)))


def test_the_lattice_is_cut_to_the_body(ellipse):
    cut = envelope(ellipse, D)
    solid = build_solid(UNIT, window(UNIT, "alpha4"), body=cut)
    assert solid.gates.components == 1
    assert solid.window.name == "alpha4"
    above = solid.vertices[solid.vertices[:, 2] > 1e-3]
    reach = (above[:, 0] / 18.75) ** 2 + ((above[:, 1] - 6.25) / 25.0) ** 2
    assert reach.max() < 1.0 + 1e-4
    plain = build_solid(UNIT, window(UNIT, "alpha4"))
    assert 0.7 < solid.gates.volume_mm3 / plain.gates.volume_mm3 < 0.95


def test_cells_cover_a_body_wider_than_the_box():
    wide = envelope(cylinder(40.0, 30.0, 0.0, -1.0, 76.0), D)
    nodes = lattice_of(covering(D, wide)).nodes
    assert nodes[:, 0].max() >= 40.0
    assert nodes[:, 1].min() <= -30.0
    assert np.allclose(nodes[:, 2].max(), D.height)


def test_a_path_outside_the_body_is_refused():
    narrow = envelope(cylinder(20.0, 20.0, 0.0, -1.0, 76.0), D)
    with pytest.raises(InputError, match="waveguide along alpha4 leaves the body"):
        build_solid(UNIT, window(UNIT, "alpha4"), body=narrow)


def test_steps_take_the_body(ellipse):
    cut, stack = envelope(ellipse, D), Stack()
    trimmed = stack.value("trim", StepInputs(UNIT, body=cut))
    ends = np.concatenate([along(trimmed.ends, t[:, None])[:, 0] for t in (trimmed.first, trimmed.last)])
    assert ((ends[:, 0] / 18.75) ** 2 + ((ends[:, 1] - 6.25) / 25.0) ** 2).max() <= 1.0
    before = dict(stack.counts)
    stack.value("trim", StepInputs(UNIT))
    assert {name for name in stack.counts if stack.counts[name] > before[name]} == {"cells", "trim"}


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply"])
def test_a_file_of_gigabytes_or_a_pipe_is_no_body(tmp_path, suffix):
    large = tmp_path / f"large{suffix}"
    large.touch()
    os.truncate(large, 3 << 30)
    with pytest.raises(InputError, match="its 3221 MB are more than the 34 MB"):
        read_body(large)
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="no body can be read"):
        read_body(pipe)


PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar {corner} vertex_indices
end_header
0 0 0
{far} 0 0
0 20 0
0 0 20
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def test_a_file_whose_faces_are_no_numbers_of_points_is_refused(tmp_path):
    path = tmp_path / "body.ply"
    path.write_text(PLY.format(corner="int", far=20))
    assert len(read_body(path).triangles) == 4
    path.write_text(PLY.format(corner="float", far=20))
    with pytest.raises(InputError, match="no body can be read"):
        read_body(path)


def test_a_file_without_points_and_an_archive_are_named(tmp_path):
    path = tmp_path / "scan.ply"
    path.write_text(PLY.format(corner="int", far=20).replace("vertex 4", "vertex 0"))
    with pytest.raises(InputError, match="it has no points"):
        read_body(path)
    path = tmp_path / "part.stl"
    path.write_bytes(b"PK\x03\x04" + bytes(90))
    with pytest.raises(InputError, match="an archive, as a 3MF"):
        read_body(path)


@pytest.mark.parametrize(
    ("name", "content", "what", "remedy"),
    [
        ("plate.3mf", b"PK\x03\x04", "as a 3MF", "slicer and export the part as STL"),
        ("part.step", b"ISO-10303-21;", "a STEP file", "chord error"),
        ("renamed.stl", b"ISO-10303-21;", "a STEP file", "chord error"),
        ("part.f3d", b"PK\x03\x04", "a CAD file", "chord error"),
        ("scene.glb", b"glTF\x02", "a glTF scene", "Blender"),
        ("part.gcode", b";FLAVOR:Marlin\nG28\n", "sliced", "the part that was sliced"),
        ("renamed.stl", b"; generated by a slicer\nG28\n", "sliced", "the part that was sliced"),
        ("part.ctb", b"\x07\x00\xfd\x12", "sliced", "the part that was sliced"),
        ("pulled.stl", b"version https://git-lfs.github.com/spec/v1", "Git LFS", "git lfs pull"),
        ("saved.stl", b"<!DOCTYPE html>", "a web page", "download the file itself"),
    ],
)
def test_other_formats_are_told_with_what_to_do(tmp_path, name, content, what, remedy):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=what) as caught:
        read_body(path)
    assert remedy in caught.value.remedy


def test_a_body_of_slivers_alone_is_refused():
    """Found by the fuzzer: nothing is left of it once vertices that agree are merged."""
    with pytest.raises(InputError, match="no surface"):
        body_of([[0, 0, 0], [0, 0, 1e-9], [0, 1e-9, 0]], [[0, 1, 2]])


def test_coordinates_that_no_grid_holds_are_refused_and_not_changed(tmp_path):
    path = tmp_path / "body.ply"
    path.write_text(PLY.format(corner="int", far="1e30"))
    with pytest.raises(InputError, match=r"1e\+30 mm lies beyond 1e\+06 mm"):
        read_body(path)


@pytest.mark.parametrize(
    ("unit", "per_mm"), [("inches", 25.4), ("metres", 1000), ("centimetres", 10), ("micrometres", 0.001)]
)
def test_a_guessed_unit_of_length_passes_the_check_that_failed(unit, per_mm):
    """By its size alone a body in inches could be in centimetres, in which it would not reach."""
    body = box([-30.0, -30.0, -15.0], [30.0, 30.0, D.height + 5.0])
    vertices, triangles = body.vertices, body.triangles
    (flaw,) = misfits(body_of(vertices / per_mm, triangles), D)
    assert unit in flaw.what
    assert flaw.remedy == f"scale it by {per_mm:g}"
    assert misfits(body_of(vertices / per_mm * per_mm, triangles), D) == []
    # What no unit of length would make fit is told of by its ends.
    (flaw,) = misfits(body_of((vertices + np.array([0.0, 0.0, 76.0])) / per_mm, triangles), D)
    assert "it reaches from" in flaw.what
