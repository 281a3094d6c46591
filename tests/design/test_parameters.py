import os
from pathlib import Path

import attrs
import pytest
from hypothesis import given, settings

from mu_addon.design import quantity
from mu_addon.design.parameters import (
    SECTIONS,
    Chambers,
    Unit,
    assumed,
    from_toml,
    load_preset,
    preset_names,
    read_unit,
    to_toml,
    write_unit,
)
from mu_addon.errors import InputError

from . import parameters_page
from .units import units

PRESETS = {"mu-0.75x": (0.75, 21.70), "mu-1.0x": (1.0, 18.34), "mu-1.5x": (1.5, 16.38)}


@given(units())
@settings(max_examples=60)
def test_any_unit_survives_toml(unit):
    for comments in (True, False):
        assert from_toml(to_toml(unit, comments)) == unit


def test_presets_are_the_papers_scales():
    assert preset_names() == sorted(PRESETS)
    for name, (scale, modulus) in PRESETS.items():
        unit = load_preset(name)
        assert (unit.name, unit.scale, unit.material.lattice_modulus_kPa) == (name, scale, modulus)
        assert unit.chambers == Chambers()


def test_lengths_scale_and_the_waveguide_does_not():
    one, small = load_preset("mu-1.0x").dimensions, load_preset("mu-0.75x").dimensions
    scaled = ("cell", "R", "r", "a", "b", "wall", "base_cap", "tip_cap", "inlet_radius", "inlet_length")
    scaled += ("inlet_wall", "junction_diameter", "midspan_diameter", "height", "joint_radius")
    for key in scaled:
        assert getattr(small, key) == pytest.approx(0.75 * getattr(one, key), rel=1e-15)
    fixed = (
        "waveguide_section",
        "waveguide_end",
        "well_width",
        "well_depth",
        "well_pitch",
        "inclusion_radius",
    )
    for key in fixed:
        assert getattr(small, key) == getattr(one, key)
    assert one.bounds == ((-18.75, 18.75), (-18.75, 31.25), (0.0, 75.0))
    named_fixed = {d.name for section in SECTIONS for d in quantity.describe(section) if d.fixed}
    assert named_fixed == {
        "section_mm",
        "well_width_mm",
        "well_depth_mm",
        "well_pitch_mm",
        "end_mm",
        "part_length_mm",
        "part_width_mm",
        "part_height_mm",
        "seat_clearance_mm",
        "seat_wall_mm",
        "cable_mm",
        "inclusion_radius_mm",
        "offset_xy_mm",
        "offset_z_mm",
        "skin_depth_mm",
    }


def test_write_and_read(tmp_path):
    unit = attrs.evolve(load_preset("mu-1.5x"), name='tip "B" – 2')
    write_unit(unit, tmp_path / "deep" / "unit.toml")
    assert read_unit(tmp_path / "deep" / "unit.toml") == unit
    assert os.listdir(tmp_path / "deep") == ["unit.toml"]


def test_hash_is_of_the_values():
    unit = load_preset("mu-1.0x")
    assert unit.hash() == from_toml(to_toml(unit)).hash()
    assert len(unit.hash()) == 64
    thicker = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, wall_mm=0.7))
    assert thicker.hash() != unit.hash()


def test_keys_left_out_keep_their_defaults():
    assert from_toml("format = 1\n[chambers]\nwall_mm = 1\n") == Unit(chambers=Chambers(wall_mm=1.0))


def test_every_parameter_is_described():
    for section in SECTIONS:
        for d in quantity.describe(section):
            assert d.text
            assert d.source.startswith(("paper", "assumed: ", "measured: "))
            if d.type is not str:
                assert d.low <= d.default <= d.high
            elif d.choices:
                assert d.default in d.choices
            assert d.name.endswith(("_mm", "_kPa", "_s")) == bool(d.unit)
        assert [d.name for d in quantity.describe(section)] == [f.name for f in attrs.fields(section)]


def test_assumptions_are_listed_with_their_reasons():
    listed = {a.path: a for a in assumed(load_preset("mu-1.0x"))}
    for path in ("chambers.wall_mm", "chambers.neck_diameter_mm", "lattice.cells_y_plus", "waveguide.row"):
        assert "paper" in listed[path].reason
    assert listed["material.membrane_modulus_kPa"].unit == "kPa"
    assert "chambers.cell_mm" not in listed
    changed = {a.path: a for a in assumed(Unit(chambers=Chambers(wall_mm=0.8)))}
    assert changed["chambers.wall_mm"].value == 0.8
    assert changed["chambers.wall_mm"].reason.startswith("chosen by the user (default 0.9:")


HEAD = "format = 1\nscale = 1.0\n"
BAD_FILES = {
    "syntax": (HEAD + "[chambers]\nwall_mm = = 1\n", "this is not TOML", "line 4"),
    "misspelt": (HEAD + "[chambers]\nwal_mm = 1.0\n", "did you mean 'wall_mm'?", "line 4"),
    "elsewhere": (
        HEAD + "[lattice]\nwall_mm = 1.0\n",
        "it belongs in [chambers]",
        "line 4, [lattice] wall_mm",
    ),
    "top": (HEAD + "[chambers]\nscale = 1.0\n", "it belongs at the top level", "line 4"),
    "table": (HEAD + "[chamber]\nwall_mm = 1.0\n", "did you mean 'chambers'?", "line 3"),
    "not a table": (HEAD + "chambers = 1\n", "chambers is not a table", "line 3"),
    "format": ("format = 2\n", "format = 2 is not known here", "line 1"),
    "name": (HEAD + "name = 3\n", "name = 3 is not a name", "line 3"),
    "text": (HEAD + '[chambers]\nwall_mm = "thin"\n', "wall_mm = 'thin' is not a number", "line 4"),
    "fraction": (HEAD + "[chambers]\ncount = 6.0\n", "count = 6.0 is not a whole number", "line 4"),
    "range": (HEAD + "[chambers]\nwall_mm = 60\n", "wall_mm = 60 mm is out of bounds", "line 4"),
    "huge": (HEAD + f"[chambers]\nwall_mm = {10**400}\n", "is out of bounds", "line 4"),
    "choice": (
        HEAD + '[lattice]\nkind = "body-centered"\n',
        "kind = 'body-centered' is not known; did you mean 'body-centred'?",
        "line 4, [lattice] kind",
    ),
    "no choice": (HEAD + "[lattice]\nkind = 2\n", "kind = 2 is not a text", "line 4"),
    "rule": (HEAD + "[chambers]\n# thick\nwall_mm = 5\n", "too thick", "line 5"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files_are_refused_with_file_and_line(tmp_path, case):
    text, what, where = BAD_FILES[case]
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_unit(path)
    assert what in caught.value.what
    assert where in caught.value.where
    assert "bad.toml" in caught.value.where
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("value", "remedy"),
    [('"0.9 mm"', "write 0.9, without"), ('"0.9"', "write 0.9, without"), ('"1 cm"', "in mm")],
)
def test_a_number_in_quotes_is_told_how_to_be_written(value, remedy):
    with pytest.raises(InputError) as caught:
        from_toml(f"{HEAD}[chambers]\nwall_mm = {value}\n")
    assert remedy in caught.value.remedy


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_unit(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b"name = '\xe9'")
    with pytest.raises(InputError, match="not UTF-8"):
        read_unit(tmp_path / "latin.toml")


def test_parameters_are_changed_by_their_names_all_at_once():
    unit = load_preset("mu-1.0x")
    # The rule of nodes on apices forbids either alone.
    found = unit.evolve(cell_mm=14.0, bladder_diameter_mm=28.0, scale=0.5, midspan_diameter_mm=2.0)
    assert (found.scale, found.dimensions.R, found.lattice.midspan_diameter_mm) == (0.5, 7.0, 2.0)
    assert found.chambers.wall_mm == unit.chambers.wall_mm
    assert unit.evolve(chambers=found.chambers, wall_mm=0.8).chambers == attrs.evolve(
        found.chambers, wall_mm=0.8
    )
    with pytest.raises(InputError, match="no parameter 'wal_mm'; did you mean 'wall_mm'"):
        unit.evolve(wal_mm=1.0)
    with pytest.raises(InputError, match="wall_mm = 60 mm is out of bounds"):
        unit.evolve(wall_mm=60)
    # A section's name is no parameter's: its value would have been kept beside a wall that stays.
    with pytest.raises(InputError, match="did you mean 'wall_mm'"):
        unit.evolve(wall=1.0)


def test_unknown_preset_names_those_there_are():
    with pytest.raises(InputError) as caught:
        load_preset("mu_1.0")
    assert "did you mean 'mu-1.0x'" in caught.value.what
    for name in PRESETS:
        assert name in caught.value.remedy


def test_preset_files_say_which_values_are_assumed():
    from mu_addon.design.assets import asset_root

    for name in PRESETS:
        text = Path(asset_root() / "presets" / f"{name}.toml").read_text()
        assert text.count("assumed:") == len(assumed(load_preset(name)))
        assert max(map(len, text.splitlines())) <= 110


def test_the_documented_table_is_the_code():
    """Where it is not: python -m tests.design.parameters_page."""
    assert parameters_page.PAGE.read_text(encoding="utf-8") == parameters_page.page()
