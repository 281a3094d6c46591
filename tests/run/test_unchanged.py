"""A command given again: it ends at once where nothing has changed, and else is run again."""

import json
import shutil
from pathlib import Path

import pytest

from mu_addon.cli.main import main

DATA = Path(__file__).parents[1] / "data" / "treloar"


@pytest.fixture
def fitted(tmp_path, capfd):
    """Runs a fit in its folder: the titles of the stages that it went through, and what it told."""
    data = shutil.copytree(DATA, tmp_path / "data")

    def run(law="neo-hooke"):
        out = tmp_path / "out"
        words = ["fit-material", str(data), "--laws", law, "--out", str(out), "--no-report", "--json"]
        assert main(words) == 0
        messages = [json.loads(line) for line in capfd.readouterr().out.splitlines()]
        stages = {m["stage"] for m in messages if m["type"] == "progress"}
        return stages, [m for m in messages if m["type"] == "warning"], messages[-1]["summary"]

    return run, data, tmp_path / "out"


def test_it_ends_at_once_and_says_the_same(fitted):
    run, _, out = fitted
    stages, warnings, summary = run()
    assert stages
    kept = {p: p.read_bytes() for p in out.iterdir() if p.suffix in (".csv", ".toml")}
    again = run()
    assert again == (set(), warnings, summary)
    assert {p: p.read_bytes() for p in kept} == kept
    assert json.loads((out / "summary.json").read_text())["status"] == "complete"


def test_it_is_run_again_where_anything_differs(fitted, monkeypatch):
    run, data, out = fitted

    def edit_a_result():
        next(out.glob("*.csv")).write_text("edited\n")

    def add_a_file():
        (out / "notes.txt").write_text("mine\n")

    def drop_a_row():
        table = next(data.glob("*.csv"))
        table.write_text("".join(table.read_text().splitlines(keepends=True)[:-1]))

    def damage_the_record():
        (out / "cache" / "finished.json").write_text('{"asked": []}')

    def renew_the_program():
        monkeypatch.setattr("mu_addon.run.unchanged.package_versions", lambda: {"mu_addon": "0.2.0"})

    run()
    for change in (edit_a_result, add_a_file, drop_a_row, damage_the_record, renew_the_program):
        assert run()[0] == set()
        change()
        assert run()[0], change.__name__
    assert run("yeoh")[0], "other words"
