"""What a study's face does, whichever it is: messages, files, report, a second run, one that was stopped."""

import json
import re
import shlex
from fnmatch import fnmatch

import pytest

from mu_addon.design.shapes import box
from mu_addon.design.solid import printable
from mu_addon.design.surface import stl_bytes
from mu_addon.run.kept_results import Results
from mu_addon.studies import study
from tests.golden.commands import COMMANDS
from tests.golden.running import Workspace

from ..headless.processes import here

LINES = {
    "calibrate": COMMANDS["calibrate"].words,
    "check": "check --stl part.stl",
    "design-experiments": COMMANDS["design-experiments"].words,
    "diagnose": COMMANDS["diagnose"].words,
    "export": "export --unit unit.toml --formats stl txt --quality interactive",
    "fit-material": "fit-material tests/data/treloar --laws yeoh",
}
"""Of studies that take seconds; all others are of the same base and have files of their own."""
OTHER = {"calibrate": "--dark 0.05", "fit-material": "--weights relative"}
"""Words that ask for something else."""
OF_EVERY_RUN = ("summary.json", "log.ndjson", "run.lock", "report.html")


class Ran:
    """A study's command in a folder of its own, run once."""

    def __init__(self, name, workspace, patch):
        self.name, self.out = name, workspace.folder / "out" / name
        workspace.write(COMMANDS[name].files)
        (workspace.folder / "part.stl").write_bytes(stl_bytes(*printable(box([-7, -7, 0], [7, 7, 14]))))
        patch.chdir(workspace.folder)
        self.words = [*shlex.split(LINES[name]), "--out", self.out]
        self.first = here(*self.words, "--json")
        assert self.first.returncode == 0, self.first.stdout
        self.messages = [json.loads(line) for line in self.first.stdout.splitlines()]

        (plan,) = (m for m in self.messages if m["type"] == "plan")
        self.plan = plan["stages"]


def results(folder):
    """Bytes of every result, by its place."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in OF_EVERY_RUN and "cache" not in path.parts
    }


@pytest.fixture(scope="module")
def patch():
    with pytest.MonkeyPatch.context() as patch:
        yield patch


@pytest.fixture(scope="module")
def ran(tmp_path_factory, patch):
    workspace, found = Workspace(tmp_path_factory.mktemp("studies") / "work"), {}

    def of(name):
        if name not in found:
            found[name] = Ran(name, workspace, patch)
        return found[name]

    return of


@pytest.mark.parametrize("name", LINES)
def test_a_run_tells_what_it_planned_and_leaves_the_files_it_declares(ran, name):
    run, kind = ran(name), study(name)
    told = [m for m in run.messages if m["type"] == "progress"]
    assert {m["stage"] for m in told} == {title for title, _ in run.plan}
    assert [m["state"] for m in told].count("start") == [m["state"] for m in told].count("end")
    shares = [m["whole"] for m in told]
    assert shares == sorted(shares)
    assert run.messages[-1]["type"] == "result"
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert {title for title, _ in run.plan} == {*summary["seconds"]}
    html = (run.out / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=\"(?!data:|#)|<script", html), "it needs no server"
    layout = kind.layout()
    declared = (layout.inputs, *layout.optional, *kind.files, *kind.to_fill)
    for file in results(run.out):
        assert any(fnmatch(part, pattern) for part in (file, file.partition("/")[0]) for pattern in declared)
    inputs = {file: text.encode() for file, text in kind.read(run.out).texts().items()}
    assert inputs.items() <= results(run.out).items()


@pytest.mark.parametrize("name", LINES)
def test_again_nothing_is_made_and_what_was_lost_is_made_to_the_same_digits(ran, name, monkeypatch):
    """By its command, quietly, and by `resume`, as after a kill between two results."""
    run = ran(name)
    before, made = results(run.out), []
    whole = Results.made

    def noted(self, task, values):
        if self.stages[task[0]].kept:
            made.append(task)
        return whole(self, task, values)

    monkeypatch.setattr(Results, "made", noted)
    again = here(*run.words, "--quiet", "--no-report")
    assert (again.returncode, again.stderr) == (0, "")
    assert again.stdout.startswith(f"results: {run.out}\n")
    assert (made, results(run.out)) == ([], before)
    lost = sorted((run.out / "cache").glob("*-*.npz"))[::2]
    for path in lost:
        path.unlink()
    again = here("resume", run.out, "--no-report")
    assert again.returncode == 0, again.stderr
    assert results(run.out) == before
    assert {path.exists() for path in lost} <= {True}


@pytest.mark.parametrize("name", LINES)
def test_stopped_at_its_last_stage_it_says_so_and_goes_on_to_the_same_digits(ran, name, monkeypatch):
    run, whole = ran(name), Results.made
    *_, last = (title for title, _ in run.plan if title != "report")

    def stopped(self, task, values):
        if self.stages[task[0]].title_of(task[1]) == last:
            raise KeyboardInterrupt
        return whole(self, task, values)

    out = run.out.with_name(f"{name}-stopped")
    with monkeypatch.context() as patch:
        patch.setattr(Results, "made", stopped)
        done = here(*run.words[:-1], out)
    assert done.returncode == 130
    assert "error: stopped by Ctrl-C" in done.stderr
    assert json.loads((out / "summary.json").read_text())["status"] == "partial"
    assert "This run is partial: stopped by Ctrl-C" in (out / "report.html").read_text(encoding="utf-8")
    again = here("resume", out)
    assert again.returncode == 0, again.stderr
    assert "This run is partial" not in (out / "report.html").read_text(encoding="utf-8")
    assert results(out) == results(run.out)


@pytest.mark.parametrize("name", OTHER)
def test_results_of_other_inputs_are_set_aside(ran, name):
    run = ran(name)
    before = results(run.out)
    done = here(*run.words, *OTHER[name].split())
    assert done.returncode == 0, done.stderr
    now = results(run.out)
    aside = {file.removeprefix("stale/"): data for file, data in now.items() if file.startswith("stale/")}
    assert aside.items() <= before.items()
    assert {*kept_apart(name)} & {*aside}
    assert all(now[file] != before[file] for file in kept_apart(name) if file in now)


def kept_apart(name):
    """Results that depend on the words of OTHER."""
    return {"calibrate": ("calibration.toml",), "fit-material": ("material.toml",)}[name]
