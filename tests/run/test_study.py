"""The base of all studies: what a result depends on, what a killed or failed run keeps, what is shown."""

import argparse
import inspect
import json
import os
import subprocess
import sys
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from types import MappingProxyType, MemberDescriptorType

import attrs
import numpy as np
import pytest
from hypothesis import given as for_all
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mu_addon.cli.options import add_setting
from mu_addon.design.parameters import load_preset
from mu_addon.design.quantity import described
from mu_addon.errors import ConvergenceError, InputError, OutputError
from mu_addon.run import execution
from mu_addon.run.context import RunContext
from mu_addon.run.execution import Execution
from mu_addon.run.kept_results import Results
from mu_addon.run.parts import Fact, File, Sentence, Warn, csv
from mu_addon.run.progress import Progress
from mu_addon.run.stored import content, packed, unpacked
from mu_addon.run.study import (
    Dropped,
    Input,
    Over,
    ReadInput,
    Study,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from mu_addon.studies import STUDIES, study
from mu_addon.studies.inputs import PlaceInput

CALLS = []


@attrs.frozen(eq=False)
class State:
    load: float
    moved: np.ndarray
    note: str = ""
    before: tuple[float, ...] = ()
    peak: float | None = None


@attrs.frozen(kw_only=True)
class Spring(Study):
    """Hang loads on a spring, one after the other."""

    name = "spring"
    files = MappingProxyType({"curve.csv": "length against load"})
    stiffness: float = setting(described("stiffness", 2.0, "its stiffness", unit="N/mm", low=0.1, high=10.0))
    loads: int = setting(described("loads", 3, "number of loads", low=1, high=9))
    breaks: float = setting(described("breaks", 99.0, "load at which it breaks", low=0.0, high=99.0))
    label: str = setting(described("label", "", "a word"))
    workers: int = setting(described("workers", 1, "processes", low=1, high=8), decides=False)

    def heading(self):
        return "A spring", ""

    @derived
    def rounded(self, stiffness):
        return round(stiffness)

    @stage("rest")
    def rest(self, rounded: int) -> State:
        CALLS.append("rest")
        return State(0.0, np.zeros(rounded))

    @intermediate()
    def model(self, stiffness: float) -> float:
        CALLS.append("model")
        return stiffness

    @stage(
        "loads",
        over=Over(
            ("load",),
            lambda s: [float(k + 1) for k in range(s.loads)],
            lambda s, load: {"states": [k for k in map(float, range(1, 10)) if k < load and k <= s.loads]},
        ),
        failing="Load {load:g} N is left out",
    )
    def states(self, load: float, breaks: float, model: float, rest: State, states: dict) -> State:
        CALLS.append(f"load {load:g}")
        if load == 7.0:
            raise Dropped
        if load > breaks:
            raise ConvergenceError("it broke")
        if load > 1.0 and load - 1.0 not in states:
            raise Dropped
        return State(load, np.array([load / model]), before=tuple(states))

    @stage("energy")
    def energy(self, states: dict, stiffness: float) -> float:
        CALLS.append("energy")
        return float(sum(s.moved[0] ** 2 for s in states.values()) * stiffness / 2)

    @section()
    def answer(self, label, energy=None):
        if energy is not None:
            yield Fact("energy", energy, f"{energy:g} mJ", "energy_mJ")
        yield Sentence(f"{label or 'unnamed'} was loaded", terminal=True)

    @section("curve", "Curve")
    def curve(self, states):
        yield csv("curve.csv", ["load_N", "moved_mm"], [(s.load, s.moved[0]) for s in states.values()])
        yield Fact("points", len(states), key="points.done")
        yield Fact("complete", states.complete, key="points.complete")


def run(folder, **given):
    CALLS.clear()
    context = RunContext(Progress())
    work = Execution(Spring(**given), folder, context)
    work.run()
    return work, context.summary


def test_every_stage_runs_once_and_its_results_are_shown(tmp_path):
    work, summary = run(tmp_path)
    assert CALLS == ["rest", "model", "load 1", "load 2", "load 3", "energy"]
    # 1, 2 and 3 N on 2 N/mm.
    assert summary["energy_mJ"] == pytest.approx((0.25 + 1.0 + 2.25) * 2 / 2)
    assert summary["points"] == {"done": 3, "complete": True}
    assert work.lines == ["unnamed was loaded"]
    assert (tmp_path / "curve.csv").read_text() == "load_N,moved_mm\n1.0,0.5\n2.0,1.0\n3.0,1.5\n"
    assert work.results.value(("states", 3.0)).before == (1.0, 2.0)


@pytest.mark.parametrize(
    ("given", "made"),
    [
        ({}, []),
        ({"label": "a", "workers": 2}, []),
        ({"loads": 4}, ["model", "load 4", "energy"]),
        ({"loads": 2}, ["energy"]),
        # The part of the input that `rest` takes is the same.
        ({"stiffness": 2.25}, ["model", "load 1", "load 2", "load 3", "energy"]),
        ({"stiffness": 3.0}, ["rest", "model", "load 1", "load 2", "load 3", "energy"]),
    ],
)
def test_only_what_depends_on_a_change_is_made_again(tmp_path, given, made):
    run(tmp_path)
    _, summary = run(tmp_path, **given)
    assert made == CALLS
    fresh = run(tmp_path / "fresh", **given)[1]
    assert summary == fresh


def test_what_depends_on_a_result_depends_on_its_content(tmp_path):
    """The limit is in the keys of the states; as these come out equal, what follows is not made again."""
    run(tmp_path)
    run(tmp_path, breaks=50.0)
    assert CALLS == ["model", "load 1", "load 2", "load 3"]


def test_a_failed_member_is_told_and_drops_what_needs_it(tmp_path):
    work, summary = run(tmp_path, breaks=1.5)
    assert summary["warnings"] == ["Load 2 N is left out: it broke.", "Load 3 N is left out: it broke."]
    assert summary["points"] == {"done": 1, "complete": False}
    assert summary["energy_mJ"] == pytest.approx(0.25)
    with pytest.raises(Dropped):
        work.results.value(("states", 2.0))


def test_a_dropped_member_is_no_fault(tmp_path):
    _, summary = run(tmp_path, loads=8)
    assert "warnings" not in summary
    assert summary["points"] == {"done": 6, "complete": False}


def test_a_killed_run_goes_on_at_the_first_member_that_is_missing(tmp_path, monkeypatch):
    class Killed(BaseException):
        pass

    with monkeypatch.context() as patch:
        patch.setattr(Results, "_make", make_until(3.0, Killed))
        with pytest.raises(Killed):
            run(tmp_path)
    context = RunContext(Progress())
    assert json.dumps(Execution(Spring(), tmp_path, context).plan())
    run(tmp_path)
    assert CALLS == ["model", "load 3", "energy"]


def make_until(load, stop):
    whole = Results._make

    def make(self, task, name):
        if task == ("states", load):
            raise stop
        whole(self, task, name)

    return make


def test_the_plan_leaves_out_what_is_there(tmp_path):
    context = RunContext(Progress())
    before = dict(Execution(Spring(), tmp_path, context).plan())
    assert list(before) == ["rest", "loads", "energy"]
    run(tmp_path, loads=2)
    after = dict(Execution(Spring(), tmp_path, context).plan())
    assert after["rest"] < before["rest"]
    assert after["loads"] == pytest.approx(before["loads"] / 3)


def test_what_its_inputs_decide_is_known_before_a_run():
    export, unit = study("export"), load_preset("mu-1.0x")
    asked = export(unit=unit, formats=("stl", "txt"), vent_along=(0.0, 0.0, 1.0))
    assert list(asked.expected()) == ["solid", "vents", "stl", "txt"]
    assert asked.detail() == "export export"
    assert list(Spring().expected()) == ["rest", "loads", "energy"]
    assert export(unit=attrs.evolve(unit, name="mine")).changed(export(unit=unit)) == [], "only its name"
    thicker = export(unit=unit.evolve(wall_mm=1.0), formats=("stl",))
    assert thicker.changed(export(unit=unit)) == ["unit", "formats"]
    assert Spring(loads=2, workers=2).changed(Spring()) == ["loads"], "workers decide nothing"


def test_a_damaged_result_is_made_again(tmp_path):
    run(tmp_path)
    for path in (tmp_path / "cache").glob("rest-*.npz"):
        path.write_bytes(path.read_bytes()[:-30])
    run(tmp_path)
    assert CALLS == ["rest"]


def test_inputs_go_through_their_files(tmp_path):
    one = Spring(stiffness=1 / 3, loads=5, label='a "word"', workers=3)
    for name, text in one.texts().items():
        (tmp_path / name).write_text(text)
    assert Spring.read(tmp_path) == one
    assert "[run]\nworkers = 3" in one.texts()["spring.toml"]
    assert Spring.read_file(tmp_path / "spring.toml", replaced={"loads": 6}) == attrs.evolve(one, loads=6)
    text = one.texts()["spring.toml"].replace("loads = 5", "loads = 50")
    (tmp_path / "spring.toml").write_text(text)
    with pytest.raises(InputError, match="loads = 50 is out of bounds"):
        Spring.read(tmp_path)


@attrs.frozen(kw_only=True)
class Letters(Study):
    """Write letters, each into its file."""

    name = "letters"
    files = MappingProxyType({"*.txt": "a letter"})

    @stage(
        "{letter}", MappingProxyType({"a": 1.0, "b": 5.0}), kept=False, over=Over(("letter",), lambda s: "ab")
    )
    def made(self, letter: str) -> str:
        return letter

    @section()
    def answer(self, made):
        yield File("same.txt", lambda path: "same")
        for letter, text in made.items():
            yield File(f"{letter}.txt", lambda path, text=text: CALLS.append(text) or text, of=letter)


def test_members_have_their_own_seconds_and_a_file_is_written_once(tmp_path, monkeypatch):
    CALLS.clear()
    written = []
    monkeypatch.setattr("mu_addon.run.shown.write_bytes", lambda path, text: written.append(path.name))
    work = Execution(Letters(), tmp_path, RunContext(Progress()))
    assert work.plan() == [("a", 1.0), ("b", 5.0)]
    work.run()
    assert written == ["same.txt", "a.txt", "b.txt"]
    assert CALLS == ["a", "b"], "what is made of the same is not made again"


def test_an_option_takes_so_many_words_or_stands_alone(capsys):
    parser = argparse.ArgumentParser()
    two, alone = Input("", metavar=("X", "Y"), many=2), Input("", metavar="CSV", alone="unit")
    add_setting(parser, described("at", "", "a place; empty: none"), one=two)
    add_setting(parser, described("sheet", "", "a file; empty: none"), one=alone)
    assert vars(parser.parse_args([])) == {"at": None, "sheet": None}
    assert vars(parser.parse_args(["--sheet", "--at", "1", "-2"])) == {"at": ["1", "-2"], "sheet": "unit"}
    assert parser.parse_args(["--sheet", "a.csv"]).sheet == "a.csv"
    with pytest.raises(SystemExit):
        parser.parse_args(["--at", "1"])
    assert "expected 2 arguments" in capsys.readouterr().err


def _properties(kind):
    # Of a class with slots, a cached property is a slot.
    kinds = property | cached_property | MemberDescriptorType
    return [name for name, _ in inspect.getmembers(kind, lambda one: isinstance(one, kinds))]


@pytest.mark.parametrize("name", STUDIES)
def test_a_declaration_is_sound(name):
    kind = study(name)
    known = {*kind.inputs(), *kind.derived(), *_properties(kind)}
    for one in kind.all_stages().values():
        later = set(one.needs) - known - {one.name}
        assert not later, f"{one.name} needs {later}, which is not above it"
        known.add(one.name)
    for one in kind.sections():
        assert kind.streams or set(one.parameters) <= known
    for name_, one in kind.inputs().items():
        assert one.kind != "setting" or one.descriptions[0].name == name_


def test_declarations_load_neither_solver_nor_numpy():
    code = (
        "import sys\nfrom mu_addon.studies import STUDIES, study\n"
        "[study(name).inputs() for name in STUDIES]\n"
        "print([m for m in ('numpy', 'scipy', 'warp', 'matplotlib') if m in sys.modules])"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root, check=True)
    assert done.stdout.strip() == "[]"


# Sets in several processes, that grow, and that are left before their end.


@attrs.frozen(kw_only=True)
class Race(Study):
    """Run laps; a runner who can no longer win runs no further."""

    name = "race"
    files = MappingProxyType({})
    paces: str = setting(described("paces", "3 2 5", "seconds a lap of each runner"))
    laps: int = setting(described("laps", 4, "number of laps", low=1, high=9))
    sprints: bool = setting(described("sprints", False, "the winner runs on"))
    workers: int = setting(described("workers", 1, "processes", low=1, high=8), decides=False)

    def heading(self):
        return "A race", ""

    @derived
    def pace(self, paces):
        return tuple(float(pace) for pace in paces.split())

    @intermediate()
    def ground(self, pace: tuple) -> int:
        return os.getpid()

    @stage("race", over=Over(("start",), lambda s: ["left", "right"]), parallel=True)
    def shoes(self, start: str) -> str:
        return start

    @stage(
        "race",
        over=Over(
            ("runner", "lap"),
            lambda s: [(r, lap) for r in range(len(s.paces.split())) for lap in range(s.laps)],
            lambda s, m: {"laps_run": [(m[0], lap) for lap in range(m[1])], "shoes": "left"},
            grows=lambda s: s.sprint(),
            most=lambda s: 12,
            choose=lambda s, ready, done: [m for m in ready if s.can_win(m[0], done)],
        ),
        parallel=True,
    )
    def laps_run(self, runner: int, lap: int, pace: tuple, ground: int, shoes: str, laps_run: dict) -> State:
        assert list(laps_run) == [(runner, before) for before in range(lap)]
        if pace[runner] > 9:
            raise ConvergenceError("out of breath")
        return State(sum(s.moved[0] for s in laps_run.values()) + pace[runner], np.array([pace[runner]]))

    def sprint(self):
        """One more lap after the second runner's last."""
        last = (1, self.laps - 1)
        results = yield [last] if self.sprints else []
        if self.sprints:
            yield [(1, self.laps)]
        return results

    def can_win(self, runner, done):
        """Sums of times only grow: one beyond a finished runner's is lost."""
        ended = [s.load for (_, lap), s in done.items() if lap == self.laps - 1]
        own = [s.load for (r, _), s in done.items() if r == runner]
        return not ended or not own or max(own) <= min(ended)

    @section()
    def result(self, laps_run):
        for (runner, lap), state in sorted(laps_run.items()):
            yield Fact("time", state.load, key=f"times.{runner}.{lap}")
        yield Fact("all", laps_run.complete, key="complete")


def raced(folder, **given):
    context = RunContext(Progress())
    Execution(Race(**given), folder, context).run()
    return context.summary


def test_what_cannot_win_is_left_and_the_winner_is_that_of_all(tmp_path):
    found = raced(tmp_path)
    assert found["times"]["1"]["3"] == 8.0
    assert found["complete"] is False
    # Two laps of 5 s are beyond the 8 s of the winner: the third is not run.
    assert list(found["times"]["2"]) == ["0", "1"]


def test_the_number_of_processes_changes_no_result(tmp_path):
    alone = raced(tmp_path / "1", paces="3 2", laps=2)
    found = raced(tmp_path / "3", paces="3 2", laps=2, workers=3)
    both = found["times"]["0"], alone["times"]["0"]
    assert found["times"]["1"] == alone["times"]["1"] == {"0": 2.0, "1": 4.0}
    # What was left may differ, what was run may not.
    assert all(both[0][lap] == both[1][lap] for lap in {*both[0]} & {*both[1]})


def test_a_set_grows_from_its_results_and_a_resumed_one_alike(tmp_path):
    first = raced(tmp_path, sprints=True)
    assert first["times"]["1"]["4"] == 10.0
    assert raced(tmp_path, sprints=True) == first


@attrs.frozen(kw_only=True, eq=False)
class Guess(Study):
    """Squares of likely numbers, beside which the right ones are found."""

    name = "guess"
    files = MappingProxyType({})
    limit: int = setting(described("limit", 9, "largest number with a square", low=1, high=9))
    workers: int = setting(described("workers", 1, "processes", low=1, high=8), decides=False)

    def heading(self):
        return "Guess", ""

    @stage("right", parallel=True)
    def right(self, limit: int) -> tuple[int, ...]:
        return (2, 3)

    @stage("squares", over=Over(("x",), lambda s: [], grows=lambda s: s.numbers()), parallel=True)
    def squares(self, x: int, limit: int) -> float:
        if x > limit:
            raise Dropped
        return float(x * x)

    @stage("sum")
    def added(self, squares: dict) -> float:
        return sum(squares.values())

    def numbers(self):
        with suppress(Dropped):
            yield [3, 5]
        yield (yield "right")

    @section()
    def result(self, squares, added):
        yield Fact("squares", {str(x): s for x, s in squares.items()}, key="squares")
        yield Fact("sum", added, key="sum")


@pytest.mark.parametrize("workers", [1, 2])
def test_a_set_begins_with_likely_members_and_ends_with_the_right_ones(tmp_path, workers):
    context = RunContext(Progress())
    Execution(Guess(workers=workers), tmp_path, context).run()
    assert context.summary["squares"] == {"3": 9.0, "5": 25.0, "2": 4.0}
    assert context.summary["sum"] == 38.0


def test_a_likely_member_without_a_result_leaves_the_right_ones(tmp_path):
    context = RunContext(Progress())
    Execution(Guess(limit=4), tmp_path, context).run()
    assert context.summary["squares"] == {"3": 9.0, "2": 4.0}


@attrs.frozen(kw_only=True, eq=False)
class Waits(Study):
    """Squares of a number and of one that is known once a second set, which stays empty, has ended."""

    name = "waits"
    files = MappingProxyType({})

    def heading(self):
        return "Waits", ""

    @stage("squares", over=Over(("x",), lambda s: [], grows=lambda s: s.numbers()))
    def squares(self, x: int) -> int:
        return x * x

    @stage("squares")
    def last(self) -> int:
        return 3

    @stage("squares", over=Over(("y",), lambda s: [], grows=lambda s, last: iter(()), after=("last",)))
    def more(self, y: int) -> int:
        return y

    @intermediate()
    def right(self, last: int, more: dict) -> list:
        return [last, *more]

    @stage("squares")
    def added(self, squares: dict) -> int:
        return sum(squares.values())

    def numbers(self):
        yield [2]
        yield (yield "right")

    @section()
    def result(self, added):
        yield Fact("sum", added, key="sum")


def test_a_set_goes_on_when_another_ends_that_never_had_a_member(tmp_path):
    context = RunContext(Progress())
    Execution(Waits(), tmp_path, context).run()
    assert context.summary["sum"] == 13


@attrs.frozen(kw_only=True, eq=False)
class Throws(Study):
    """Throw at marks; those at the same place have one result."""

    name = "throws"
    files = MappingProxyType({})
    marks: str = setting(described("marks", "2 5 2 -1", "places"))
    retry: bool = setting(described("retry", False, "throw again where it missed"), decides=False)
    scheduler: str = ""

    def heading(self):
        return "Throws", ""

    @stage(
        "throws",
        over=Over(
            ("mark",),
            lambda s: range(len(s.marks.split())),
            gives=lambda s, number: {"mark": int(s.marks.split()[number])},
        ),
        again=lambda s, hit: s.retry and not hit,
        parallel=True,
    )
    def hits(self, mark: int) -> bool:
        THROWN.append(mark)
        return mark > 0

    @section()
    def result(self, hits):
        yield Fact("hits", [*hits.values()], key="hits")


THROWN = []


def thrown(folder, **given):
    THROWN.clear()
    context = RunContext(Progress())
    Execution(Throws(**given), folder, context).run()
    return context.summary["hits"], [*THROWN]


def test_a_result_depends_on_what_its_member_gives_and_is_made_again_on_request(tmp_path):
    assert thrown(tmp_path) == ([True, True, True, False], [2, 5, -1])
    assert thrown(tmp_path, marks="5 -1") == ([True, False], [])
    assert thrown(tmp_path, marks="5 -1", retry=True) == ([True, False], [-1])


def test_a_scheduler_makes_what_is_parallel_and_not_kept(tmp_path, monkeypatch):
    class Cluster:
        def __init__(self, address):
            assert address == "tcp://there:1"

        def results(self, tasks, work, warn):
            # In another order.
            yield from ((number, work(*tasks[number])) for number in reversed(range(len(tasks))))

        def close(self):
            THROWN.append("closed")

    monkeypatch.setattr(execution, "Cluster", Cluster)
    hits, made = thrown(tmp_path, scheduler="tcp://there:1")
    assert hits == [True, True, True, False]
    assert made == [-1, 2, 5, 2, "closed"]
    assert thrown(tmp_path, scheduler="tcp://there:1") == (hits, [])


def test_an_error_in_a_process_is_that_of_the_stage(tmp_path):
    with pytest.raises(ConvergenceError, match="out of breath"):
        raced(tmp_path, paces="10 2", workers=2)


# What a declaration must not do, and what may go wrong.


def declared(**parts):
    """A study of these stages and sections."""
    body = {"name": "toy", "files": MappingProxyType({}), "title": lambda self: "toy", **parts}
    return attrs.frozen(kw_only=True, eq=False)(type("Toy", (Study,), body))


def test_a_stage_cannot_depend_on_what_it_does_not_name(tmp_path):
    def uses_its_study(self) -> float:
        return self.size

    kind = declared(stiff=stage("stiff")(uses_its_study))
    with pytest.raises(AttributeError):
        Execution(kind(), tmp_path, RunContext(Progress())).run()


@pytest.mark.parametrize(
    ("hint", "given"), [(list, [1.0]), (float, 0), (dict[int, float], {1: 2.0}), (str, 1.0)]
)
def test_a_result_of_another_type_than_declared_is_refused_at_once(tmp_path, hint, given):
    def made(self):
        return given

    made.__annotations__["return"] = hint
    kind = declared(made=stage("made")(made))
    with pytest.raises((TypeError, ValueError)):
        Execution(kind(), tmp_path, RunContext(Progress())).run()


def test_a_full_disk_is_no_left_out_member(tmp_path):
    def full(self) -> float:
        raise OutputError("the disk is full")

    kind = declared(full=stage("full", failing="Full")(full))
    with pytest.raises(OutputError):
        Execution(kind(), tmp_path, RunContext(Progress())).run()


def test_a_misspelt_need_is_named(tmp_path):
    def first(self, k: int, first: dict) -> float:
        return 1.0

    over = Over(("k",), lambda study: [1, 2], lambda study, k: {"frist": 1})
    kind = declared(first=stage("first", over=over)(first))
    with pytest.raises(TypeError, match="frist"):
        Execution(kind(), tmp_path, RunContext(Progress())).run()


def test_a_long_chain_of_members_is_planned_and_made(tmp_path):
    def step(self, k: int, step: dict) -> int:
        return k + sum(step.values())

    over = Over(("k",), lambda study: range(700), lambda study, k: {"step": [k - 1] if k else []})
    kind = declared(step=stage("step", over=over)(step))
    work = Execution(kind(), tmp_path, RunContext(Progress()))
    assert len(work.plan()) == 1
    work.run()
    assert work.results.value(("step", 699)) == sum(range(700))


def test_what_was_shown_of_a_part_is_gone_once_all_is_there(tmp_path):
    def slow(self, k: int) -> int:
        return k

    def seen(self, slow):
        yield Fact("k", 1, key="parts.first" if not slow.complete else "parts.all")
        if not slow.complete:
            yield Warn("some are missing")

    kind = declared(
        slow=stage("slow", over=Over(("k",), lambda study: range(3)))(slow),
        seen=section("seen", "Seen")(seen),
    )
    context = RunContext(Progress())
    work = Execution(kind(), tmp_path, context)
    work.results.value(("slow", 0))
    work.show()
    assert context.summary == {"parts": {"first": 1}, "warnings": ["some are missing"]}
    work.run()
    assert context.summary == {"parts": {"all": 1}}


def test_what_another_process_makes_must_be_kept():
    with pytest.raises(TypeError, match="must be kept"):
        stage("race", parallel=True, kept=False)(lambda self: 0)


# What is read from files of others, and results that a stage can do without.


@attrs.frozen
class Weights:
    text: str

    def hash(self):
        return content(self.text)


@attrs.frozen(kw_only=True, eq=False)
class Weighing(Study):
    """Add up weights that a file of the laboratory lists."""

    name = "weighing"
    files = MappingProxyType({})
    notes: Path = given(PlaceInput(kind="notes", what="notes"))
    tare: float = setting(described("tare", 0.0, "mass of the pan; 0: none", unit="g", low=0.0, high=99.0))
    weights: Weights | None = given(
        ReadInput(of=lambda study: Weights(study.notes.read_text()), what="weights"), default=None
    )

    def heading(self):
        return "Weighing", ""

    @stage("pan", wanted=lambda study: study.tare > 0.0, failing="The pan is left out")
    def pan(self, tare: float) -> float:
        if tare > 50.0:
            raise ConvergenceError("it never settled")
        return tare

    @stage("sum")
    def total(self, weights: Weights, pan: float | None = None) -> float:
        CALLS.append("total")
        return sum(map(float, weights.text.split())) - (pan or 0.0)

    @section()
    def answer(self, total):
        yield Fact("mass", total, key="mass_g")


def weighed(folder, **given):
    CALLS.clear()
    context = RunContext(Progress())
    Execution(Weighing(**given), folder, context).run()
    return context.summary


@pytest.fixture
def notes(tmp_path):
    (tmp_path / "notes.txt").write_text("1 2 3")
    return tmp_path / "notes.txt"


def test_a_stage_does_without_a_result_that_is_not_wanted_or_failed(tmp_path, notes):
    out = tmp_path / "out"
    assert weighed(out, notes=notes) == {"mass_g": 6.0}
    assert weighed(out, notes=notes, tare=2.0) == {"mass_g": 4.0}
    assert CALLS == ["total"], "with the pan it is another result"
    found = weighed(out, notes=notes, tare=60.0)
    assert found == {"mass_g": 6.0, "warnings": ["The pan is left out: it never settled."]}


def test_files_of_others_are_known_by_what_was_read(tmp_path, notes):
    out = tmp_path / "out"
    out.mkdir()

    def write(study):
        (out / "weighing.toml").write_text(study.texts()["weighing.toml"])
        return study

    assert weighed(out, notes=notes) == {"mass_g": 6.0}
    assert write(Weighing(notes=notes).complete()).texts() == Weighing.read(out).texts()
    notes.write_text("1 2 4")
    with pytest.raises(InputError, match="the weights changed since the run was made") as caught:
        Weighing.read(out)
    assert caught.value.where == str(notes)
    # Written before they were read, it takes those that are there; a result of others is made again.
    write(Weighing(notes=notes))
    assert Weighing.read(out).weights == Weights("1 2 4")
    assert weighed(out, notes=notes) == {"mass_g": 7.0}
    notes.unlink()
    with pytest.raises(InputError, match="the notes is not where it was"):
        Weighing.read(out)


# Results as arrays.

floats = arrays.arrays(np.float64, arrays.array_shapes(max_dims=2, max_side=4))
states = st.builds(
    State,
    st.floats(allow_nan=False),
    floats,
    st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=5),
    st.lists(st.floats(allow_nan=False), max_size=3).map(tuple),
    st.none() | st.floats(allow_nan=False),
)


@for_all(states)
def test_a_result_comes_back_as_it_was(state):
    again = unpacked(State, packed(state))
    assert content(again) == content(state)
    assert (again.load, again.note, again.before, again.peak) == (
        state.load,
        state.note,
        state.before,
        state.peak,
    )


@for_all(st.dictionaries(st.text("ab.#@", min_size=1, max_size=3), st.integers(-9, 9), max_size=3))
def test_tables_come_back_whatever_their_names(table):
    assert unpacked(dict[str, int], packed(table)) == table


@pytest.mark.parametrize("kind", [float, State, tuple[float, float], dict[str, float], bytes, np.ndarray])
def test_another_type_is_refused(kind):
    with pytest.raises(ValueError, match="value"):
        unpacked(kind, packed("a text" if kind is not np.ndarray else None))


def test_what_has_no_content_is_refused():
    with pytest.raises(TypeError, match="content"):
        content(object())
