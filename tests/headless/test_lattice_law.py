"""`--lattice`: another law of the lattice, another motion, and a folder that says so."""

import json
import tomllib

import pytest

from mu_addon.homogenize.effective_file import read_effective, write_effective

from ..homogenize.lattice_laws import body_centred
from .processes import assert_clear_failure, here, run

SMALL = ("--preset", "mu-1.0x", "--refine", "0.4", "--order", "1", "--times", "5")


@pytest.mark.nightly(
    "tests/usecases/test_lattice_law.py::test_the_lattices_law_decides_the_motion_and_is_kept_with_it"
)
def test_a_run_with_a_law_of_the_lattice_keeps_and_reports_it(tmp_path):
    law, folder = tmp_path / "mine.toml", tmp_path / "out"
    write_effective(law, body_centred())
    done = run("simulate", *SMALL, "--out", folder, "--lattice", law)
    assert done.returncode == 0, done.stderr
    study = tomllib.loads((folder / "study.toml").read_text())["simulate"]
    assert study["lattice"] == "effective.toml"
    assert len(study["lattice_sha256"]) == 64
    assert read_effective(folder / "effective.toml") == body_centred()
    report = (folder / "report.html").read_text()
    for words in (
        "lattice law.cubic shear.G_MPa",
        "body-centred cell of Elastic 50A",
        "not used: effective.toml",
    ):
        assert words in report
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["study"]["lattice"]["C44_kPa"] == 60.0
    assert max(s["largest"] for s in summary["lattice_stretch"].values()) > 1.05


def test_a_law_that_cannot_be_used_is_named_before_any_work(tmp_path):
    law = tmp_path / "mine.toml"
    law.write_text(body_centred().text().replace("format = 1", "format = 7"))
    done = here("place", *SMALL, "--out", tmp_path / "out", "--lattice", law)
    assert_clear_failure(done, 2, "mine.toml", "format is 7")
    assert not (tmp_path / "out" / "unit.stl").exists()
