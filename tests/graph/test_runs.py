"""Runs in folders named by their inputs: found again, taken up, an answer with an error, a stop."""

import attrs
import numpy as np
import pytest

from mu_addon.design.quantity import described
from mu_addon.errors import MuError
from mu_addon.files import write_text
from mu_addon.graph import Definition, Evaluation, Input, Order, Output, Setting
from mu_addon.graph.records import read_records, write_records
from mu_addon.nodes.runs import FolderRuns, Stopped
from mu_addon.run.cache import Cache
from mu_addon.run.study import Node, Study, setting

from .toys import DEFINITIONS, node, tree


@attrs.frozen(kw_only=True, eq=False)
class Toy(Study):
    """A study that notes its runs, fails at 13, answers "bad" at 7, and is stopped at 99."""

    name = "toy"
    header = "# A toy."
    streams = True
    page = ""
    files = {"out.txt": "done"}
    runs = []

    number: float = setting(described("number", 0.0, "a number", low=-100, high=100))

    def work(self, folder, context):
        self.runs.append(self.number)
        context.summary["twice"] = 2 * self.number
        with context.progress.stage("toy"):
            Cache(folder / "cache").put("step", "one", {"x": np.array(self.number)})
        if self.number == 13:
            raise MuError("thirteen", "there", "take another")
        if self.number == 99:
            raise KeyboardInterrupt
        context.summary["verdict"] = "bad" if self.number == 7 else "good"
        if self.number == 7:
            raise MuError("seven is bad")
        write_text(folder / "out.txt", "done")


@pytest.fixture
def toy():
    Toy.runs.clear()
    return Toy


def definitions(toy, answers=False):
    toy.node = Node("Toys", "a toy", (), lambda summary: "", answers=answers)
    made = Definition(
        "toy", "Toy", "Toys", "a run",
        (Input("before", ("toy",), "an earlier one", needed=False),),
        (Output("toy", "toy"), Output("twice", "number")),
        (Setting(toy.inputs()["number"].descriptions[0]),),
        order=lambda call: Order(
            toy(number=call.settings["number"]), getattr(call.inputs["before"], "folder", None)
        ),
        read=lambda call, done: {"toy": done, "twice": done.summary["twice"]},
    )  # fmt: skip
    return {**DEFINITIONS, "toy": made}


def evaluated(found, toy, folder, answers=False):
    evaluation = Evaluation(found, definitions(toy, answers), FolderRuns(folder))
    evaluation.run()
    return evaluation


def test_a_run_is_done_once_whatever_node_or_evaluation_wants_it(toy, tmp_path):
    both = tree(a=node("toy", number=3.0), b=node("toy", number=3.0), c=node("sum", {"more": "a.twice"}))
    first = evaluated(both, toy, tmp_path)
    assert toy.runs == [3.0]
    assert {n: s.state for n, s in first.states.items()} == {"a": "computed", "b": "cached", "c": "computed"}
    assert first.outputs["c"]["sum"] == 6.0
    again = evaluated(both, toy, tmp_path)
    assert toy.runs == [3.0]
    assert again.states["a"].cost_s > 0.0
    # A damaged summary, or other inputs in the folder: not the run that is wanted.
    folder = again.states["a"].folder
    (folder / "summary.json").write_text("{")
    evaluated(both, toy, tmp_path)
    assert toy.runs == [3.0, 3.0]
    (folder / "toy.toml").write_text("# A toy.\nformat = 1\nnumber = 4.0\n")
    evaluated(both, toy, tmp_path)
    assert toy.runs == [3.0, 3.0, 3.0]


def test_a_run_that_fails_is_its_nodes_error_and_is_tried_again(toy, tmp_path):
    found = evaluated(tree(a=node("toy", number=13.0), b=node("toy", number=2.0)), toy, tmp_path)
    assert found.states["a"].error.what == "thirteen"
    assert found.states["a"].error.remedy == "take another"
    assert found.states["b"].state == "computed"
    evaluated(tree(a=node("toy", number=13.0)), toy, tmp_path)
    assert toy.runs == [13.0, 2.0, 13.0]


@pytest.mark.parametrize(("answers", "runs"), [(True, [7.0]), (False, [7.0, 7.0])])
def test_a_verdict_is_an_answer_where_the_order_says_so(toy, tmp_path, answers, runs):
    for _ in range(2):
        found = evaluated(tree(a=node("toy", number=7.0)), toy, tmp_path, answers)
    assert (found.states["a"].state == "failed") != answers
    assert toy.runs == runs


def test_a_stop_ends_the_whole_evaluation(toy, tmp_path):
    with pytest.raises(Stopped) as stopped:
        evaluated(tree(a=node("toy", number=99.0), b=node("toy", number=1.0)), toy, tmp_path)
    assert stopped.value.error.status == 130
    assert toy.runs == [99.0]


def test_a_run_takes_up_the_cache_of_the_one_it_goes_on_from(toy, tmp_path):
    chain = tree(a=node("toy", number=3.0), b=node("toy", {"before": "a.toy"}, number=4.0))
    found = evaluated(chain, toy, tmp_path)
    kept = Cache(found.states["b"].folder / "cache").get("step", "one")
    assert float(kept["x"]) == 4.0, "its own work counts where both have it"
    own = found.states["a"].folder / "cache"
    Cache(own).put("step", "two", {"x": np.array(5.0)})
    (found.states["b"].folder / "summary.json").unlink()
    found = evaluated(chain, toy, tmp_path)
    assert float(Cache(found.states["b"].folder / "cache").get("step", "two")["x"]) == 5.0


def test_records_go_through_their_file_without_runs_that_are_gone(toy, tmp_path):
    found = evaluated(tree(a=node("toy", number=3.0), n=node("number", value=2.0)), toy, tmp_path)
    records = {s.key: s for s in found.states.values()}
    assert records[found.states["a"].key].numbers == {"twice": 6.0}
    write_records(tmp_path, records)
    read = read_records(tmp_path)
    assert read.keys() == records.keys()
    assert read[found.states["a"].key].folder == found.states["a"].folder
    for path in sorted(found.states["a"].folder.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    found.states["a"].folder.rmdir()
    assert read_records(tmp_path).keys() == {found.states["n"].key}


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", '{"records": 3}', '{"records": {"k": 1}}', '{"records": {"k": {"remark": 1}}}',
     '{"records": {"k": {"run": "../../x"}}}', '{"records": {"k": {"cost_s": "1"}}}',
     '{"records": {"k": {"numbers": {"a": "b"}}}}'],
)  # fmt: skip
def test_a_damaged_file_of_records_is_none(tmp_path, text):
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "records.json").write_text(text)
    assert read_records(tmp_path) == {}
