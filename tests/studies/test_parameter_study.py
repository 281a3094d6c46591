"""A sweep from its file to its table: failures are rows, what is done stays done, and workers may be lost."""

import csv
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import from_toml, load_preset, to_toml
from mu_addon.errors import InputError, MuError
from mu_addon.run import cluster as cluster_module
from mu_addon.run import execution
from mu_addon.run.child import Child
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress
from mu_addon.run.study import stage
from mu_addon.studies.parameter_study import point as point_module
from mu_addon.studies.parameter_study.plan import parse_plan, read_plan
from mu_addon.studies.parameter_study.point import Outcome, Task, run_point
from mu_addon.studies.starting import start
from mu_addon.studies.sweep import Sweep

from .unit_runs import ended

ROOT = Path(__file__).resolve().parents[2]
FAKE = str(Path(__file__).resolve().parents[1] / "run" / "fake_worker.py")
# No measure of speed: what hangs must end some time.
PATIENCE_S = 1800.0
TEXT = """
format = 1
preset = "mu-1.0x"
stages = "simulate"
method = "latin_hypercube"
points = 6
memory_MB = 2000
minimize = ["mass_g"]
maximize = ["angle_range_deg"]
[simulate]
times = 3
mesh = { refine = 0.4 }
[vary]
"chambers.wall_mm" = { low = 0.8, high = 1.2 }
"""
asked = []


def formula(task):
    """A study whose answer is known: it stands where a worker's process would be."""
    asked.append(task.hash())
    wall = from_toml(task.files["unit.toml"]).chambers.wall_mm
    if wall > 1.1:
        return Outcome("failed", 0.1, 1, what="too thick")
    summary = {
        "gates": {"unit.stl": {"volume_mm3": 1000 * wall}},
        "angle_deg": {"-20": -5.0, "20": 10 / wall},
    }
    return Outcome("done", 0.1, 1, summary=json.dumps(summary))


@pytest.fixture
def by_formula(monkeypatch):
    monkeypatch.setattr(point_module, "run_point", formula)


def swept(text, folder, add=0, report=False, **options):
    asked.clear()
    plan = parse_plan(text, folder).continued(folder / "sweep.toml", add)
    context, messages = ended(Sweep(plan=plan, workers=1, **options), folder, report)
    assert context.status == 0, messages[-1]
    return list(csv.DictReader((folder / "points.csv").open(newline=""))), messages


def test_every_point_is_a_row_whatever_became_of_it(tmp_path, by_formula):
    text = TEXT.replace("{ low = 0.8, high = 1.2 }", "{ values = [0.9, 1.0, 1.15, 2.5] }")
    rows, messages = swept(text.replace('"latin_hypercube"', '"grid"'), tmp_path, report=True)
    (plan,) = (m for m in messages if m["type"] == "plan")
    assert {m["stage"] for m in messages if m["type"] == "progress"} <= {name for name, _ in plan["stages"]}
    assert [row["status"] for row in rows] == ["done", "done", "failed", "failed"]
    assert [float(row["mass_g"]) for row in rows[:2]] == pytest.approx([0.9 * 1.01, 1.0 * 1.01])
    assert [float(row["angle_range_deg"]) for row in rows[:2]] == pytest.approx([5 + 10 / 0.9, 15.0])
    assert rows[2]["what"] == "too thick"
    assert "wall" in rows[3]["what"], "the rule that it breaks, without a worker"
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["points"], summary["done"], summary["failed"]) == (4, 2, 2)
    report = (tmp_path / "report.html").read_text()
    for words in ("too thick", "chambers.wall_mm", "2 of 4 points failed"):
        assert words in report
    assert "<script" not in report


def test_what_is_done_stays_done_and_more_can_be_added(tmp_path, by_formula):
    first, _ = swept(TEXT, tmp_path)
    assert len(asked) == 6
    again, _ = swept(TEXT, tmp_path)
    assert (again, asked) == (first, [])
    more, _ = swept(TEXT.replace("points = 6", "points = 8"), tmp_path)
    assert (more[:6], len(more), len(asked)) == (first, 8, 2)
    added, _ = swept(TEXT, tmp_path, add=4)
    assert (added[:8], len(added), len(asked)) == (more, 12, 4)
    # Fewer in the file leave those that are there.
    assert len(swept(TEXT, tmp_path)[0]) == 12
    assert not (tmp_path / "stale").exists()


def test_failures_are_run_again_only_when_asked_for(tmp_path, by_formula):
    text = TEXT.replace("{ low = 0.8, high = 1.2 }", "{ values = [1.0, 1.15] }").replace(
        '"latin_hypercube"', '"grid"'
    )
    swept(text, tmp_path)
    swept(text, tmp_path)
    assert len(asked) == 0
    swept(text, tmp_path, retry=True)
    assert len(asked) == 1


def test_another_range_is_another_sweep_but_shares_its_equal_points(tmp_path, by_formula):
    text = TEXT.replace('"latin_hypercube"', '"grid"').replace("high = 1.2", "high = 1.0, steps = 3")
    first, _ = swept(text, tmp_path)
    rows, _ = swept(text.replace("steps = 3", "steps = 5"), tmp_path)
    assert (len(first), len(rows), len(asked)) == (3, 5, 2)
    assert (tmp_path / "stale" / "points.csv").is_file()


def test_a_grid_cannot_be_added_to(tmp_path):
    with pytest.raises(InputError, match="cannot be added") as caught:
        parse_plan(TEXT.replace('"latin_hypercube"', '"grid"'), tmp_path).continued(tmp_path / "none", 2)
    assert caught.value.where == "--add"


# One point, in a process of its own.


def task(how, **limits):
    files = {"study.toml": "", "unit.toml": ""}
    given = {"memory_MB": 1000, "minutes": 1.0} | limits
    return Task(files, module=(FAKE, how), **given)


@pytest.mark.parametrize(
    ("how", "limits", "words"),
    [
        ("crash", {}, "SIGSEGV"),
        ("wordless", {}, "without a message"),
        ("reported_error", {}, "no equilibrium"),
        ("hang", {"minutes": 0.01}, "longer than the 0.01 minutes"),
        ("hungry", {"memory_MB": 200}, "more than the 200 MB"),
        ("greedy", {"memory_MB": 500}, "refused"),
    ],
)
def test_whatever_happens_to_a_study_becomes_a_row(how, limits, words):
    if how == "greedy" and sys.platform != "linux":
        pytest.skip("only Linux refuses memory")
    row = run_point(task(how, **limits))
    assert row.status == "failed"
    assert words in row.what
    assert row.seconds > 0
    # Looked at every 50 ms, a study that takes 20 MB every 20 ms is some 60 MB over when it is stopped.
    assert row.memory_MB < limits.get("memory_MB", 1000) + 200


def test_a_minute_has_sixty_seconds():
    child = SimpleNamespace(seconds=61.0, progress={})
    short, long = (point_module._too_much(child, task("hang", minutes=m), 0.0) for m in (1.0, 1.1))
    assert (short["where"], long) == ("at its start", None)


def test_a_study_that_is_done_is_a_row_with_its_summary():
    row = run_point(task("garbage"))
    assert (row.status, row.summary) == ("done", "{}")


def test_a_worker_of_another_version_does_not_compute(tmp_path):
    study = Sweep(plan=parse_plan(TEXT, tmp_path))
    with pytest.raises(MuError, match=r"the run 0\.0\.0"):
        execution._elsewhere(study, ("points", 1), {}, "0.0.0 revision 0")


def test_a_study_ends_with_the_worker_that_started_it(tmp_path):
    """The worker is killed outright; its study hangs, and would go on for ever."""
    script = f"""
import os, sys, time
from pathlib import Path
from mu_addon.run.child import Child
child = Child([sys.executable, {FAKE!r}, "orphan"], Path(sys.argv[1]), os.environ, ends_with_parent=True)
while not child.progress:
    child.poll()
    assert child.state == "running", child.error
    time.sleep(0.02)
print(child.progress["stage"], flush=True)
time.sleep(600)
"""
    worker = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    study = int(worker.stdout.readline())
    worker.kill()
    worker.wait()
    end = time.monotonic() + PATIENCE_S
    while _alive(study):
        assert time.monotonic() < end
        time.sleep(0.05)


def _alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    # One that has ended stays until its new parent has asked for it.
    return Path(f"/proc/{pid}/stat").exists() and Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"


def test_a_sweep_that_stops_ends_its_study_at_once(monkeypatch):
    children = []

    class Kept(Child):
        def begin(self):
            super().begin()
            children.append(self)

    def interrupted(child, task):
        raise KeyboardInterrupt

    monkeypatch.setattr(point_module, "Child", Kept)
    monkeypatch.setattr(point_module, "_watch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_point(task("hang", minutes=600.0))
    assert not _alive(children[0].pid)


def test_a_real_study_is_swept(tmp_path):
    (tmp_path / "unit.toml").write_text(to_toml(load_preset("mu-1.0x").evolve(count=3)))
    text = TEXT.replace("{ low = 0.8, high = 1.2 }", "{ values = [0.9] }")
    text = text.replace('preset = "mu-1.0x"', 'unit = "unit.toml"').replace('"latin_hypercube"', '"grid"')
    text = text.replace('"simulate"', '"design"').replace('maximize = ["angle_range_deg"]\n', "")
    text = text.replace("[simulate]\ntimes = 3\nmesh = { refine = 0.4 }\n", "")
    (row,), _ = swept(text, tmp_path)
    assert row["status"] == "done"
    assert 5.0 < float(row["mass_g"]) < 15.0
    assert 100 < float(row["memory_MB"]) < 2000


# A real scheduler and its workers, on this machine's loopback.


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Farm:
    """`dask scheduler` and `dask worker` as processes of their own."""

    def __init__(self, folder):
        self.port, self.folder, self.processes = free_port(), folder, []
        self.address = f"tcp://127.0.0.1:{self.port}"

    def _start(self, *words):
        process = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + words[0], *words[1:]],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONSAFEPATH": "1"},
        )
        self.processes.append(process)
        return process

    def scheduler(self):
        return self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard")

    def worker(self):
        words = "--nthreads 1 --no-nanny --no-dashboard --host 127.0.0.1 --death-timeout 3600"
        return self._start("worker", self.address, *words.split())

    def close(self):
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def farm(tmp_path):
    pytest.importorskip("distributed", reason="an extra")
    found = Farm(tmp_path)
    yield found
    found.close()


class SlowSweep(Sweep):
    """A sweep whose points take a while, and whose answers are known."""

    @stage(
        "points",
        1.0,
        over=attrs.evolve(Sweep.all_stages()["points"].over, names=("task",)),
        parallel=True,
    )
    def points(self, task: Task) -> Outcome:
        time.sleep(0.3)
        return formula(task)


@pytest.mark.slow
def test_a_lost_worker_and_a_restarted_scheduler_lose_no_point(farm, tmp_path):
    """Of two workers one is killed at work; then the scheduler itself, and started again."""
    first = farm.scheduler()
    lost = farm.worker()
    farm.worker()
    folder = tmp_path / "out"
    folder.mkdir()
    text = TEXT.replace("points = 6", "points = 24").replace("high = 1.2", "high = 1.09")
    messages = []

    class Trouble:
        """Kills what is to be killed as points are done, in the sweep's own process."""

        def __call__(self, message):
            messages.append(message)
            if message.get("state") != "run":
                return
            if message["fraction"] >= 4 / 24 and lost.poll() is None:
                lost.send_signal(signal.SIGKILL)
            elif message["fraction"] >= 10 / 24 and first.poll() is None:
                first.send_signal(signal.SIGKILL)
                first.wait()
                farm.scheduler()
                farm.worker()

    plan = parse_plan(text, tmp_path)
    with run_to_end(Progress([Trouble()])) as context:
        start(SlowSweep(plan=plan, scheduler=farm.address), folder, context)
    assert context.status == 0, messages[-1]
    assert lost.poll() is not None
    assert first.poll() is not None
    rows = list(csv.DictReader((folder / "points.csv").open(newline="")))
    assert [row["status"] for row in rows] == ["done"] * 24
    walls = np.array([float(row["chambers.wall_mm"]) for row in rows])
    np.testing.assert_allclose([float(row["mass_g"]) for row in rows], 1.01 * walls)
    assert any("the scheduler was lost" in m.get("what", "") for m in messages)


def test_a_scheduler_that_is_not_there_is_told(tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="an extra")
    monkeypatch.setattr(cluster_module, "PATIENCE_S", 4.0)
    job = Sweep(plan=parse_plan(TEXT, tmp_path), scheduler=f"tcp://127.0.0.1:{free_port()}")
    context, messages = ended(job, tmp_path / "out")
    assert context.status == 1
    assert "no scheduler answers" in messages[-1]["what"]
    assert "dask scheduler" in messages[-1]["what_to_do"]
    assert (tmp_path / "out" / "points.csv").is_file()


def test_without_dask_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="not installed") as caught:
        cluster_module.Cluster("tcp://127.0.0.1:1")
    assert "mu_addon[sweeps]" in caught.value.remedy


def test_the_example_is_a_sweep_that_can_be_read(tmp_path):
    example = ROOT / "assets" / "examples" / "sweep"
    shutil.copytree(example, tmp_path / "sweep")
    plan = read_plan(tmp_path / "sweep" / "sweep.toml")
    assert all(plan.task(number) is not None for number in range(1, plan.size + 1))
