"""`compare`: finished runs side by side, in the terminal and in a folder."""

import csv

from tests.studies.bent_motion import ANGLES, write_bent_run

from .processes import assert_clear_failure, here


def test_two_runs_differ_by_what_was_changed_and_what_came_of_it(tmp_path):
    thin, thick = (
        write_bent_run(tmp_path, at, wall, more, ranked=False).folder
        for at, wall, more in ((1.0, 0.8, 1.2), (2.0, 1.0, 1.0))
    )
    out = tmp_path / "out"
    done = here("compare", thin, thick, "--out", out)
    assert done.returncode == 0, done.stderr
    with (out / "compare.csv").open(newline="") as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    more = f"{thick.name} - {thin.name}"
    assert rows["chambers.wall_mm"] == {
        "quantity": "chambers.wall_mm", thin.name: "0.8", thick.name: "1.0", more: "0.19999999999999996",
    }  # fmt: skip
    assert float(rows["angle_highest_deg"][more]) == -0.2 * ANGLES[-1] + 0.0
    # What is equal is no difference, and is not shown.
    assert not {"chambers.count", "pressures_kPa"} & {*rows}
    lines = done.stdout.splitlines()
    assert lines[0].split() == [thin.name, thick.name, *more.split()]
    assert any(line.split() == ["chambers.wall_mm", "0.8", "1", "0.2"] for line in lines)
    assert "Angle against pressure" in (out / "report.html").read_text(encoding="utf-8")


def test_runs_that_have_nothing_in_common_are_refused(tmp_path):
    run = write_bent_run(tmp_path, 1.0).folder
    assert_clear_failure(here("compare", run), 2, "give two or more")
    assert_clear_failure(here("compare", run, tmp_path / "none"), 2, "contains no study")
