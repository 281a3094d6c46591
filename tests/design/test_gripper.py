"""The gripper: its file, its rules, and its printable part."""

import attrs
import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from scipy.spatial import cKDTree

from mu_addon.design.anchors import window
from mu_addon.design.assets import asset_file
from mu_addon.design.gripper import (
    ROOT,
    Fingers,
    Gripper,
    Plate,
    build_gripper,
    from_toml,
    gripper_names,
    load_gripper,
    read_gripper,
    to_toml,
)
from mu_addon.design.parameters import Waveguide, load_preset, preset_names, write_unit
from mu_addon.design.printing.printer import load_printer
from mu_addon.errors import InputError


def manifold(vertices, triangles):
    return Manifold(Mesh64(vertices, triangles.astype(np.uint64)))


@pytest.fixture(scope="module")
def solid():
    return build_gripper(load_gripper("gripper"))


def test_the_preset_is_two_units_at_1x_with_alpha4():
    assert gripper_names() == ["gripper"]
    gripper = load_gripper("gripper")
    assert gripper == Gripper(unit=load_preset("mu-1.0x"))
    assert gripper.path == "alpha4"
    text = asset_file("presets", "gripper", "gripper", "gripper").read_text()
    assert text.endswith(to_toml(gripper, "mu-1.0x"))


def test_units_and_grippers_are_not_taken_for_each_other():
    assert "gripper" not in preset_names()
    with pytest.raises(InputError, match="'gripper' is a gripper"):
        load_preset("gripper")
    with pytest.raises(InputError, match=r"'mu-1.0x' is not a gripper"):
        load_gripper("mu-1.0x")
    with pytest.raises(InputError, match=r"unknown key|not a gripper"):
        read_gripper(asset_file("presets", "preset", "mu-1.0x"))


def test_a_gripper_survives_its_file(tmp_path):
    unit = attrs.evolve(load_preset("mu-0.75x"), name="mine")
    gripper = Gripper(
        unit, "tight", "alpha7", Fingers(gap_mm=21.5), Plate(thickness_mm=8.0, hole_diameter_mm=0.0)
    )
    write_unit(unit, tmp_path / "finger.toml")
    (tmp_path / "gripper.toml").write_text(to_toml(gripper, "finger.toml"), encoding="utf-8")
    assert read_gripper(tmp_path / "gripper.toml") == gripper


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "gripper"', 'kind = "hand"', "not a gripper"),
        ('unit = "mu-1.0x"', "", "unit is missing"),
        ('unit = "mu-1.0x"', 'unit = "mu-2.0x"', "no preset 'mu-2.0x'"),
        ('path = "alpha4"', 'path = "alpha11"', "no path 'alpha11'"),
        ("gap_mm = 30.0", "gap_mm = 0.0", "out of bounds"),
        ("gap_mm = 30.0", "gab_mm = 30.0", "did you mean 'gap_mm'"),
        ("hole_diameter_mm = 4.3", "hole_diameter_mm = 6.0", "too little of a margin"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(old, new, words):
    text = to_toml(load_gripper("gripper"), "mu-1.0x")
    assert old in text
    with pytest.raises(InputError, match=words):
        from_toml(text.replace(old, new), "gripper.toml")


def test_the_part_is_one_with_two_chambers_of_their_volume(solid):
    g = solid.gates
    assert (g.components, g.bad_edges, g.bad_edges_after_stl, g.inner_shells) == (1, 0, 0, 2)
    assert g.inner_volumes_mm3 == pytest.approx([g.inner_volume_expected_mm3] * 2, rel=2e-3)
    finger = solid.finger.gates
    x, y = load_gripper("gripper").size_mm
    # The plate around both bosses, and the layer by which it reaches into the fingers' feet.
    screws, bosses = 4 * np.pi * 2.15**2, 2 * np.pi * 3.5**2
    plate = 5.0 * (x * y - screws - bosses) + ROOT * (x * y - screws)
    feet = 2 * finger.volume_mm3 + plate - g.volume_mm3
    cap = 2 * np.pi * (6.25**2 - 2.0**2) * ROOT
    assert cap < feet < 4 * cap
    assert g.genus == g.genus_expected > 2 * finger.genus


def test_above_the_plate_a_finger_is_the_unit_with_its_wells_and_seats(solid):
    gripper = load_gripper("gripper")
    bar = solid.finger.bar
    assert bar is not None
    assert len(bar.seats) == 2
    smallest = min(cut.volume for cut in bar.wells)
    above = manifold(solid.vertices, solid.triangles).trim_by_plane([0, 0, 1], 2 * ROOT)
    own = manifold(solid.finger.vertices, solid.finger.triangles).trim_by_plane([0, 0, 1], 2 * ROOT)
    left, right = (above.trim_by_plane([0, side, 0], 0.0) for side in (-1.0, 1.0))
    assert left.num_tri() + right.num_tri() == above.num_tri()
    rotation, shift = gripper.placements[0]
    finger = own.transform(np.column_stack([rotation, shift]))
    common = (left ^ finger).volume()
    assert left.volume() == pytest.approx(common, abs=0.2 * smallest)
    assert finger.volume() == pytest.approx(common, abs=0.2 * smallest)


def test_half_a_turn_leaves_the_part_as_it_is_and_it_fits_the_printer(solid):
    turned = solid.vertices * [-1.0, -1.0, 1.0]
    away, _ = cKDTree(solid.vertices).query(turned)
    assert np.quantile(away, 0.99) < 1e-3
    limits = load_printer("form-4-elastic-50a").limits
    room = sorted(limits[f"build_{axis}_mm"].value for axis in "xyz")
    assert (np.sort(np.ptp(solid.vertices, axis=0)) < room).all()


def test_a_plate_thicker_than_the_inlets_is_bored_through():
    gripper = Gripper(load_preset("mu-1.0x"), plate=Plate(thickness_mm=12.0))
    assert build_gripper(gripper).gates.inner_shells == 2


def test_a_plate_over_a_seat_is_refused():
    unit = attrs.evolve(load_preset("mu-1.0x"), waveguide=Waveguide(end_mm=5.0))
    assert window(unit, "alpha1").start == 1
    with pytest.raises(InputError, match="plate covers the seat"):
        build_gripper(Gripper(unit, path="alpha1"))
