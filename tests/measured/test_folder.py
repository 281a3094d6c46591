"""Folders of measured data: what is read, what is told, what is refused, and where."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.measured import read_folder
from mu_addon.measured.kinds import KINDS
from mu_addon.measured.table import read_table

DATA = Path(__file__).parent.parent / "data"


def folder(path, toml, **files):
    path.mkdir(exist_ok=True)
    (path / "experiments.toml").write_text(toml, encoding="utf-8")
    for name, text in files.items():
        (path / f"{name}.csv").write_text(text, encoding="utf-8")
    return path


def entry(**keys):
    lines = ["[[experiment]]"]
    keys = {"name": "a", "kind": "coupon", "file": "a.csv", "role": "fit", "mode": "uniaxial"} | keys
    for key, value in keys.items():
        if value is not None:
            shown = f'"{value}"' if isinstance(value, str) else str(value).lower()
            lines.append(f"{key} = {shown}")
    return "\n".join(lines) + "\n"


HOLD = {"kind": "pressure_hold", "mode": None}
UNIT = {"kind": "unit_pressure", "mode": None}
POSE = {"kind": "unit_pose", "mode": None}
PRESS = {"kind": "blocked_force", "mode": None}
LATTICE = {"kind": "lattice_compression", "mode": None}
GOOD = "strain,stress_kPa\n0,0\n0.1,20\n"


def test_poses_and_blocked_forces_are_read_with_what_describes_them(tmp_path):
    axis = entry(**(POSE | {"orientation_axis": [0.0, 3.0, 4.0]}))
    press = entry(**(PRESS | {"name": "b", "file": "b.csv", "gap_mm": 1.5, "orientation_axis": "y"}))
    texts = {"a": "pressure_bar,orientation_rad,angle_deg\n0.1,1,2\n0.1,2,3\n"}
    texts["b"] = "time_s,pressure_kPa,force_mN\n0,0,0\n1,5,250\n"
    pose, blocked = read_folder(folder(tmp_path, axis + press, **texts)).experiments
    assert pose.orientation_axis == pytest.approx((0.0, 0.6, 0.8))
    np.testing.assert_allclose(pose["orientation_deg"], np.degrees([1.0, 2.0]))
    assert (blocked.gap_mm, blocked.orientation_axis) == (1.5, (0.0, 1.0, 0.0))
    np.testing.assert_allclose(blocked["force_N"], [0.0, 0.25])


def test_copies_of_public_data_are_read_with_what_is_odd_about_them():
    measured = read_folder(DATA / "measured")
    hold, foam, beam, held = measured.experiments
    assert [e.kind for e in measured.experiments] == [
        "pressure_hold",
        "lattice_compression",
        "beam_deadweight",
        "beam_deadweight",
    ]
    assert measured.of("beam_deadweight", "held_out") == (held,)
    assert (foam.axis, foam.specimen, foam.section_mm, foam.length_mm) == ("y", "Sparse_v1", (40, 40), 40)
    assert beam.orientation_deg == 90
    assert held["added_mass_g"].tolist() == [101, 101]
    # The logger paused between 6.776 and 7.348 s; the file says so in its 70th line, a comment above.
    gap, preload = (
        next(r for r in measured.remarks if word in r.what) for word in ("gap in time", "preload")
    )
    assert "0.572 s" in gap.what
    assert gap.where.endswith("hold.csv, row 70")
    assert hold.rows[np.argmax(np.diff(hold["time_s"])) + 1] == 70
    assert "1.23 kPa" in preload.what
    # The stress that the file gives is force over section.
    assert foam["stress_kPa"] == pytest.approx(foam["force_N"] / 1600 * 1e3, abs=1e-3)
    # Its strain is of a longer specimen than the cube's edge, which is told.
    assert any("differ by up to" in r.what for r in measured.remarks)


def test_treloars_coupons():
    measured = read_folder(DATA / "treloar")
    assert measured.remarks == ()
    assert {e.mode: (len(e), e["strain"].max(), e["stress_kPa"].max()) for e in measured.experiments} == {
        "uniaxial": (24, 6.6, 6317.6),
        "equibiaxial": (16, 3.45, 2442.6),
        "pure_shear": (13, 3.97, 1805.0),
    }


def test_strain_and_stress_come_from_displacement_and_force(tmp_path):
    toml = entry(section_mm=[4.0, 2.5], length_mm=50.0)
    e = read_folder(folder(tmp_path, toml, a="displacement_mm,force_N\n0,0\n5,3\n10,5\n")).experiments[0]
    assert e["strain"].tolist() == [0, 0.1, 0.2]
    # 3 N on 10 mm2 are 0.3 MPa.
    assert e["stress_kPa"].tolist() == [0, 300, 500]
    assert e.rows.tolist() == [2, 3, 4]
    with pytest.raises(ValueError, match="read-only"):
        e["strain"][0] = 1


def test_every_field_that_is_given_is_kept(tmp_path):
    toml = entry(
        **LATTICE,
        scale=0.75,
        orientation_deg=-90,
        specimen="B",
        temperature_C=23.5,
        cells=4,
        strut_mm=0.9,
        axis="z",
        mass_g=12.5,
    )
    e = read_folder(folder(tmp_path, toml, a=GOOD)).experiments[0]
    assert (e.scale, e.orientation_deg, e.specimen, e.temperature_C) == (0.75, -90.0, "B", 23.5)
    assert (e.cells, e.axis, e.mass_g, e.mode, e.section_mm) == ((4, 4, 4), "z", 12.5, None, None)
    assert e.strut_mm == 0.9
    other = read_folder(folder(tmp_path, entry(**LATTICE, cells=[4, 3, 2]), a=GOOD)).experiments[0]
    assert other.cells == (4, 3, 2)
    assert np.isnan(other.temperature_C)
    assert other.sha256 == e.sha256


def test_stated_accuracies_are_kept_by_what_they_are_of(tmp_path):
    size = {"section_mm": [10, 5], "length_mm": 20}
    toml = entry(**LATTICE, **size, force_accuracy_N=0.05, displacement_accuracy_mm=0.01)
    e = read_folder(folder(tmp_path, toml, a=GOOD)).experiments[0]
    assert e.stated_accuracy("stress_kPa") == pytest.approx(1.0)
    assert e.stated_accuracy("strain") == pytest.approx(0.0005)
    assert e.stated_accuracy("pressure_kPa") == np.inf
    with pytest.raises(InputError, match="force_accuracy_N needs section_mm"):
        read_folder(folder(tmp_path, entry(**LATTICE, force_accuracy_N=0.05), a=GOOD))
    with pytest.raises(InputError, match="it belongs to"):
        read_folder(folder(tmp_path, entry(**LATTICE, angle_accuracy_deg=0.05), a=GOOD))


def test_markers_may_be_out_of_sight(tmp_path):
    text = "time_s,pressure_kPa,marker2_x_mm,marker2_y_mm,marker2_z_mm\n0,0,1,2,3\n1,5,,2.5,3\n2,9,1,3,3\n"
    measured = read_folder(folder(tmp_path, entry(**UNIT), a=text))
    (marker,) = measured.experiments[0].markers.items()
    assert marker[0] == 2
    assert np.isnan(marker[1][1, 0])
    assert marker[1][2].tolist() == [1, 3, 3]
    assert "1 of 3 values of marker2_x_mm are missing" in measured.remarks[0].what
    assert measured.remarks[0].where.endswith("a.csv, row 3, column marker2_x_mm")


def test_comments_blank_lines_spaces_a_byte_order_mark_and_spare_columns_do_no_harm(tmp_path):
    text = "\ufeff# grips: 3\n\nstrain, stress_kPa, operator\n# run\n0, 0, 7\n\n1e-1, 2.0E1, 7\n"
    measured = read_folder(folder(tmp_path, entry(), a=text))
    e = measured.experiments[0]
    assert e["strain"].tolist() == [0, 0.1]
    assert e.rows.tolist() == [5, 7]
    assert "operator" not in e.columns
    assert "'operator' is not known" in measured.remarks[0].what


def test_columns_in_other_units_are_read_as_the_same_numbers(tmp_path):
    usual = "time_s,pressure_kPa,angle_deg,marker1_y_mm,marker1_z_mm\n0,0,0,10,20\n1.5,50,90,12,25\n"
    other = (
        "time_ms,pressure_bar,angle_rad,marker1_y_cm,marker1_z_m\n"
        "0,0,0,1.0,0.020\n1500,0.5,1.5707963267948966,1.2,0.025\n"
    )
    first, second = (
        read_folder(folder(tmp_path / n, entry(**UNIT), a=t))
        for n, t in zip("ab", (usual, other), strict=True)
    )
    assert first.experiments[0].columns.keys() == second.experiments[0].columns.keys()
    for name, values in first.experiments[0].columns.items():
        assert second.experiments[0][name] == pytest.approx(values, rel=1e-12)
    assert second.remarks == first.remarks
    kilos = "time_s,pressure_kPa,force_kgf\n0,0,0\n1,5,2\n"
    pressed = read_folder(folder(tmp_path / "k", entry(kind="blocked_force", mode=None), a=kilos))
    assert pressed.experiments[0]["force_N"][1] == pytest.approx(19.6133)
    pounds = "time_s,pressure_psi\n0,14.5037738\n1,14.5037738\n2,0\n"
    e = read_folder(folder(tmp_path / "c", entry(**HOLD), a=pounds)).experiments[0]
    assert e["pressure_kPa"][0] == pytest.approx(100.0, rel=1e-7)


def test_rows_that_a_logger_wrote_twice_are_left_out(tmp_path):
    text = "time_s,pressure_kPa\n0,5\n1,4\n1,4\n2,3\n"
    measured = read_folder(folder(tmp_path, entry(**HOLD), a=text))
    assert measured.experiments[0].rows.tolist() == [2, 3, 5]
    assert measured.remarks[0].where.endswith("row 4")


@pytest.mark.parametrize(
    ("keys", "text", "what", "where"),
    [
        ({}, "", "no table", "a.csv"),
        ({}, "# only\n", "no table", "a.csv"),
        ({}, "strain,stress_kPa\n0,0\n", "1 rows of numbers", "a.csv"),
        ({}, "0,0\n1,2\n", "instead of the columns' names", "row 1"),
        ({}, "strain,strain,stress_kPa\n0,0,0\n", "occurs 2 times", "row 1"),
        ({}, "strain,stress_ksi\n0,0\n1,2\n", "'stress_ksi' is in 'ksi'", "column stress_ksi"),
        ({}, "strain,stress\n0,0\n1,2\n", "'stress' is without a unit", "column stress"),
        ({}, "strain_pct,stress_kPa\n0,0\n1,2\n", "read as a bare number", "column strain_pct"),
        ({}, "strian,stress_kPa\n0,0\n1,2\n", "did you mean 'strain'", "a.csv"),
        ({}, "strain,operator\n0,0\n1,2\n", "stress_kPa is missing", "a.csv"),
        ({}, "strain,stress_kPa\n0,0\n0.1,x\n", "'x' is not a number", "row 3, column stress_kPa"),
        (
            {},
            "strain,stress_kPa\n0,0\n# pause\n0.1,inf\n",
            "'inf' is not a number",
            "row 4, column stress_kPa",
        ),
        ({}, "strain,stress_kPa\n0,0\n0.1,-1e308\n", "-1e308 is not a reading", "row 3, column stress_kPa"),
        ({}, "strain,stress_kPa\n0,0\n0.1,1_0\n", "'1_0' is not a number", "row 3"),
        ({}, "strain,stress_kPa\n0,0\n0,1,2\n", "3 values under 2 columns", "row 3"),
        ({}, "strain,stress_kPa\n0,0\n0.1\n", "1 values under 2 columns", "row 3"),
        ({}, "strain,stress_kPa\n0,0\n0.1,\n", "stress_kPa is missing", "row 3, column stress_kPa"),
        ({}, "strain,stress_kPa\n0,0\n-1,5\n", "compression of 100 % or more", "row 3, column strain"),
        ({}, "displacement_mm,force_N\n0,0\n1,2\n", "length_mm is not given", "experiment 'a'"),
        (
            {"length_mm": 5},
            "displacement_mm,force_N\n0,0\n1,2\n",
            "section_mm is not given",
            "experiment 'a'",
        ),
        (LATTICE, "strain,stress_kPa\n0,0\n40,5\n", "compression of 100 % or more", "row 3, column strain"),
        (HOLD, "pressure_kPa\n1\n2\n", "time_s is missing", "a.csv"),
        (HOLD, "time_s,pressure_torr\n0,1\n1,2\n", "it is read in kPa", "column pressure_torr"),
        (
            HOLD,
            "time_s,pressure_bar,pressure_kPa\n0,1,100\n1,2,200\n",
            "the same column in two units",
            "a.csv",
        ),
        (HOLD, "time_h,pressure_kPa\n0,1\n1,2\n", "it is read in s", "column time_h"),
        (
            HOLD,
            "time_s,pressure_kPa\n0,1\n2,2\n1,3\n",
            "runs backward, from 2 to 1 s",
            "row 4, column time_s",
        ),
        (HOLD, "time_s,pressure_kPa\n0,1\n1,2\n1,3\n", "stands still", "row 4, column time_s"),
        (HOLD, "time_s,pressure_kPa\n0,1\n,2\n2,3\n", "time_s is missing", "row 3, column time_s"),
        (UNIT, "time_s,pressure_kPa\n0,1\n1,2\n", "angle_deg is missing", "a.csv"),
        (UNIT, "time_s,pressure_kPa,angle_deg\n0,1,\n1,2,\n", "angle_deg is missing", "row 2"),
        (UNIT, "time_s,pressure_kPa,marker1_x_mm\n0,1,2\n1,2,3\n", "marker 1 lacks marker1_y_mm", "a.csv"),
        (
            UNIT,
            "time_s,pressure_kPa,marker1_x_in,marker1_y_mm,marker1_z_mm\n0,1,1,1,1\n",
            "it is read in mm",
            "column marker1_x_in",
        ),
        (
            {"kind": "beam_deadweight", "mode": None, "section_mm": [1, 1], "length_mm": 9},
            "added_mass_g,tip_deflection_mm\n-5,1\n",
            "is negative",
            "row 2",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_by_file_and_row(tmp_path, keys, text, what, where):
    with pytest.raises(InputError) as error:
        read_folder(folder(tmp_path, entry(**keys), a=text))
    assert what in error.value.what
    assert f"a.csv, {where}".removesuffix(", a.csv") in error.value.where
    assert error.value.remedy


@pytest.mark.parametrize(
    ("toml", "what", "where"),
    [
        ("", "no experiment is defined", "experiments.toml"),
        ("[experiment]\nname = 1\n", "not a list of tables", "experiments.toml"),
        ("experiment = [1]\n", "not a list of tables", "experiments.toml"),
        ("[[experiments]]\n", "did you mean 'experiment'", "experiments.toml"),
        (entry(kind="coupons"), "did you mean 'coupon'", "line 3"),
        (entry(kind=None), "kind is missing", "line 1"),
        (entry(mode="planar"), "mode = 'planar' is not known", "line 6"),
        (entry(lenght_mm=5.0), "did you mean 'length_mm'", "line 7"),
        (entry(cells=3), "it belongs to lattice_compression", "line 7"),
        (entry(scale=0), "out of bounds", "line 7"),
        (entry(length_mm=0), "out of bounds", "line 7"),
        (entry(section_mm=[40.0, -1.0]), "out of bounds", "line 7"),
        (entry(**(LATTICE | {"cells": 2.5})), "is not a list of 3 whole", "line 6"),
        (entry(**(LATTICE | {"strut_mm": 0.9})), "strut_mm needs cells", "line 6"),
        (entry(**(POSE | {"orientation_deg": 5.0})), "is a column of unit_pose", "line 6"),
        (entry(**(POSE | {"orientation_axis": [0, 0, 0]})), "has no length", "line 6"),
        (entry(**(POSE | {"orientation_axis": 3})), "is not a list of 3", "line 6"),
        (entry(**(PRESS | {"gap_mm": -1})), "out of bounds", "line 6"),
        (entry(file="../a.csv"), "outside the folder", "line 4"),
        (entry(file="b.csv"), "cannot read the data", "b.csv"),
        (entry() + entry(), "two experiments are named 'a'", "line 8"),
        (entry() + entry(name="b", role="held_out"), "one of them is held out", "line 10"),
    ],
)
def test_what_is_wrong_in_the_description_is_refused_by_its_line(tmp_path, toml, what, where):
    with pytest.raises(InputError) as error:
        read_folder(folder(tmp_path, toml, a=GOOD))
    assert what in error.value.what
    assert where in error.value.where
    assert error.value.remedy


def test_a_folder_without_a_description_or_with_bytes_that_are_no_text(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the experiments"):
        read_folder(tmp_path / "nowhere")
    folder(tmp_path, entry())
    (tmp_path / "a.csv").write_bytes(b"strain\x01\xff")
    with pytest.raises(InputError, match="not UTF-8"):
        read_folder(tmp_path)


def remarks_on(values, dt=0.1):
    text = "time_s,pressure_kPa\n" + "".join(f"{dt * i!r},{float(v)!r}\n" for i, v in enumerate(values))
    return [r for r in read_table(text, KINDS["pressure_hold"], Path("a.csv")).remarks if "apart" in r.what]


@given(st.integers(0, 10_000), st.sampled_from(["ramp", "triangle", "step", "rest"]), st.integers(20, 200))
def test_a_spike_is_told_and_ramps_corners_steps_and_noise_are_not(seed, shape, n):
    rng = np.random.default_rng(seed)
    t = np.arange(n)
    clean = {
        "ramp": t / n,
        "triangle": np.abs((t % (n // 2)) / (n // 2) - 0.5),
        "step": np.where(t < n // 2, 0.0, 1.0),
        "rest": np.zeros(n),
    }[shape]
    noisy = 20 * clean + rng.normal(0, 0.05, n)
    if shape != "rest":
        # Of pure noise now and then one value is an outlier by any rule.
        assert not remarks_on(noisy)
    at = int(rng.integers(3, n // 2 - 4)) if n > 30 else 4
    noisy[at] += 15.0
    (found,) = remarks_on(noisy)
    assert found.where == f"a.csv, row {at + 2}, column pressure_kPa"


@given(
    st.integers(0, 10_000),
    st.sampled_from([1 / 9.80665, 9.80665, 1e-3, 0.5, 0.2, -0.1]),
    st.integers(12, 40) | st.integers(56, 88),
)
def test_a_unit_that_changes_in_the_middle_of_a_file_is_told_and_a_tear_is_not(seed, factor, row):
    t = np.linspace(0.0, 60.0, 100)
    way = 0.3 * np.interp(t, [0, 30, 60], [0.1, 1, 0.1])
    newton = 8.0 * way * (1 + way) + np.random.default_rng(seed).normal(0, 2e-4, 100)
    newton[row:] *= factor
    lines = (f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), way.tolist(), newton.tolist(), strict=True))
    text = "time_s,displacement_mm,force_N\n" + "\n".join(lines)
    if factor in (0.5, 0.2, -0.1):
        read_table(text, KINDS["coupon"], Path("a.csv"))
        return
    with pytest.raises(InputError, match="as if the unit changed") as error:
        read_table(text, KINDS["coupon"], Path("a.csv"))
    assert error.value.where == f"a.csv, row {row + 2}, column force_N"


@given(st.lists(st.floats(-0.9, 15, allow_nan=False), min_size=2, max_size=30))
def test_numbers_are_read_to_their_last_digit(strain):
    text = "strain,stress_kPa\n" + "".join(f"{s!r},{2 * s!r}\n" for s in strain)
    table = read_table(text, KINDS["coupon"], Path("a.csv"))
    assert table.columns["strain"].tolist() == strain
    assert table.columns["stress_kPa"].tolist() == [2 * s for s in strain]


@pytest.mark.parametrize(("said", "expected"), [("", None), ("absolute", 151.0 - 101.325), ("gauge", 151.0)])
def test_pressures_that_may_be_absolute_are_asked_about(tmp_path, said, expected):
    (tmp_path / "a.csv").write_text("time_s,pressure_kPa\n0,151\n1,150.5\n2,150\n")
    line = f'pressure = "{said}"\n' if said else ""
    (tmp_path / "experiments.toml").write_text(
        f'[[experiment]]\nname = "h"\nkind = "pressure_hold"\nfile = "a.csv"\nrole = "fit"\n{line}'
    )
    if expected is None:
        with pytest.raises(InputError, match="as if they were absolute") as error:
            read_folder(tmp_path)
        assert "a.csv, column pressure_kPa" in error.value.where
    else:
        (hold,) = read_folder(tmp_path).experiments
        assert hold["pressure_kPa"][0] == pytest.approx(expected)
