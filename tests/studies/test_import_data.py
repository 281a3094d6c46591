"""Files of test machines become folders of measured data, and nothing is guessed that they do not say."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.lab_files.understood import understand
from mu_addon.measured import read_folder
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.studies.import_ import Import
from mu_addon.studies.starting import start

from ..lab_files import exports
from ..lab_files.test_cells import workbook

# What no export of a coupon says.
COUPON = {"kind": "coupon", "mode": "uniaxial", "section_mm": "12.5x3", "length_mm": "40"}


def written(tmp_path, text, name="one.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def imported(tmp_path, paths, answers, ask=None):
    folder, context = tmp_path / "measured", RunContext(Progress())
    try:
        start(Import(paths=tuple(paths), answers=answers, ask=ask), folder, context)
    finally:
        context.unlock()
    return read_folder(folder)


def modulus_kPa(experiment):
    return np.polyfit(experiment["strain"], experiment["stress_kPa"], 1)[0]


@pytest.mark.parametrize(
    ("text", "answers"),
    [
        (exports.BLUEHILL, {"mode": "uniaxial"}),
        (exports.TESTXPERT, {"mode": "uniaxial"}),
        (exports.TRAPEZIUM, COUPON),
        (exports.MTS, COUPON),
        (exports.HORIZON, COUPON),
        (exports.PLAIN, COUPON | {"unit.Weg": "mm", "unit.Kraft": "N"}),
        (exports.IMPERIAL, COUPON),
    ],
    ids=["bluehill", "testxpert", "trapezium", "mts", "horizon", "plain", "imperial"],
)
def test_every_layout_gives_the_coupon_of_2500_kPa(tmp_path, text, answers):
    measured = imported(tmp_path, [written(tmp_path, text, encoding="cp1252")], answers)
    first = measured.experiments[0]
    assert len(first) == exports.ROWS
    assert modulus_kPa(first) == pytest.approx(2500.0, rel=1e-4)
    if "time_s" in first.columns:
        assert first["time_s"] == pytest.approx(np.array(exports.TIME), abs=1e-5)


def test_what_the_file_says_is_not_asked(tmp_path):
    found = understand([written(tmp_path, exports.TESTXPERT, encoding="cp1252")], {"mode": "uniaxial"})
    assert found.open == ()
    (p,) = found.proposals
    assert p.keys["kind"] == "coupon"
    assert p.keys["specimen"] == "A1"
    assert p.keys["section_mm"] == [12.5, 3.0]
    assert p.keys["length_mm"] == 40.0


def test_what_it_does_not_say_is_asked_and_nothing_is_written(tmp_path):
    path = written(tmp_path, exports.PLAIN)
    with pytest.raises(InputError, match="was it a coupon") as caught:
        imported(tmp_path, [path], {})
    assert "unit.Kraft=N" in caught.value.remedy
    assert not (tmp_path / "measured/experiments.toml").exists()
    assert "question" in (tmp_path / "measured/import.html").read_text()


def test_questions_are_asked_one_by_one(tmp_path):
    said = {"unit.Weg": "mm", "unit.Kraft": "N", **COUPON}
    asked = []

    def ask(found):
        asked.extend(question.key for _, question in found.asked)
        return {question.key: said[question.key] for _, question in found.asked}

    measured = imported(tmp_path, [written(tmp_path, exports.PLAIN)], {}, ask)
    assert asked == ["unit.Weg", "unit.Kraft", "kind", "mode", "section_mm", "length_mm"]
    assert modulus_kPa(measured.experiments[0]) == pytest.approx(2500.0, rel=1e-4)


def test_specimens_of_one_file_are_told_apart(tmp_path):
    measured = imported(
        tmp_path, [written(tmp_path, exports.TRAPEZIUM)], COUPON | {"one 1 _ 2.role": "held_out"}
    )
    one, two = measured.experiments
    assert (one.name, two.name) == ("one 1 _ 1", "one 1 _ 2")
    assert modulus_kPa(two) == pytest.approx(2.0 * modulus_kPa(one), rel=1e-4)
    assert (one.role, two.role) == ("fit", "held_out")


def test_a_place_of_the_machine_is_no_displacement(tmp_path):
    path = written(tmp_path, exports.HORIZON)
    first = imported(tmp_path, [path], COUPON).experiments[0]
    assert first["displacement_mm"][0] == 0.0
    kept = understand([path], COUPON | {"zero": "as_read"}).proposals[0]
    assert kept.columns["displacement_mm"][0] == pytest.approx(3.7)


def test_compression_recorded_as_negative_is_turned_and_told(tmp_path):
    text = "Compression test\nTime (s),Extension (mm),Load (N)\n" + "".join(
        f"{t},{-x},{-f}\n" for t, x, f in zip(exports.TIME, exports.MM, exports.N, strict=True)
    )
    path = written(tmp_path, text)
    answers = {"section_mm": "30x30", "length_mm": "30"}
    found = understand([path], answers)
    assert found.proposals[0].keys["kind"] == "lattice_compression"
    assert sum("sign turned" in words for words in found.proposals[0].concluded) == 2
    experiment = imported(tmp_path, [path], answers).experiments[0]
    assert experiment["strain"].max() > 0
    assert experiment["stress_kPa"].max() > 0
    # One count of cells is that along each axis.
    counted = imported(tmp_path / "again", [path], answers | {"cells": "3", "strut_mm": "1.2"}).experiments[0]
    assert (counted.cells, counted.strut_mm) == ((3, 3, 3), 1.2)


def test_units_and_holds_are_known_by_their_columns(tmp_path):
    ladder = written(tmp_path, exports.LADDER, "ladder.csv")
    hold = written(tmp_path, exports.HOLD, "hold.txt")
    one, two = imported(tmp_path, [ladder, hold], {}).experiments
    assert (one.kind, two.kind) == ("unit_pressure", "pressure_hold")
    assert two["pressure_kPa"][0] == pytest.approx(40.0)
    assert two["time_s"][1] == pytest.approx(0.05)


def test_steps_poses_and_blocked_forces_are_known_by_their_columns(tmp_path):
    t = np.arange(0.0, 4.0, 0.02)
    p = np.where(t < 1.0, 0.0, 20.0)
    slow = np.interp(t, [0.0, 4.0], [0.0, 20.0])
    rows = {
        "step": ("Time [s];Pressure [kPa];Angle [deg]", t, p, 0.5 * p),
        "slow": ("Time [s];Pressure [kPa];Angle [deg]", t, slow, 0.5 * slow),
        "press": ("Time [s];Pressure [kPa];Load [mN]", t, slow, 4.0 * slow),
        "turned": ("Pressure [kPa];Orientation [deg];Angle [deg]", slow, 45.0 * t, 0.2 * slow),
    }
    for name, (head, *columns) in rows.items():
        lines = [head, *(";".join(f"{v:.4f}" for v in row) for row in zip(*columns, strict=True))]
        written(tmp_path, "\n".join(lines) + "\n", f"{name}.csv")
    paths = [tmp_path / f"{name}.csv" for name in rows]
    open_ = understand(paths, {}).open
    assert [(p.name, question.key) for p, question in open_] == [("press", "gap_mm")]
    measured = imported(tmp_path, paths, {"gap_mm": "1.5", "turned.orientation_axis": "y"})
    kinds = {e.name: e.kind for e in measured.experiments}
    assert kinds == {
        "step": "pressure_step",
        "slow": "unit_pressure",
        "press": "blocked_force",
        "turned": "unit_pose",
    }
    by_name = {e.name: e for e in measured.experiments}
    assert by_name["press"].gap_mm == 1.5
    assert by_name["press"]["force_N"].max() == pytest.approx(0.08, rel=1e-2)
    assert by_name["turned"].orientation_axis == (0.0, 1.0, 0.0)


def test_a_workbook_of_three_specimens(tmp_path):
    rows = [["Tensile test"], ["Time", "Displacement", "Force"], ["s", "mm", "N"]]
    rows += [list(values) for values in zip(exports.TIME, exports.MM, exports.N, strict=True)]
    workbook(tmp_path / "a.xlsx", {f"Specimen {k}": rows for k in (1, 2, 3)})
    measured = imported(tmp_path, [tmp_path / "a.xlsx"], COUPON)
    assert [e.name for e in measured.experiments] == [f"a Specimen {k}" for k in (1, 2, 3)]
    assert modulus_kPa(measured.experiments[2]) == pytest.approx(2500.0, rel=1e-4)


def test_a_second_import_adds_and_the_same_one_changes_nothing(tmp_path):
    path = written(tmp_path, exports.BLUEHILL, "a.csv")
    imported(tmp_path, [path], {"mode": "uniaxial"})
    before = (tmp_path / "measured/experiments.toml").read_text()
    imported(tmp_path, [path], {"mode": "uniaxial"})
    assert (tmp_path / "measured/experiments.toml").read_text() == before
    assert len(imported(tmp_path, [written(tmp_path, exports.MTS, "b.csv")], COUPON).experiments) == 2


def test_another_experiment_of_the_name_is_kept(tmp_path):
    path = written(tmp_path, exports.BLUEHILL, "a.csv")
    imported(tmp_path, [path], {"mode": "uniaxial"})
    with pytest.raises(InputError, match="already exists"):
        imported(tmp_path, [path], {"mode": "uniaxial", "length_mm": "50"})
    assert read_folder(tmp_path / "measured").experiments[0].length_mm == 40.0


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"kind": "copuon"}, "is not known"),
        ({"knd": "coupon"}, "answers no question"),
        ({"two.kind": "coupon"}, "answers no question"),
        ({"unit.Krft": "N"}, "answers no question"),
        ({"unit.Kraft": "mm"}, "is not a unit of force"),
        ({"column.Kraft": "weight"}, "is not a quantity"),
        ({"decimal": "p"}, "is not known"),
        (COUPON | {"unit.Weg": "mm", "unit.Kraft": "N", "section_mm": "12.5"}, "2 numbers"),
        (COUPON | {"unit.Weg": "mm", "unit.Kraft": "N", "length_mm": "-4"}, "not above 0"),
    ],
)
def test_a_wrong_answer_is_refused(tmp_path, answers, words):
    with pytest.raises(InputError, match=words):
        understand([written(tmp_path, exports.PLAIN)], answers)
