"""Evaluation: only what is asked for, only what changed, and one failure does not keep the rest."""

import attrs
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.graph import Evaluation, Kept, NodeTree, State
from mu_addon.graph.evaluation import MOST_KEPT

from .toys import DEFINITIONS, node, tree

CHAIN = tree(
    n=node("number", value=3.0),
    a=node("sum", {"more": "n.number"}),
    b=node("twice", {"sum": "a.sum"}),
    c=node("sum", {"sums": ["a.sum", "b.sum"]}, more=1.0),
    apart=node("sum", more=5.0),
)


def evaluated(found, wanted=(), kept=None, **more):
    evaluation = Evaluation(found, DEFINITIONS, kept=kept if kept is not None else Kept(), **more)
    evaluation.run(wanted)
    return evaluation


def with_setting(found, name, **values):
    changed = attrs.evolve(found.nodes[name], settings={**found.nodes[name].settings, **values})
    return NodeTree(found.name, {**found.nodes, name: changed})


def test_values_flow_through_links_and_numbers_through_settings():
    found = evaluated(CHAIN)
    assert {name: found.outputs[name].get("sum") for name in "abc"} == {"a": 3.0, "b": 6.0, "c": 10.0}
    assert {s.state for s in found.states.values()} == {"computed"}


def test_only_what_is_wanted_and_what_that_needs_is_made():
    kept = Kept()
    found = evaluated(CHAIN, ["b"], kept)
    assert set(found.states) == set(kept.counts) == {"n", "a", "b"}


def test_a_change_makes_again_only_what_depends_on_it():
    kept = Kept()
    evaluated(CHAIN, kept=kept)
    before = kept.counts.copy()
    found = evaluated(with_setting(CHAIN, "c", more=2.0), kept=kept)
    assert kept.counts - before == {"c": 1}
    assert found.states["c"].state == "computed"
    assert {found.states[name].state for name in ("n", "a", "b", "apart")} == {"cached"}
    # And back: nothing.
    before = kept.counts.copy()
    evaluated(CHAIN, kept=kept)
    assert kept.counts == before


@given(
    st.integers(2, 9).flatmap(
        lambda n: st.tuples(
            st.lists(st.sets(st.integers(0, n - 1)), min_size=n, max_size=n), st.integers(0, n - 1)
        )
    )
)
@settings(max_examples=120, deadline=None)
def test_of_any_tree_what_is_made_again_is_what_lies_downstream(drawn):
    links, changed = drawn
    # A node is linked to earlier ones alone; distinct numbers, so that no two nodes are equal work.
    nodes = {
        str(i): node(
            "sum",
            {"sums": [f"{j}.sum" for j in sorted(s) if j < i]} if any(j < i for j in s) else {},
            more=10.0**i,
        )
        for i, s in enumerate(links)
    }
    found, kept = NodeTree("drawn", nodes), Kept()
    first = evaluated(found, kept=kept)
    before = kept.counts.copy()
    second = evaluated(with_setting(found, str(changed), more=0.5), kept=kept)
    downstream = {name for name in nodes if str(changed) in found.upstream([name])}
    assert set(kept.counts - before) == downstream
    for name in set(nodes) - downstream:
        assert first.outputs[name] == second.outputs[name]


def test_two_ways_to_one_number_are_one_key():
    kept = Kept()
    evaluated(tree(a=node("sum", more=3.0)), kept=kept)
    found = evaluated(tree(n=node("number", value=3.0), a=node("sum", {"more": "n.number"})), kept=kept)
    assert found.states["a"].state == "cached"


def test_a_failure_is_its_nodes_and_blocks_only_what_needs_it():
    found = evaluated(
        tree(
            bad=node("fails"),
            behind=node("twice", {"sum": "bad.sum"}),
            further=node("twice", {"sum": "behind.sum"}),
            good=node("sum", more=1.0),
        )
    )
    assert found.states["bad"].state == "failed"
    assert found.states["bad"].error.remedy == "leave it out"
    assert [found.states[n].state for n in ("behind", "further")] == ["blocked", "blocked"]
    assert found.states["further"].because == "bad"
    assert found.states["good"].state == "computed"


def test_muting_gives_what_the_definition_says_or_leaves_out_what_follows():
    passed = evaluated(tree(a=node("sum", muted=True, more=3.0), b=node("twice", {"sum": "a.sum"})))
    assert passed.outputs["b"]["sum"] == 0.0
    left = evaluated(
        tree(
            a=node("sum", more=3.0),
            b=node("twice", {"sum": "a.sum"}, muted=True),
            c=node("twice", {"sum": "b.sum"}),
            d=node("sum", {"sums": ["a.sum", "b.sum"]}),
        )
    )
    assert [left.states[n].state for n in "abc"] == ["computed", "muted", "muted"]
    assert left.outputs["d"]["sum"] == 3.0, "an input of many goes on without the muted one"


def test_circles_fail_and_what_is_behind_them_waits():
    found = evaluated(
        tree(
            a=node("twice", {"sum": "b.sum"}),
            b=node("twice", {"sum": "a.sum"}),
            c=node("twice", {"sum": "b.sum"}),
            good=node("sum"),
        )
    )
    assert [found.states[n].state for n in ("a", "b", "c", "good")] == [
        "failed", "failed", "blocked", "computed",
    ]  # fmt: skip


def test_a_refresh_starts_no_run_and_knows_what_records_know():
    wanted = attrs.evolve(DEFINITIONS["twice"], kind="run", make=None, order=lambda call: 1 / 0)
    definitions = {**DEFINITIONS, "run": wanted}
    found = tree(a=node("sum", more=2.0), r=node("run", {"sum": "a.sum"}), t=node("twice", {"sum": "r.sum"}))
    refresh = Evaluation(found, definitions)
    refresh.run()
    assert [refresh.states[n].state for n in "art"] == ["computed", "waiting", "waiting"]
    records = {refresh.states["r"].key: State("cached", remark="four")}
    again = Evaluation(found, definitions, records=records)
    again.run()
    assert [again.states[n].state for n in "art"] == ["computed", "cached", "waiting"]
    assert again.states["r"].remark == "four"
    records[again.states["t"].key] = State("cached", remark="eight")
    last = Evaluation(found, definitions, records=records)
    last.run()
    assert last.states["t"].remark == "eight"
    other = Evaluation(with_setting(found, "a", more=2.5), definitions, records=records)
    other.run()
    assert [other.states[n].state for n in "rt"] == ["waiting", "waiting"]


def test_what_was_used_last_stays_when_the_oldest_are_dropped():
    kept = Kept()
    for n in range(MOST_KEPT):
        kept.put(str(n), n)
    assert kept.get("0") == 0
    kept.put("one more", 1)
    assert (kept.get("0"), kept.get("1"), kept.get("2")) == (0, None, 2)
