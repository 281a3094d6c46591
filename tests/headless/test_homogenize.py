"""`homogenize` and `fit-material` as their users run them: files, figures that agree, and bad input."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from mu_addon.homogenize.effective_file import read_effective
from mu_addon.studies import homogenize

from .processes import here

COARSE = ("--cells", "1", "--friction", "slide", "--strain", "0.1", "--refine", "0.5")
# A block between plates takes two thirds of the time.
CELL = ("--friction", "none", "--refine", "0.3")
TRELOAR = Path(__file__).resolve().parents[1] / "data" / "treloar"


def homogenised(out, options):
    done = here("homogenize", "--preset", "mu-1.0x", *options, "--out", str(out))
    assert done.returncode == 0, done.stderr
    return out, done


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    return homogenised(tmp_path_factory.mktemp("pressed"), COARSE)


def table(path):
    with path.open() as stream:
        rows = list(csv.DictReader(stream))
    return {key: [row[key] for row in rows] for key in rows[0]}


@pytest.mark.slow
def test_it_leaves_tensor_curve_law_and_report(tmp_path, monkeypatch):
    monkeypatch.setattr(homogenize, "STRETCHES", (-0.1, -0.05, -0.02, 0.0, 0.02, 0.05, 0.1))
    out, done = homogenised(tmp_path, CELL)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "complete"
    moduli = summary["moduli_kPa"]
    # Bending along the axes, stretching along the struts.
    assert 2 < moduli["E100"] < 4
    assert 60 < moduli["E111"] < 90
    assert f"{moduli['E100']:.4g} kPa along an axis" in done.stdout
    C = table(out / "tensor.csv")
    assert np.mean([float(C["xx"][0]), float(C["yy"][1]), float(C["zz"][2])]) == pytest.approx(moduli["C11"])
    cell = table(out / "cell.csv")
    strain, stress = (np.array(cell[k], float) for k in ("strain", "stress_kPa"))
    rise = np.interp(0.02, strain, stress) - np.interp(-0.02, strain, stress)
    assert rise / 0.04 == pytest.approx(moduli["E100"], rel=0.02)
    law = read_effective(out / "effective.toml")
    assert law.C44_kPa == pytest.approx(moduli["C44"])
    report = (out / "report.html").read_text()
    for words in ("Young&#x27;s modulus", "Lattice law for the analysis mesh"):
        assert words in report or words.replace("&#x27;", "'") in report


@pytest.mark.nightly(
    "tests/homogenize/test_compression.py::test_a_path_goes_on_from_its_states_to_the_same_ones"
)
def test_a_block_between_plates_is_pressed_drawn_and_reported(pressed):
    out, _ = pressed
    moduli = json.loads((out / "summary.json").read_text())["moduli_kPa"]
    block = table(out / "specimen_slide.csv")
    assert float(block["strain"][-1]) == pytest.approx(0.1)
    assert float(block["stress_kPa"][1]) / float(block["strain"][1]) < moduli["E100"]
    assert (out / "specimen.stl").stat().st_size > 10_000
    assert "Block between plates" in (out / "report.html").read_text()


@pytest.mark.nightly(
    "tests/homogenize/test_compression.py::test_a_path_goes_on_from_its_states_to_the_same_ones"
)
def test_it_resumes_from_what_was_finished(pressed):
    out, _ = pressed
    before = (out / "effective.toml").read_bytes(), (out / "specimen_slide.csv").read_bytes()
    (out / "report.html").unlink()
    done = here("homogenize", "--preset", "mu-1.0x", *COARSE, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert ((out / "effective.toml").read_bytes(), (out / "specimen_slide.csv").read_bytes()) == before
    assert (out / "report.html").exists()


@pytest.mark.nightly("tests/homogenize/test_cell_mesh.py::test_scales_share_one_mesh_and_one_tensor")
def test_other_inputs_set_the_old_results_aside(pressed):
    out, _ = pressed
    done = here(
        "homogenize",
        "--preset",
        "mu-1.5x",
        "--friction",
        "none",
        "--refine",
        "0.5",
        "--no-report",
        "--out",
        str(out),
    )
    assert done.returncode == 0, done.stderr
    assert (out / "stale" / "specimen_slide.csv").exists()
    assert not (out / "specimen_slide.csv").exists()
    # One lattice at another scale: the same moduli, to the last digit of its mesh.
    now, before = (json.loads((p / "summary.json").read_text())["moduli_kPa"] for p in (out, out / "stale"))
    assert now["E100"] == pytest.approx(before["E100"], rel=1e-6)


@pytest.mark.parametrize(
    ("more", "status", "words"),
    [
        (("--cells", "0"), 2, "cells = 0 is out of bounds"),
        (("--strain", "2"), 2, "strain = 2 is out of bounds"),
        (("--refine", "0.4"), 2, "refine = 0.4 is too coarse for the specimen"),
        (("--resin", "no-such-resin"), 2, "no-such-resin"),
    ],
)
def test_bad_input_is_named(tmp_path, more, status, words):
    done = here("homogenize", "--preset", "mu-1.0x", *more, "--out", str(tmp_path / "out"))
    assert done.returncode == status
    assert words in done.stderr
    assert "Traceback" not in done.stderr


def test_an_offset_that_fills_the_cell_is_named(tmp_path):
    unit = tmp_path / "unit.toml"
    unit.write_text("format = 1\nscale = 0.2\n[print]\noffset_xy_mm = 0.5\noffset_z_mm = 0.5\n")
    done = here("homogenize", "--unit", str(unit), "--friction", "none", "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert "[print]" in done.stderr or "offset" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_fit_material_shows_what_a_law_misses(tmp_path):
    out = tmp_path / "rubber"
    words = ("--laws", "neo-hooke", "yeoh", "--hold-out", "equibiaxial")
    done = here("fit-material", str(TRELOAR), *words, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert "law: " in done.stdout
    assert (out / "material.toml").exists()
    assert (out / "report.html").exists()
    summary = json.loads((out / "summary.json").read_text())
    assert "equibiaxial" in json.dumps(summary["laws"]["neo-hooke"]["fails"])
