"""Targets and freedoms as a file has them: what they mean, and what is wrong with them by key and line."""

from pathlib import Path

import attrs
import pytest

from mu_addon.errors import InputError
from mu_addon.materials.library import load_material, material_text
from mu_addon.optimization.design_file import parse_design, read_design
from mu_addon.optimization.freedoms import changed_unit, parameter_of

HEAD = 'format = 1\npreset = "mu-1.0x"\n'
WALL = '[[freedom]]\nparameter = "chambers.wall_mm"\nlow = 0.6\nhigh = 1.2\n'
ANGLE = '[[target]]\nkind = "angle"\npressure_kPa = 30\nlow = 20\n'

KIND = '[[freedom]]\nparameter = "lattice.kind"\nvalues = ["octet"]\n'
SENSOR = '[[target]]\nkind = "deviation"\npressures_kPa = [5]\npath = "x"\nhigh = 1\n'
ASIDE = ANGLE.replace("angle", "tip_position") + 'direction = "x"\n'
GRADED = '[[freedom]]\nparameter = "grading.cells"\nfixed = "* 0 *: 1.1; 0 2 3: 0.9"\n'
CELL = '[[freedom]]\nparameter = "grading.cells"\ncells = "0 2"\nlow = 0.7\nhigh = 1.3\n'
FORCE = '[[target]]\nkind = "tip_force"\npressure_kPa = 20\ngap_mm = 2\nlow = 1\n'


def design(text):
    return parse_design(text, "design.toml")


def test_a_design_has_its_unit_targets_and_freedoms():
    found = design(
        HEAD
        + ANGLE
        + '[[target]]\nkind = "mass"\nobjective = "minimise"\n'
        + '[[target]]\nkind = "printable"\n'
        + WALL
        + '[[freedom]]\nparameter = "chambers.count"\nlow = 5\nhigh = 7\n'
        + '[[freedom]]\nparameter = "chambers.neck_diameter_mm"\nfixed = 11.0\n'
    )
    assert [t.words for t in found.targets] == [
        "at least 20 deg",
        "as small as possible",
        "yes",
        "at least 0.6 mm",
    ]
    assert [f.name for f in found.freedoms] == ["chambers.wall_mm", "chambers.count"]
    assert found.freedoms[1].values == (5, 6, 7)
    assert found.unit.chambers.neck_diameter_mm == 11.0
    again = parse_design(found.texts()["design.toml"], "again", found.unit)
    assert again.texts() == found.texts() | {"design.toml": again.texts()["design.toml"]}
    assert (again.start, again.search, again.unit) == (found.start, found.search, found.unit)


def test_a_resin_of_ones_own_lies_beside_what_is_written(tmp_path):
    own = material_text(load_material("elastic-50a-v1")).replace("Elastic 50A", "My Resin")
    (tmp_path / "mine.toml").write_text(own)
    text = HEAD.replace("format = 1", 'format = 1\nresin = "mine.toml"') + ANGLE + WALL
    found = parse_design(text, "design.toml", folder=tmp_path)
    texts = found.texts()
    (tmp_path / "resin.toml").write_text(texts["resin.toml"])
    again = parse_design(texts["design.toml"], "again", found.unit, tmp_path)
    assert again.texts() == texts
    for name, content in texts.items():
        (tmp_path / name).write_text(content)
    (tmp_path / "mine.toml").unlink()
    assert read_design(tmp_path / "design.toml").texts() == texts


def test_the_path_of_a_target_may_be_a_freedom():
    slope = '[[target]]\nkind = "sensor_slope"\npressures_kPa = [10]\nobjective = "maximise"\n'
    path = '[[freedom]]\nparameter = "path"\nvalues = ["alpha2", "alpha4"]\n'
    row = '[[freedom]]\nparameter = "waveguide.row"\nlow = 1\nhigh = 2\n'
    found = design(HEAD + ANGLE + slope + SENSOR.replace('"x"', '"alpha1"') + WALL + path + row)
    assert found.start == (0.9, "alpha2", 2)
    values = (0.8, "alpha4", 1)
    chosen = found.chosen(found.choice(values))
    assert [t.quantity.path for t in chosen.targets[1:]] == ["alpha4", "alpha1"]
    assert found.unit_of(values).waveguide.row == 1
    assert read(found).start == found.start
    for wrong, words in (('"alpha99"', "is not a path"), ("3", "is not text in quotes")):
        with pytest.raises(InputError, match=words) as error:
            design(HEAD + ANGLE + WALL + path.replace('"alpha4"', wrong))
        assert "line 13, [freedom] values" in error.value.where
    with pytest.raises(InputError, match="path is missing"):
        design(HEAD + ANGLE + slope + WALL)


def test_another_resin_brings_its_moduli_its_density_and_its_elongation(tmp_path):
    own = material_text(load_material("elastic-50a-v1")).replace("value = 2.70", "value = 1.35")
    (tmp_path / "mine.toml").write_text(own)
    text = HEAD + ANGLE + '[[target]]\nkind = "mass"\nobjective = "minimise"\n'
    text += ANGLE.replace("angle", "safety").replace("low = 20", "low = 4") + WALL
    text += '[[freedom]]\nparameter = "resin"\nvalues = ["elastic-50a-v1", "flexible-80a", "mine.toml"]\n'
    found = parse_design(text, "design.toml", folder=tmp_path)
    assert found.start == (0.9, "elastic-50a-v1")
    assert found.unit_of(found.start) == found.unit, "the first resin's unit is as it is drawn"
    stiff = load_material("flexible-80a")
    unit, chosen = found.unit_of((0.9, "flexible-80a")), found.chosen({"resin": "flexible-80a"})
    assert unit.material.membrane_modulus_kPa == pytest.approx(1000 * stiff.modulus_MPa)
    assert (chosen.targets[1].quantity.density_g_per_ml, chosen.targets[2].quantity.elongation) == (1.05, 1.2)
    # A modulus that is free goes before the resin's.
    free = parse_design(
        text + SOFT.replace("lattice", "membrane").replace("low = 5", "low = 20"),
        "design.toml",
        folder=tmp_path,
    )
    assert free.unit_of((0.9, "flexible-80a", 50.0)).material.membrane_modulus_kPa == 50.0
    # A resin of one's own lies beside.
    for name, content in found.texts().items():
        (tmp_path / name).write_text(content)
    (tmp_path / "mine.toml").unlink()
    again = read_design(tmp_path / "design.toml")
    assert again.texts() == found.texts()
    assert again.unit_of((0.9, "resin-1.toml")) == found.unit_of((0.9, "mine.toml"))


def test_a_body_of_ones_own_bounds_the_lattice_and_what_leaves_it_breaks_a_rule(tmp_path):
    half_x, y0, y1, top = 17.0, -17.0, 28.0, 75.0
    corners = [(x, y, z) for z in (0.0, top) for y in (y0, y1) for x in (-half_x, half_x)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["f " + " ".join(str(n + 1) for n in quad) for quad in quads]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    text = HEAD.replace("format = 1", 'format = 1\nbody = "box.obj"') + ANGLE + WALL
    text += '[[target]]\nkind = "mass"\nobjective = "minimise"\n'
    text += '[[freedom]]\nparameter = "chambers.count"\nlow = 6\nhigh = 7\n'
    found = parse_design(text, "design.toml", folder=tmp_path)
    assert found.targets[1].quantity.body is found.body
    # A run keeps the body under a name of its own, and goes by this text to find what it computed.
    renamed = attrs.evolve(found.body, name="body.stl")
    assert repr(attrs.evolve(found.targets[1].quantity, body=renamed)) == repr(found.targets[1].quantity)
    assert found.unit_of((0.9, 6)).chambers.count == 6
    with pytest.raises(InputError, match="cannot be an envelope"):
        found.unit_of((0.9, 7))
    for name, content in found.texts().items():
        (tmp_path / name).write_text(content)
    (tmp_path / "box.obj").unlink()
    assert read_design(tmp_path / "design.toml").texts() == found.texts()


def read(found):
    return parse_design(found.texts()["design.toml"], "again", found.unit)


def test_self_contact_is_asked_for():
    both = HEAD + "self_contact = true\n" + ANGLE + WALL
    assert design(both).self_contact
    assert read(design(both)).self_contact
    assert not design(HEAD + ANGLE + WALL).self_contact


SOFT = '[[freedom]]\nparameter = "material.lattice_modulus_kPa"\nlow = 5\nhigh = 60\n'
THICK = '[[freedom]]\nparameter = "lattice.junction_diameter_mm"\nlow = 1.2\nhigh = 1.8\n'
J_OF_ALPHA1 = (
    '[[target]]\nkind = "deviation"\npath = "alpha1"\npressures_kPa = [10]\nobjective = "minimise"\n'
)


def test_the_printed_body_is_searched_with_its_sensor():
    design(HEAD + ANGLE + J_OF_ALPHA1 + WALL + THICK)


@pytest.mark.parametrize("free", ["low = 5\nhigh = 60", "fixed = 20.0"])
def test_what_a_printed_body_does_not_have_is_no_freedom(free):
    table = f'[[freedom]]\nparameter = "material.lattice_modulus_kPa"\n{free}\n'
    with pytest.raises(InputError, match=r"material\.lattice_modulus_kPa moves nothing") as error:
        design(HEAD + ANGLE + WALL + table)
    assert "line 12, [freedom] parameter" in error.value.where
    assert "material.membrane_modulus_kPa" in error.value.remedy


@pytest.mark.parametrize(
    "folder", ["stronger-finger", "graded-finger", "robust-finger", "straight-finger", "printed-finger"]
)
def test_the_examples_are_read(folder):
    path = Path(__file__).parents[2] / "assets/examples" / folder / "design.toml"
    found = design(path.read_text())
    assert {"angle", "mass", "printable"} <= {t.kind for t in found.targets}
    assert len(found.freedoms) >= 2


def test_force_place_and_path_of_the_tip_are_targets():
    found = design(
        HEAD
        + FORCE
        + '[[target]]\nkind = "tip_position"\npressure_kPa = 30\ndirection = "z"\nhigh = 1\n'
        + '[[target]]\nkind = "workspace"\npressures_kPa = [-10, 30]\nobjective = "maximise"\n'
        + WALL
    )
    assert [(t.name, t.unit) for t in found.targets] == [
        ("tip force at 20 kPa on a wall at 2 mm", "N"),
        ("tip position at 30 kPa along z", "mm"),
        ("workspace", "mm"),
    ]
    force, place, path = (t.quantity for t in found.targets)
    assert (force.pressure_kPa, force.gap_mm, place.direction) == (20.0, 2.0, "z")
    assert [c.pressure_kPa for c in path.conditions] == [-10.0, 0.0, 30.0]


def test_a_unit_with_weight_has_an_angle_at_rest():
    found = design(HEAD + "orientation_deg = 90\nrobust = true\n" + ANGLE.replace("30", "0") + WALL)
    assert found.orientation_deg == 90.0
    assert found.targets[0].quantity.pressure_kPa == 0.0
    assert found.robust
    assert design(HEAD + ANGLE + WALL).orientation_deg is None


def test_a_curve_is_a_target_a_point():
    found = design(
        HEAD + '[[target]]\nkind = "angle"\npoints = [[-15, -10], [30, 16]]\ntolerance = 1\n' + WALL
    )
    assert [(t.quantity.pressure_kPa, t.value) for t in found.targets] == [(-15.0, -10.0), (30.0, 16.0)]


def test_the_struts_of_single_cells_are_free_each_by_a_factor():
    rows = [
        f'[[freedom]]\nparameter = "grading.cells"\ncells = "{cells}"\nlow = 0.7\nhigh = 1.3\n'
        for cells in ("0 -1 *", "0 2 3")
    ]
    found = design(HEAD + ANGLE + "".join(rows) + GRADED)
    assert [f.name for f in found.freedoms] == ["grading.cells[0 -1 *]", "grading.cells[0 2 3]"]
    assert found.start == (1.0, 0.9)
    unit = changed_unit(found.unit, found.freedoms, [0.8, 1.2])
    assert unit.grading.cells == "* 0 *: 1.1; 0 -1 *: 0.8; 0 2 3: 1.2"
    assert [f.value_of(unit) for f in found.freedoms] == [0.8, 1.2]
    # A factor of 1 is not an entry.
    assert changed_unit(unit, found.freedoms, [1.0, 1.2]).grading.cells == "* 0 *: 1.1; 0 2 3: 1.2"


def test_what_follows_a_freedom_changes_with_it():
    found = design(
        HEAD
        + ANGLE
        + '[[freedom]]\nparameter = "chambers.cell_mm"\nlow = 11\nhigh = 14\n'
        + 'also = { "chambers.bladder_diameter_mm" = 2.0 }\n'
    )
    unit = changed_unit(found.unit, found.freedoms, [13.0])
    assert parameter_of(unit, "chambers.bladder_diameter_mm") == 26.0


@pytest.mark.parametrize(
    ("text", "what", "where"),
    [
        (HEAD + ANGLE.replace("angle", "angel") + WALL, "did you mean 'angle'", "line 4"),
        (HEAD + ANGLE + WALL.replace("wall_mm", "wal_mm"), "did you mean", "line 8"),
        (HEAD + ANGLE + WALL.replace("1.2", "0.2"), "not a range", "line 9"),
        (HEAD + ANGLE.replace("low = 20", "value = 20") + WALL, "no tolerance", "line 3"),
        (HEAD + ANGLE + 'objective = "minimise"\n' + WALL, "must have either", "line 3"),
        (HEAD + ANGLE.replace("30", "3000") + WALL, "out of bounds", "line 5"),
        (HEAD + ANGLE + ANGLE + WALL, "two targets are named", "line 7"),
        (HEAD + ANGLE + WALL + WALL, "listed twice", "line 11"),
        (HEAD + ANGLE, "no parameter is free", "freedom"),
        (HEAD + WALL, "no target is given", "target"),
        (HEAD + 'fidelity = "homogenised"\n' + ANGLE + WALL, "unknown key 'fidelity'", "line 3, fidelity"),
        (HEAD + ANGLE + KIND, "not a value of", "line 9"),
        (HEAD + '[[target]]\nkind = "stiffness"\nlow = 1\n' + WALL, "direction is missing", "direction"),
        (HEAD + SENSOR + WALL, "path", "path"),
        ("format = 1\n" + ANGLE + WALL, "no unit is given", "design.toml"),
        (HEAD + ANGLE.replace("30", "0") + WALL, "the unit at rest", "line 5"),
        (HEAD + ANGLE.replace("angle", "tip_force").replace("30", "-5") + WALL, "toward which", "line 5"),
        (HEAD + FORCE.replace("gap_mm = 2", "gap_mm = 999") + WALL, "gap_mm = 999 is out", "line 6"),
        (HEAD + FORCE.replace("gap_mm = 2", 'direction = "y"') + WALL, "unknown key 'direction'", "line 6"),
        (HEAD + ASIDE + WALL, "direction = 'x' is not known", "line 7"),
        (HEAD + ANGLE + CELL, "does not give column, row and chamber", "line 9"),
        (HEAD + ANGLE + CELL.replace('"0 2"', '"0 2 *"').replace("1.3", "3"), "not a range of", "line 10"),
        (HEAD + ANGLE + CELL.replace('"0 2"', '"0 9 *"'), "0 9 *", "line 9"),
        (HEAD + "orientation_deg = 400\n" + ANGLE + WALL, "out of bounds", "line 3"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_key_and_line(text, what, where):
    with pytest.raises(InputError) as error:
        design(text)
    assert what in error.value.what
    assert where in error.value.where
    assert error.value.remedy
