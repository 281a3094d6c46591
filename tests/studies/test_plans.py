"""Plans of runs: the stages that a command tells at its start are those that come, and its share grows."""

import attrs
import pytest

from mu_addon.cli.main import main
from mu_addon.design.parameters import Unit, load_preset, to_toml
from mu_addon.run import progress
from mu_addon.simulate_and_place.expected import CROSSING, TOUCHING, Size, work
from mu_addon.studies.unit_ranking import UnitStudy

STUDY = ["--no-self-contact", "--refine", "0.35", "--times", "3"]
SMALL = load_preset("mu-0.75x").evolve(count=3)
MILD = "time_s,pressure_kPa\n0,0\n1,2\n2,0\n"


def messages_of(monkeypatch, tmp_path, words):
    """Every message of a command."""
    found = []
    monkeypatch.setattr(progress, "terminal", lambda stream: found.append)
    assert main([*words, "--out", str(tmp_path / "out"), "--no-report"]) == 0
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        pytest.param(
            ["design", "--preset", "mu-0.75x", "--path", "alpha4"],
            marks=pytest.mark.nightly("test_a_command_does_what_it_planned"),
        ),
        ["simulate", "--unit", "unit.toml", "--protocol", "mild.csv", *STUDY],
    ],
    ids=lambda words: words[0],
)
def test_a_command_does_what_it_planned(monkeypatch, tmp_path, words):
    files = {"unit.toml": to_toml(SMALL), "mild.csv": MILD}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    words = [str(tmp_path / word) if word in files else word for word in words]
    found = messages_of(monkeypatch, tmp_path, words)
    (plan,) = (m for m in found if m["type"] == "plan")
    told = [m for m in found if m["type"] == "progress"]
    assert {m["stage"] for m in told} <= {name for name, _ in plan["stages"]}
    shares = [m["whole"] for m in told]
    assert shares == sorted(shares)
    left = [m["whole_seconds_left"] for m in told if not m.get("why")]
    assert all(seconds is not None for seconds in left)


@pytest.mark.parametrize(("apart", "suction"), [(False, 1.0), (True, TOUCHING["candidates"])])
def test_suction_takes_longest_where_walls_touch(apart, suction):
    job = UnitStudy(unit=Unit(), self_contact=apart)
    size = Size.of(job)
    assert [work(size, [p]) for p in (-20.0, 0.0, 40.0)] == [suction, 0.0, 1.0]
    assert work(size, job.samples.distinct_kPa) == suction + max(suction / 4.0, 1.0) + 4
    # Model A's two branches are solved side by side; suction is the longer one.
    most = (TOUCHING if apart else CROSSING)["Model A"]
    assert size.factor("Model A") == most / TOUCHING["Model A"]
    under_pressure = attrs.evolve(size, pressures_kPa=(10.0, 20.0, 30.0, 40.0))
    assert under_pressure.factor("Model A") == 4.0 / (1.25 * TOUCHING["Model A"])


def test_a_plan_follows_what_is_asked_for():
    """Fewer chambers and paths, a coarser mesh, fewer pressures: each shortens it at once."""
    base = Size(6, 1.0, True, known=3)
    assert Size(6, 1.0, True).factor("Model A") == pytest.approx(1.0)
    assert Size(6, 1.0, True).factor("candidates") == pytest.approx(1.0)
    for other in (
        Size(3, 1.0, True, known=3),
        Size(6, 0.5, True, known=3),
        Size(6, 1.0, True, (10.0, 20.0), known=3),
    ):
        for stage in ("Model A", "candidates"):
            assert other.factor(stage) < 0.9 * base.factor(stage)
    assert Size(6, 1.0, False, known=3).factor("candidates") < 0.9 * base.factor("candidates")
    # Three of ten paths are solved in suction, which is most of the work.
    suction = TOUCHING["candidates"] + max(TOUCHING["candidates"] / 4.0, 1.0)
    left_out = 0.7 * suction / (suction + 4)
    assert base.factor("candidates") == pytest.approx(1.0 - left_out)
    job = UnitStudy(unit=Unit(), self_contact=True)
    every = attrs.evolve(job, all_paths=True)
    assert job.expected()["candidates"] < every.expected()["candidates"]
