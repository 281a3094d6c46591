"""Trees as data: any tree goes through its file unchanged, circles are found, faults name their node."""

import string

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.graph import Node, NodeTree, Source, faults, parse_tree, read_tree, tree_text

from .toys import DEFINITIONS, node, tree

names = st.text(
    st.characters(exclude_categories=("C", "Z")) | st.sampled_from(" .-\"'[]#="), min_size=1, max_size=12
).filter(str.isprintable)
values = st.one_of(
    st.booleans(),
    st.integers(-(2**53), 2**53),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(exclude_categories=("C",)), max_size=20),
)
keys = st.text(string.ascii_lowercase + "_", min_size=1, max_size=8)


@st.composite
def trees(draw):
    found = draw(st.lists(names, min_size=1, max_size=8, unique=True))
    sources = st.builds(Source, st.sampled_from(found), keys)
    nodes = {
        name: Node(
            draw(keys),
            draw(st.dictionaries(keys, values, max_size=3)),
            draw(st.dictionaries(keys, st.lists(sources, min_size=1, max_size=3).map(tuple), max_size=3)),
            draw(st.booleans()),
            (float(draw(st.integers(-999, 999))), float(draw(st.integers(-999, 999)))),
            draw(st.sampled_from(["", "a frame"])),
        )
        for name in found
    }
    return NodeTree(draw(names), nodes)


@given(trees())
@settings(max_examples=50, deadline=None)
def test_any_tree_goes_through_its_file_unchanged(found):
    assert parse_tree(tree_text(found)) == found


@given(trees())
@settings(max_examples=50, deadline=None)
def test_the_order_has_every_node_behind_its_sources_and_circles_apart(found):
    order, circle = found.ordered()
    assert {*order, *circle} == set(found.nodes)
    assert len(order) + len(circle) == len(found.nodes)
    place = {name: i for i, name in enumerate(order)}
    for name in order:
        assert all(place[source] < place[name] for source in found.sources(name))
    for name in circle:
        assert any(source in circle for source in found.sources(name))
    # Checking any tree whatever ends, and knows the circles.
    told = {f.node for f in faults(found, DEFINITIONS) if "circle" in f.what}
    assert told == {name for name in found.nodes if name in found.upstream(found.sources(name))}


@pytest.mark.parametrize(
    ("found", "at", "words"),
    [
        (tree(a=node("nmber")), "a", "did you mean 'number'"),
        (tree(a=node("number", valu=1.0)), "a", "has no setting 'valu'"),
        (tree(a=node("number", value="1")), "a", "is not a number"),
        (tree(a=node("number", value=1e9)), "a", "out of bounds"),
        (tree(a=node("number"), b=node("twice", {"sum": "a.number"})), "b", "takes a sum, not a number"),
        (tree(a=node("sum"), b=node("sum", {"more": "a.sum"})), "b", "takes a number, not a sum"),
        (tree(a=node("sum"), b=node("twice", {"sum": "a.total"})), "b", "has no output 'total'"),
        (tree(a=node("sum"), b=node("twice", {"su": "a.sum"})), "b", "has no input 'su'"),
        (tree(a=node("twice", {"sum": "c.sum"})), "a", "there is no node 'c'"),
        (tree(a=node("sum"), b=node("twice", {"sum": ["a.sum", "a.sum"]})), "b", "takes one link, not 2"),
        (tree(a=node("twice")), "a", "the input sum is not linked"),
        (tree(a=node("number", muted=True)), "a", "cannot be muted"),
        (tree(a=node("twice", {"sum": "a.sum"})), "a", "circle"),
    ],
)
def test_a_fault_names_its_node_and_says_what_to_do(found, at, words):
    mine = [f for f in faults(found, DEFINITIONS) if words in f.what]
    assert [f.node for f in mine] == [at]
    assert mine[0].remedy
    assert repr(at) in str(mine[0].error())


def test_a_sound_tree_has_no_fault():
    assert faults(tree(n=node("number", value=3), s=node("sum", {"more": "n.number"})), DEFINITIONS) == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("format = 2", "format = 2"),
        ("format = 1", "there are no nodes"),
        ("format = 1\nnodes = 3", "nodes is not a table"),
        ("format = 1\nnods = 3\n[nodes.a]\nkind='x'", "unknown key 'nods'"),
        ("format = 1\n[nodes.a]", "kind is missing"),
        ("format = 1\n[nodes]\na = 1", "is not a table"),
        ("format = 1\n[nodes.a]\nkind = 'x'\nsize = 1", "unknown key 'size'"),
        ("format = 1\n[nodes.a]\nkind = 'x'\n[nodes.a.links]\ni = 'b'", "'b' is not a link"),
        ("format = 1\n[nodes.a]\nkind = 'x'\n[nodes.a.links]\ni = []", "is not a link"),
        ('format = 1\n[nodes."\\u0007"]\nkind = "x"', "is not a name"),
    ],
)
def test_a_bad_file_is_told_with_its_place(tmp_path, text, words):
    path = tmp_path / "tree.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_tree(path)
    assert words in error.value.what
    assert "tree.toml" in error.value.where
    assert error.value.remedy


@given(st.binary(max_size=200))
@settings(max_examples=60, deadline=None)
def test_whatever_a_file_holds_it_is_read_or_refused(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("tree") / "tree.toml"
    path.write_bytes(b"format = 1\n" + content)
    with pytest.raises(InputError):
        read_tree(path)
