"""Plans of runs: the stages that a command tells at its start are those that come, and its share grows."""

import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.design.parameters import Unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run import progress
from mu_addon.usecases.simulate_and_place import job as study
from mu_addon.usecases.simulate_and_place.expected import TOUCHING, work
from tests.headless.processes import homogenised

STUDY = ["--no-self-contact", "--refine", "0.3", "--times", "3"]
SWEEP = """
format = 1
preset = "mu-0.75x"
stages = "simulate"
method = "grid"

[simulate]
times = 3
mesh = { order = 1, refine = 0.3 }

[vary]
"chambers.wall_mm" = { low = 0.9, high = 1.2, steps = 2 }
"""


def messages_of(monkeypatch, tmp_path, words):
    """Every message of a command."""
    found = []
    monkeypatch.setattr(progress, "terminal", lambda stream: found.append)
    with homogenised(order=1):
        assert main([*words, "--out", str(tmp_path / "out"), "--no-report"]) == 0
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["fit-material", "tests/data/treloar", "--laws", "yeoh"],
        pytest.param(
            ["design", "--preset", "mu-0.75x", "--path", "alpha4"],
            marks=pytest.mark.nightly("test_a_command_does_what_it_planned"),
        ),
        ["simulate", "--preset", "mu-0.75x", *STUDY],
        pytest.param(
            ["sweep", "sweep.toml"],
            marks=pytest.mark.nightly(
                "tests/usecases/test_parameter_study.py::test_every_point_is_a_row_whatever_became_of_it"
            ),
        ),
    ],
    ids=lambda words: words[0],
)
def test_a_command_does_what_it_planned(monkeypatch, tmp_path, words):
    (tmp_path / "sweep.toml").write_text(SWEEP)
    words = [str(tmp_path / word) if word == "sweep.toml" else word for word in words]
    found = messages_of(monkeypatch, tmp_path, words)
    (plan,) = (m for m in found if m["type"] == "plan")
    told = [m for m in found if m["type"] == "progress"]
    assert {m["stage"] for m in told} <= {name for name, _ in plan["stages"]}
    shares = [m["whole"] for m in told]
    assert shares == sorted(shares)
    left = [m["whole_seconds_left"] for m in told if not m.get("why")]
    assert all(seconds is not None for seconds in left)


@pytest.mark.parametrize(("printed", "suction"), [(False, 1.0), (True, TOUCHING)])
def test_suction_takes_longest_where_walls_touch(printed, suction):
    mesh = MeshSettings(fidelity="resolved" if printed else "homogenised")
    job = study.Job(Unit(), study.grasp(), mesh, self_contact=printed)
    assert [work(job, [p]) for p in (-20.0, 0.0, 40.0)] == [suction, 0.0, 1.0]
    assert work(job, np.unique(job.samples[1])) == suction + max(suction / 4.0, 1.0) + 4
