"""Faults of a node tree, found before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import attrs

from ..errors import InputError, did_you_mean
from .definition import NUMBER, Definition, Definitions, Input
from .tree import Node, NodeTree, Source


@attrs.frozen
class Fault:
    """A fault at a node: what is wrong, what to do, and the input and source of a refused link."""

    node: str
    what: str
    remedy: str
    input: str = ""
    source: Source | None = None
    missing: bool = False
    """True if only an input is missing, as in a tree that is being wired."""

    def error(self) -> InputError:
        """The fault as an error."""
        where = f"node {self.node!r}" + (f", {self.input}" if self.input else "")
        return InputError(self.what, where, self.remedy)


def faults(tree: NodeTree, definitions: Definitions) -> tuple[Fault, ...]:
    """All faults of a tree: kinds, settings, links, missing inputs, circles."""
    found: list[Fault] = []
    for name, node in tree.nodes.items():
        definition = definitions.get(node.kind)
        if definition is None:
            words = did_you_mean(node.kind, definitions)
            remedy = f"choose one of {', '.join(definitions)}"
            found.append(Fault(name, f"there is no kind of node {node.kind!r}{words}", remedy))
            continue
        found += _of_settings(name, node, definition)
        found += _of_links(name, node, definition, tree, definitions)
        found += _missing(name, node, definition)
    _, circle = tree.ordered()
    found += [
        Fault(name, "the links of this node lead in a circle", "remove one of them")
        for name in _on_circles(tree, circle)
    ]
    return tuple(found)


def _of_settings(name: str, node: Node, definition: Definition) -> Iterator[Fault]:
    for key, value in node.settings.items():
        own = definition.setting(key)
        if own is None:
            known = ", ".join(s.name for s in definition.settings) or "none"
            yield Fault(name, f"a node {node.kind!r} has no setting {key!r}", f"known: {known}", key)
            continue
        try:
            own.checked(value)
        except InputError as error:
            yield Fault(name, error.what, error.remedy, key)
    if node.muted and definition.muting == "":
        yield Fault(name, f"a node {node.kind!r} cannot be muted", "unmute it: the nodes after it need it")


def _of_links(
    name: str, node: Node, definition: Definition, tree: NodeTree, definitions: Definitions
) -> Iterator[Fault]:
    for key, sources in node.links.items():
        taken = definition.input(key)
        if taken is None:
            names = [i.name for i in definition.inputs] + [s.name for s in definition.settings if s.is_number]
            known = f"known: {', '.join(names) or 'none'}"
            yield Fault(name, f"a node {node.kind!r} has no input {key!r}", known, key, sources[0])
            continue
        if len(sources) > 1 and not taken.many:
            yield Fault(name, f"{key} takes one link, not {len(sources)}", "remove a link", key, sources[1])
        for source in sources:
            yield from _of_link(name, key, taken, source, tree, definitions)


def _of_link(
    name: str, key: str, taken: Input, source: Source, tree: NodeTree, definitions: Definitions
) -> Iterator[Fault]:
    node = tree.nodes.get(source.node)
    if node is None:
        words = did_you_mean(source.node, tree.nodes)
        yield Fault(name, f"there is no node {source.node!r}{words}", "correct the link", key, source)
        return
    definition = definitions.get(node.kind)
    if definition is None:
        # The fault of that node.
        return
    output = definition.output(source.output)
    if output is None:
        known = ", ".join(o.name for o in definition.outputs) or "none"
        what = f"a node {node.kind!r} has no output {source.output!r}"
        yield Fault(name, what, f"known: {known}", key, source)
        return
    refusal = taken.refusal(output)
    if refusal:
        remedy = "link a number" if taken.types == (NUMBER,) else f"link {_offer(taken, definitions)}"
        yield Fault(name, refusal, remedy, key, source)


def _offer(taken: Input, definitions: Definitions) -> str:
    """Nodes with an output that an input accepts, as text."""
    kinds = [
        d.label for d in definitions.values() if any(taken.refusal(output) == "" for output in d.outputs)
    ]
    return f"a node {' or '.join(kinds)}" if kinds else f"a {' or '.join(taken.types)}"


def _missing(name: str, node: Node, definition: Definition) -> Iterator[Fault]:
    for taken in definition.inputs:
        if taken.needed and taken.name not in node.links:
            what = f"the input {taken.name} is not linked"
            yield Fault(name, what, taken.text, taken.name, missing=True)


def _on_circles(tree: NodeTree, suspects: Iterable[str]) -> Iterator[str]:
    """Nodes of a circle among those in or behind one: they are upstream of themselves."""
    for name in suspects:
        if name in tree.upstream(tree.sources(name)):
            yield name
