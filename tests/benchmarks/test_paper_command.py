"""`python -m benchmarks.paper`: its coarse run, its files, and its resumption."""

import csv
import json

import pytest

from benchmarks.paper.__main__ import main

pytestmark = pytest.mark.nightly(
    "tests/benchmarks/test_paper_table.py::test_the_table_hardly_depends_on_the_pressures_that_are_left_out"
)


def rows(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("reproduce") / "out"
    assert main(["--coarse", "--out", str(out), "--json"]) == 0
    return out


def test_the_order_of_paths_is_the_papers(folder):
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    found = summary["agreement"]["volume_fraction"]
    assert found["0.75x"]["spearman"] >= 0.9
    assert found["1.0x"]["spearman"] >= 0.85
    assert found["1.5x"]["spearman"] >= 0.8
    assert all(found[name]["same_choice"] for name in ("0.75x", "1.0x"))
    # What the physics gives at every mesh so far, and the paper's table does not.
    assert not found["1.5x"]["same_choice"]
    assert summary["statements"]["volume_fraction"]["1.5x deviates less than 0.75x"] == "not held"
    for name, angles in summary["angle_deg"].items():
        assert -25 < angles["-20"] < -8, name
        assert 18 < angles["50"] < 35, name


def test_tables_and_page_are_whole(folder):
    table = rows(folder / "table.csv")
    assert len(table) == 2 * 3 * 10
    assert {row["column"] for row in table} == {"0.75x", "1.0x", "1.5x"}
    assert sorted(int(row["rank"]) for row in table[:10]) == list(range(1, 11))
    assert len(rows(folder / "agreement.csv")) == 6
    assert len(rows(folder / "bending.csv")) == 30
    assert {row["verdict"] for row in rows(folder / "statements.csv")} <= {"held", "not held", "undecided"}
    page = (folder / "report.html").read_text(encoding="utf-8")
    for part in ("table", "deviation", "statements", "bending", "sampling"):
        assert f'<section id="{part}"' in page
    assert "<script" not in page


def test_a_second_run_takes_what_is_there(folder):
    before = (folder / "table.csv").read_bytes()
    (folder / "table.csv").unlink()
    kept = {p.name: p.stat().st_mtime_ns for p in (folder / "cache").iterdir()}
    assert main(["--coarse", "--out", str(folder), "--json"]) == 0
    assert (folder / "table.csv").read_bytes() == before
    assert {p.name: p.stat().st_mtime_ns for p in (folder / "cache").iterdir()} == kept
