"""A node tree as data: nodes by name, their settings, and the sources of their inputs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import attrs

from .definition import Definitions


class Source(NamedTuple):
    """Source of an input: name of a node and of one of its outputs."""

    node: str
    output: str


@attrs.frozen
class Node:
    """One node: its kind, settings that differ from their defaults, and the sources of each linked input.

    at: position in an editor, frame: label of the frame around it; neither affects results.
    """

    kind: str
    settings: Mapping[str, Any] = attrs.field(factory=dict)
    links: Mapping[str, tuple[Source, ...]] = attrs.field(factory=dict)
    muted: bool = False
    at: tuple[float, float] = (0.0, 0.0)
    frame: str = ""


@attrs.frozen
class NodeTree:
    """Nodes by name."""

    name: str
    nodes: Mapping[str, Node]

    def sources(self, name: str) -> tuple[str, ...]:
        """Names of the sources of a node, each once, without missing ones."""
        links = self.nodes[name].links.values()
        return tuple(dict.fromkeys(s.node for sources in links for s in sources if s.node in self.nodes))

    def ends(self) -> tuple[str, ...]:
        """Names of the nodes whose outputs are not used."""
        taken = {source for name in self.nodes for source in self.sources(name)}
        return tuple(name for name in self.nodes if name not in taken)

    def upstream(self, wanted: Iterable[str]) -> frozenset[str]:
        """Names of those nodes and all of their sources."""
        found: set[str] = set()
        waiting = [name for name in wanted if name in self.nodes]
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting += self.sources(name)
        return frozenset(found)

    def ordered(self) -> tuple[tuple[str, ...], frozenset[str]]:
        """Names with every node behind its sources, and of the nodes in a circle or behind one."""
        left = {name: set(self.sources(name)) for name in self.nodes}
        behind: dict[str, list[str]] = {name: [] for name in self.nodes}
        for name, sources in left.items():
            for source in sources:
                behind[source].append(name)
        ready = [name for name, sources in left.items() if not sources]
        for name in ready:
            for after in behind[name]:
                left[after].discard(name)
                if not left[after]:
                    ready.append(after)
        done = frozenset(ready)
        return tuple(ready), frozenset(name for name in self.nodes if name not in done)


def with_absolute_paths(tree: NodeTree, definitions: Definitions, folder: Path) -> NodeTree:
    """The tree with relative names of files and folders resolved against `folder`."""
    nodes = {}
    for name, node in tree.nodes.items():
        definition = definitions.get(node.kind)
        settings = dict(node.settings)
        for s in definition.settings if definition is not None else ():
            value = settings.get(s.name)
            if s.path and isinstance(value, str) and value:
                settings[s.name] = str((folder / value).absolute())
        nodes[name] = attrs.evolve(node, settings=settings)
    return attrs.evolve(tree, nodes=nodes)
