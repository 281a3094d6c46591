"""`homogenize` as its users run it: files, and figures that agree."""

import csv
import json
import tomllib

import numpy as np
import pytest

from mu_addon.studies import homogenize

from .processes import here

COARSE = ("--cells", "1", "--friction", "slide", "--strain", "0.1", "--refine", "0.5")
# A block between plates takes two thirds of the time.
CELL = ("--friction", "none", "--refine", "0.3")


def homogenised(out, options):
    done = here("homogenize", "--preset", "mu-1.0x", *options, "--out", str(out))
    assert done.returncode == 0, done.stderr
    return out, done


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
    law = tomllib.loads((out / "effective.toml").read_text())
    assert law["moduli"]["C44_kPa"] == pytest.approx(moduli["C44"])
    report = (out / "report.html").read_text()
    for words in ("Young&#x27;s modulus", "Lattice law for the analysis mesh"):
        assert words in report or words.replace("&#x27;", "'") in report


@pytest.mark.nightly(
    "tests/homogenize/test_compression.py::test_a_path_goes_on_from_its_states_to_the_same_ones"
)
def test_a_block_between_plates_is_pressed_drawn_and_reported(tmp_path):
    out, _ = homogenised(tmp_path, COARSE)
    moduli = json.loads((out / "summary.json").read_text())["moduli_kPa"]
    block = table(out / "specimen_slide.csv")
    assert float(block["strain"][-1]) == pytest.approx(0.1)
    assert float(block["stress_kPa"][1]) / float(block["strain"][1]) < moduli["E100"]
    assert (out / "specimen.stl").stat().st_size > 10_000
    assert "Block between plates" in (out / "report.html").read_text()
