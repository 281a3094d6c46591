"""The whole of a run: a fraction that grows, a time left that shrinks or says why not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.run.progress_estimate import SHOWN_S, Pace, ProgressEstimate

from .clock import Clock

PLAN = (("mesh", 10.0), ("Model A", 60.0), ("report", 10.0))


def estimate(plan=PLAN):
    clock = Clock()
    return ProgressEstimate(plan, clock), clock


def message(stage, fraction, seconds, left=None, state="run"):
    return {"stage": stage, "fraction": fraction, "seconds": seconds, "seconds_left": left, "state": state}


def test_a_run_as_planned_counts_down():
    run, clock = estimate()
    run.tell(message("mesh", None, 0.0, state="start"))
    assert (run.number, run.count) == (1, 3)
    assert run.seconds_left == 80.0
    clock.now = 10.0
    run.tell(message("mesh", 1.0, 10.0, state="end"))
    assert run.fraction == 0.125
    clock.now = 40.0
    run.tell(message("Model A", 0.5, 30.0, 30.0))
    assert run.number == 2
    assert run.fraction == 0.5
    assert run.seconds_left == 40.0
    clock.now = 45.0
    assert run.seconds_left == 35.0, "it counts between messages, too"
    assert run.why == ""


def test_a_longer_time_says_why_and_a_little_longer_one_is_not_told():
    run, clock = estimate()
    run.tell(message("Model A", 0.1, 6.0, 54.0))
    assert run.seconds_left == 64.0
    clock.now = 1.0
    run.tell(message("Model A", 0.1, 7.0, 60.0))
    assert run.seconds_left == 63.0
    assert run.why == ""
    run.tell(message("Model A", 0.11, 30.0, 240.0))
    # The report at Model A's pace, 30 s for 6.6, weighted by these 6.6 of the 8 s that make it sure.
    assert run.seconds_left == pytest.approx(240.0 + 10.0 * (1.0 + 6.6 / 8.0 * (30.0 / 6.6 - 1.0)))
    assert run.why == "Model A takes longer than expected"
    ended, _ = estimate()
    for share, seconds, left, state in (
        (0.1, 6.0, 54.0, "run"),
        (0.11, 30.0, 240.0, "run"),
        (1.0, 99.0, 0.0, "end"),
    ):
        ended.tell(message("Model A", share, seconds, left, state))
    assert ended.why == "Model A took longer than expected"
    clock.now += SHOWN_S
    run.tell(message("Model A", 0.5, 45.0, 45.0))
    assert run.seconds_left == 60.0, "the report at Model A's pace, too"
    assert run.why == ""
    run.tell(message("mesh check", None, 0.0))
    assert run.count == 4
    clock.now = 71.0
    run.tell(message("map", 0.0, 0.0, 100.0))
    assert run.why == "map was added"


def test_what_the_cache_had_is_passed_over():
    run, _ = estimate()
    run.tell(message("report", 0.0, 0.0, 10.0))
    assert run.fraction == 70.0 / 80.0
    assert run.seconds_left == 10.0


def test_a_pace_of_finished_stages_tells_of_the_later_ones():
    run, clock = estimate()
    run.tell(message("mesh", 0.5, 10.0, 10.0))
    clock.now = 20.0
    run.tell(message("mesh", 1.0, 20.0, state="end"))
    assert run.seconds_left == 140.0, "twice as slow as expected"


def test_without_a_plan_there_is_the_stage_alone():
    run, _ = estimate(())
    assert run.seconds_left is None
    run.tell(message("Model A", 0.5, 1.0, 3.0))
    assert run.count == 0
    assert run.seconds_left == 3.0
    run.tell({"stage": "x", "fraction": "half", "seconds": None})
    assert 0.0 <= run.fraction < 1.0


def test_the_reason_goes_once_no_more_is_left_than_before():
    run, clock = estimate()
    run.tell(message("report", None, 0.0))
    assert run.seconds_left == 10.0
    run.tell(message("report", 0.5, 30.0, 30.0))
    assert (run.seconds_left, run.why) == (30.0, "report takes longer than expected")
    run.tell(message("report", 0.5, 30.0, 29.0))
    assert run.why, "no line may have shown it yet"
    clock.now = 10.0
    run.tell(message("report", 0.5, 30.0, 19.5))
    assert (run.seconds_left, run.why) == (19.0, "report takes longer than expected")
    clock.now = 21.0
    run.tell(message("report", 0.6, 36.0, 9.5))
    assert (run.seconds_left, run.why) == (8.0, "")


def test_no_time_is_told_of_a_last_stage_beyond_its_own():
    """A report at 96 % said 9 s, 16 s, 11 s for half a minute."""
    run, clock = estimate()
    for second in range(40):
        clock.now = float(second)
        run.tell(message("report", None, float(second)))
        assert run.seconds_left == max(10.0 - second, 0.0)
        assert run.why == ""
    assert run.fraction < 1.0


def test_a_short_stage_says_little_of_a_long_run():
    """A solid that took 13 s instead of 4 s made half an hour of nine minutes."""
    run, clock = estimate((("solid", 4.0), ("Model A", 500.0), ("report", 36.0)))
    clock.now = 13.0
    run.tell(message("solid", 1.0, 13.0, state="end"))
    assert 536.0 - 9.0 <= run.seconds_left < 1.2 * 536.0


def test_a_stage_begins_at_the_pace_of_those_before():
    """On a machine half as fast the last stage would else be told at half, and then grow."""
    run, clock = estimate()
    clock.now = 20.0
    run.tell(message("mesh", 1.0, 20.0, state="end"))
    clock.now = 140.0
    run.tell(message("Model A", 1.0, 120.0, state="end"))
    assert run.seconds_left == 20.0
    run.tell(message("report", None, 0.0, state="start"))
    assert run.seconds_left == 20.0
    clock.now = 150.0
    run.tell(message("report", None, 10.0))
    assert (run.seconds_left, run.why) == (10.0, "")


STAGES = st.sampled_from(["mesh", "Model A", "report", "light"])
NUMBER = st.one_of(st.none(), st.floats(0.0, 1e4))
MESSAGE = st.tuples(STAGES, st.one_of(st.none(), st.floats(0.0, 1.0)), NUMBER, NUMBER, st.floats(0.0, 60.0))


@given(st.lists(MESSAGE, max_size=30))
def test_whatever_is_told_the_fraction_grows_and_the_time_shrinks_or_has_a_reason(messages):
    run, clock = estimate()
    before, left = 0.0, None
    for stage, fraction, seconds, own, pause in messages:
        clock.now += pause
        run.tell(message(stage, fraction, seconds, own))
        assert before <= run.fraction < 1.0
        now = run.seconds_left
        if left is not None and now > left:
            assert run.why
        before, left = run.fraction, now


def test_a_stage_that_tells_its_parts_counts_down_by_the_clock():
    """A node of a tree has stages of its own, which nobody knew before; the tree's run has one time left."""
    run, clock = estimate((("thin", 100.0), ("thick", 100.0)))
    run.tell(message("thin: mesh", 1.0, 5.0, state="end"))
    assert (run.number, run.count, run.seconds_left) == (1, 2, 200.0)
    clock.now = 50.0
    run.tell(message("thin: Model A", 0.1, 10.0, 30.0))
    assert (run.number, run.fraction, run.seconds_left) == (1, 0.25, 150.0)
    clock.now = 60.0
    run.tell(message("thick: mesh", None, 0.0, state="start"))
    assert (run.number, run.fraction) == (2, 0.5)
    assert run.seconds_left == 100.0, "twice as fast as expected in part: 60 s"
    clock.now = 300.0
    run.tell(message("thick: Model A", 0.2, 200.0, 500.0))
    assert run.fraction < 1.0
    assert run.seconds_left == 500.0
    assert run.why == "thick takes longer than expected"


def test_a_part_with_a_plan_of_its_own_counts_by_that():
    run, _ = estimate((("thin", 100.0), ("thick", 100.0)))
    run.tell({**message("thin: Model A", 0.9, 10.0, 1.0), "part": 0.5, "part_seconds_left": 30.0})
    assert (run.number, run.fraction, run.seconds_left) == (1, 0.25, 130.0)
    run.tell({**message("thick: sweep: Model A", 0.9, 10.0, 1.0), "part": 0.1, "part_seconds_left": 90.0})
    assert (run.number, run.count, run.fraction) == (2, 2, 0.55)


def test_a_slow_first_step_does_not_frighten():
    """A hundredth of a compression took 32 s, by which all of it takes an hour: it took five minutes."""
    run, clock = estimate((("specimen", 110.0), ("report", 10.0)))
    clock.now = 32.0
    run.tell(message("specimen", 0.01, 32.0, 3133.0))
    assert run.seconds_left < 150.0
    clock.now = 120.0
    run.tell(message("specimen", 0.25, 120.0, 360.0))
    assert run.seconds_left == pytest.approx(360.0 + 10.0 * 120.0 / (0.25 * 110.0)), "at the specimen's pace"


def test_a_stage_goes_on_at_the_pace_of_its_later_part():
    """Candidates of which the cache had half at once said that a second was left, for four minutes."""
    pace = Pace()
    assert pace.left(0.0) is None
    pace.tell(0.2, 0.5)
    assert pace.left(10.0) is None, "what was in the cache says nothing of the rest"
    pace.tell(20.0, 0.6)
    assert pace.left(25.0) == pytest.approx(0.4 / 0.1 * 19.8 - 5.0)
    # The first tenth took longer: it compiles.
    pace = Pace()
    for at, share in ((30.0, 0.1), (42.0, 0.2), (54.0, 0.3), (66.0, 0.4), (78.0, 0.5), (90.0, 0.6)):
        pace.tell(at, share)
    assert pace.left(90.0) == pytest.approx(48.0)


def test_what_the_cache_had_says_nothing_of_the_pace():
    """Of a run that goes on, stages that ended at once made a fifth of the time that the rest took."""
    run, clock = estimate((("Model A", 60.0), ("candidates", 100.0), ("report", 10.0)))
    clock.now = 0.5
    run.tell(message("Model A", 1.0, 0.5, state="end"))
    run.tell(message("candidates", None, 0.0, state="start"))
    assert run.seconds_left == 110.0
    run.tell(message("candidates", 0.5, 0.1))
    assert run.seconds_left == 60.0


def test_a_busy_machine_is_as_slow_as_its_load_until_the_run_knows_its_own_pace():
    clock = Clock()
    run = ProgressEstimate(PLAN, clock, slowed=4.0)
    run.tell(message("mesh", None, 0.0, state="start"))
    assert run.seconds_left == 320.0
    clock.now = 10.0
    run.tell(message("mesh", 1.0, 10.0, state="end"))
    assert run.seconds_left == 70.0, "it was quiet again"
