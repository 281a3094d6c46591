"""What a run says, to people, to programs and to its log."""

import io
import json
import sys
import time

import pytest

from mu_addon.errors import InputError, OutputError
from mu_addon.run.progress import Progress, json_lines, log_file, spell, terminal

from .clock import Clock


class Tty(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock():
    return Clock(100.0)


def run(progress, clock, updates=10, step=1.0):
    with progress.stage("mesh"):
        for i in range(1, updates + 1):
            clock.now += step
            progress.update(i / updates)


def test_time_left_by_the_share_done(clock):
    messages = []
    progress = Progress([messages.append], clock)
    with progress.stage("mesh", expected_s=20.0):
        clock.now += 3.0
        progress.update(0.25)
    start, running, end = messages
    assert (start["state"], start["seconds_left"]) == ("start", 20.0)
    assert running["seconds_left"] == pytest.approx(9.0)
    assert (end["state"], end["fraction"], end["seconds"]) == ("end", 1.0, 3.0)
    assert progress.seconds == {"mesh": 3.0}


def test_a_failed_stage_is_not_told_as_ended(clock):
    messages = []
    progress = Progress([messages.append], clock)
    with pytest.raises(ZeroDivisionError), progress.stage("mesh"):  # noqa: PT012
        clock.now += 2.0
        1 / 0  # noqa: B018
    assert [m["state"] for m in messages] == ["start"]
    assert progress.seconds == {"mesh": 2.0}
    with progress.stage("next"):
        pass


def test_stages_do_not_nest():
    progress = Progress()
    with progress.stage("a"), pytest.raises(ValueError, match="inside stage 'a'"), progress.stage("b"):
        pass


def test_plain_lines_at_start_end_and_every_five_seconds(clock):
    stream = io.StringIO()
    run(Progress([terminal(stream, clock)], clock), clock, updates=12)
    assert stream.getvalue().splitlines() == [
        "mesh ...",
        "mesh: 42 %, 7.0 s left",
        "mesh: 83 %, 2.0 s left",
        "mesh: done in 12 s",
    ]


def test_live_line_is_redrawn_in_place_and_fits(clock):
    stream = Tty()
    progress = Progress([terminal(stream, clock)], clock)
    run(progress, clock)
    progress.warning("thin wall", "chamber 3", "thicken it")
    lines = stream.getvalue().split("\n")
    drawn = lines[0].split("\r")[1:]
    assert len(drawn) == 12
    assert "[############............]  50 %  5.0 s left" in drawn[5]
    assert drawn[-1].startswith("mesh")
    assert "100 %  10 s" in drawn[-1]
    assert all(len(line.replace("\x1b[K", "")) < 80 for line in drawn)
    assert lines[1:4] == ["warning: thin wall", "  where: chamber 3", "  what to do: thicken it"]


def test_live_line_at_most_ten_times_a_second(clock):
    stream = Tty()
    run(Progress([terminal(stream, clock)], clock), clock, updates=1000, step=0.001)
    assert stream.getvalue().count("\r") <= 2 + 11


def test_an_error_does_not_write_into_the_live_line(clock):
    stream = Tty()
    progress = Progress([terminal(stream, clock)], clock)
    with pytest.raises(InputError), progress.stage("mesh"):
        raise InputError("no such preset")
    progress.error(InputError("no such preset", "--preset", "choose another"))
    assert "\nerror: no such preset\n  where: --preset\n  what to do: choose another\n" in stream.getvalue()


def test_a_first_finding_has_a_line_of_its_own(clock):
    stream = io.StringIO()
    progress = Progress([terminal(stream, clock)], clock)
    with progress.stage("Model A"):
        progress.finding("estimated: alpha4 0.26 mm")
    assert "estimated: alpha4 0.26 mm\n" in stream.getvalue()


def test_json_lines(clock):
    stream = io.StringIO()
    progress = Progress([json_lines(stream, clock)], clock)
    run(progress, clock, updates=100, step=0.02)
    progress.warning("w")
    progress.result({"chosen": "alpha4"})
    progress.error(InputError("bad", "here", "mend it"))
    messages = [json.loads(line) for line in stream.getvalue().splitlines()]
    kinds = [m["type"] for m in messages]
    assert 8 <= kinds.count("progress") <= 13
    assert kinds[-3:] == ["warning", "result", "error"]
    assert messages[0] == {
        "type": "progress",
        "stage": "mesh",
        "state": "start",
        "fraction": None,
        "seconds": 0.0,
        "seconds_left": None,
    }
    assert messages[-1] == {
        "type": "error",
        "what": "bad",
        "where": "here",
        "what_to_do": "mend it",
        "status": 2,
    }


def test_log_adds_and_survives_a_second_run(tmp_path, clock):
    for _ in range(2):
        run(Progress([log_file(tmp_path / "log.ndjson", clock)], clock), clock, updates=11)
    messages = [json.loads(line) for line in (tmp_path / "log.ndjson").read_text().splitlines()]
    assert [m["state"] for m in messages] == ["start", "run", "run", "run", "end"] * 2
    assert all("time" in m for m in messages)


def test_a_log_that_cannot_be_written(tmp_path):
    with pytest.raises(OutputError):
        log_file(tmp_path / "missing" / "log.ndjson")


def test_an_error_reaches_the_sinks_that_still_work():
    messages = []

    def broken(_):
        raise BrokenPipeError

    Progress([broken, messages.append]).error(InputError("bad"))
    assert messages[0]["what"] == "bad"


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.04, "0.0 s"), (9.96, "10 s"), (59.6, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")],
)
def test_spell(seconds, words):
    assert spell(seconds) == words


def test_half_a_line_of_a_killed_process_does_not_take_the_next_one_with_it(tmp_path):
    path = tmp_path / "log.ndjson"
    path.write_text('{"type": "result"}\n{"type": "warn')
    log_file(path)({"type": "warning", "what": "next"})
    lines = path.read_text().splitlines()
    assert lines[:2] == ['{"type": "result"}', '{"type": "warn']
    assert json.loads(lines[2])["what"] == "next"


@pytest.fixture
def quiet_machine(monkeypatch):
    monkeypatch.setattr("mu_addon.run.progress.slowed_so_far", lambda: 1.0)


@pytest.mark.usefixtures("quiet_machine")
def test_a_planned_run_has_one_fraction_that_only_grows_and_one_time(clock):
    stream, messages = io.StringIO(), []
    progress = Progress([terminal(stream, clock), messages.append], clock)
    progress.plan([("mesh", 10.0), ("Model A", 80.0), ("report", 10.0)])
    with progress.stage("mesh"):
        clock.now += 10.0
    with progress.stage("Model A"):
        # Thirds that are told out of order, as of several workers.
        for share in (1 / 3, 2 / 3, 1 / 2):
            clock.now += 20.0
            progress.update(share)
        # By the clock it would have ended, but nothing says that it has.
        clock.now += 40.0
        progress.update(2 / 3)
    with progress.stage("report"):
        clock.now += 10.0
    shown = [m for m in messages if m["type"] == "progress"]
    whole = [m["whole"] for m in shown]
    assert whole == sorted(whole)
    assert shown[0]["whole_seconds_left"] == 100.0
    assert stream.getvalue().splitlines() == [
        "about 1 min 40 s on two cores, 3 stages",
        "  0 %  mesh ...",
        " 10 %  mesh: done in 10 s",
        " 10 %  Model A ...",
        " 37 %  Model A: for 20 s, 48 s left",
        " 63 %  Model A: for 40 s, 28 s left",
        " 63 %  Model A: for 1 min 00 s, 51 s left (takes longer than expected)",
        " 63 %  Model A: for 1 min 40 s, 1 min 37 s left (takes longer than expected)",
        " 90 %  Model A: done in 1 min 40 s",
        " 90 %  report ...",
        "100 %  report: done in 10 s",
    ]


def test_a_busy_machine_s_time_is_told_first(clock, monkeypatch):
    monkeypatch.setattr("mu_addon.run.progress.slowed_so_far", lambda: 3.0)
    stream = io.StringIO()
    Progress([terminal(stream, clock)], clock).plan([("mesh", 20.0)])
    assert (
        stream.getvalue()
        == "about 1 min 00 s with other programs running, 20 s on two cores without, 1 stage\n"
    )


def test_a_stage_that_says_nothing_is_told_to_go_on(tmp_path, monkeypatch):
    """By a thread: its own is in a library meanwhile. Not in the log, which would grow by nothing new."""
    # Another test of this process may have loaded Blender, beside which there is no thread.
    monkeypatch.delitem(sys.modules, "bpy", raising=False)
    messages = []
    progress = Progress([messages.append, log_file(tmp_path / "log.ndjson")])
    with progress.beating(every_s=0.05), progress.stage("mesh", expected_s=0.1):
        time.sleep(0.5)
    beats = [m for m in messages if m.get("beat")]
    assert len(beats) >= 3
    assert all(m["stage"] == "mesh" for m in beats)
    # Of a stage that takes longer than expected nothing is known: a time that grows would be none.
    assert all((m["seconds_left"] is None) == (m["seconds"] >= 0.1) for m in beats)
    assert [m["seconds"] for m in beats] == sorted(m["seconds"] for m in beats)
    assert messages[-1]["state"] == "end"
    assert len((tmp_path / "log.ndjson").read_text().splitlines()) == 2
    count = len(messages)
    time.sleep(0.2)
    assert len(messages) == count
