"""Evaluation of a node tree: only the nodes asked for, and of these only uncached ones.

Every node has a key, a hash of its kind, its settings and the keys of its sources; a run's key is the hash of
its files of inputs. So equal work is done once, in whatever node.
"""

from __future__ import annotations

import time
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import attrs

from ..errors import MuError
from ..reading import file_bytes, is_number
from ..run.cache import key as hashed
from ..run.inputs import digest
from ..run.study import Study
from .check import Fault, faults
from .definition import FILE, FOLDER, NUMBER, Call, Definition, Definitions, Outputs
from .tree import Node, NodeTree, Source

COMPUTED, CACHED, WAITING, FAILED, BLOCKED, MUTED = (
    "computed", "cached", "waiting", "failed", "blocked", "muted",
)  # fmt: skip
MADE = (COMPUTED, CACHED)
MOST_KEPT = 512
# No file that a node names is longer, in bytes.
LONGEST_FILE = 1 << 31


class NodeError(MuError):
    """An error caused by another node than the one that found it: `node`."""

    def __init__(self, error: MuError, node: str) -> None:
        super().__init__(error.what, error.where, error.remedy)
        self.status = error.status
        self.node = node


@attrs.frozen
class Order:
    """A run that a node needs: of a study.

    after: folder of a run whose cache is reused, without effect on results.
    """

    study: Study
    after: Path | None = None

    def is_done(self, summary: Mapping[str, Any]) -> bool:
        """True if the run with this summary need not be repeated."""
        node = self.study.node_of(self.study.command)
        answers = node is not None and node.answers and "verdict" in summary
        return summary.get("status") == "complete" or answers

    @property
    def key(self) -> str:
        """Hash of its files of inputs."""
        texts = self.study.texts()
        return hashed(self.study.command, *(part for item in sorted(texts.items()) for part in item))


@attrs.frozen
class Finished:
    """A finished run: its folder, its summary, and its study if that is known."""

    folder: Path
    summary: Mapping[str, Any]
    study: Study | None = None

    @property
    def cost_s(self) -> float:
        """Total seconds of its stages."""
        found = self.summary.get("seconds")
        return sum(s for s in found.values() if is_number(s)) if isinstance(found, Mapping) else 0.0


class Runs(Protocol):
    """Runs of an evaluation."""

    def find(self, order: Order) -> Finished | None:
        """Find the run if it is finished."""

    def start(self, node: str, order: Order) -> Finished:
        """Run it now, and return it. Raises MuError."""


@attrs.frozen
class State:
    """State of a node after evaluation: its seconds, its key and a remark on its outputs.

    cost_s: seconds when it was computed, now or before; folder: of its run; numbers: its numeric outputs;
    error: why it failed; because: the node that failed or that it waits for.
    """

    state: str
    seconds: float = 0.0
    cost_s: float = 0.0
    key: str = ""
    remark: str = ""
    folder: Path | None = None
    numbers: Mapping[str, float] = attrs.field(factory=dict)
    error: MuError | None = None
    because: str = ""


@attrs.define
class Kept:
    """Outputs of nodes, and orders of runs, by key; the least recently used are dropped.

    counts: number of evaluations of each node, by its name.
    """

    counts: Counter[str] = attrs.field(factory=Counter)
    _values: OrderedDict[str, Any] = attrs.field(factory=OrderedDict)

    def get(self, key: str) -> Any:
        """Entry of a key, or None."""
        if key in self._values:
            self._values.move_to_end(key)
        return self._values.get(key)

    def put(self, key: str, value: Any) -> None:
        """Store a value."""
        self._values[key] = value
        while len(self._values) > MOST_KEPT:
            self._values.popitem(last=False)


Report = Callable[[str, State], None]


@attrs.define
class Evaluation:
    """One tree, evaluated by `run`; afterwards `states` and `outputs` by node, and the tree's `faults`.

    runs: where runs are found and started; None for a refresh, which evaluates only nodes that take
    milliseconds and takes the others from earlier evaluations: `records`, by key. report: called with each
    node's state.
    """

    tree: NodeTree
    definitions: Definitions
    runs: Runs | None = None
    kept: Kept = attrs.field(factory=Kept)
    records: Mapping[str, State] = attrs.field(factory=dict)
    report: Report = lambda name, state: None
    states: dict[str, State] = attrs.field(factory=dict)
    outputs: dict[str, Outputs] = attrs.field(factory=dict)
    faults: tuple[Fault, ...] = ()

    def run(self, wanted: Iterable[str] = ()) -> dict[str, State]:
        """Evaluate the wanted nodes, all of the tree if none is named, and their sources.

        A node that fails does not keep others from being evaluated. Raises only errors of `runs` that end
        everything.
        """
        order, circle = self.tree.ordered()
        needed = self.tree.upstream(tuple(wanted) or self.tree.nodes)
        first: dict[str, Fault] = {}
        self.faults = faults(self.tree, self.definitions)
        for fault in self.faults:
            first.setdefault(fault.node, fault)
        for name in (*order, *sorted(circle)):
            if name not in needed:
                continue
            if name in first:
                self._set(name, State(FAILED, error=first[name].error()))
            elif name in circle:
                self._set(name, State(BLOCKED, because=self._before(name)))
            else:
                self._make(name)
        return self.states

    def order(self, name: str) -> Order | None:
        """Run of a node whose sources are evaluated; None for any other node. Raises MuError."""
        node = self.tree.nodes[name]
        definition = self.definitions[node.kind]
        if definition.order is None or node.muted or not all(map(self._is_made, self.tree.sources(name))):
            return None
        if not all(source in self.outputs for source in self.tree.sources(name)):
            return None
        found: Order = definition.order(self._call(name, node, definition, self._settings(node, definition)))
        return found

    def _set(self, name: str, state: State) -> None:
        self.states[name] = state
        self.report(name, state)

    def _is_made(self, name: str) -> bool:
        return name in self.states and self.states[name].state in MADE

    def _before(self, name: str) -> str:
        """First source of a node that is not evaluated."""
        return next((s for s in self.tree.sources(name) if not self._is_made(s)), "")

    def _make(self, name: str) -> None:
        node = self.tree.nodes[name]
        definition = self.definitions[node.kind]
        lacking = self._lacking(node, definition)
        if lacking is not None:
            state = self.states[lacking].state
            then = state if state in (WAITING, MUTED) else BLOCKED
            self._set(name, State(then, because=self.states[lacking].because or lacking))
            return
        if node.muted and definition.mute is None:
            self._set(name, State(MUTED, because=name))
            return
        start = time.perf_counter()
        key = ""
        try:
            settings = self._settings(node, definition)
            key = self._key(name, node, definition, settings)
            behind = next(
                (s for s in self.tree.sources(name) if self._is_made(s) and s not in self.outputs), ""
            )
            runs = definition.runs and not node.muted
            if self.runs is None and (runs or behind):
                self._recall(name, key, behind)
            elif runs:
                self._of_run(name, definition, self._call(name, node, definition, settings), key, start)
            else:
                self._of_call(name, definition, self._call(name, node, definition, settings), key, start)
        except MuError as error:
            self._failed(name, error, key, time.perf_counter() - start)

    def _recall(self, name: str, key: str, behind: str) -> None:
        """Take a node from the records, or let it wait for a run."""
        found = self.records.get(key)
        if found is None:
            self._set(name, State(WAITING, key=key, because=self.states[behind].because if behind else name))
        else:
            self._set(name, attrs.evolve(found, state=CACHED, seconds=0.0, key=key))

    def _of_call(self, name: str, definition: Definition, call: Call, key: str, start: float) -> None:
        found: tuple[Outputs, float] | None = self.kept.get(key)
        state = CACHED
        if found is None:
            make = definition.mute if call.muted else definition.make
            assert make is not None
            found, state = (make(call), time.perf_counter() - start), COMPUTED
            self.kept.put(key, found)
            self.kept.counts[name] += 1
        outputs, cost = found
        self._done(name, definition, outputs, State(state, time.perf_counter() - start, cost, key))

    def _of_run(self, name: str, definition: Definition, call: Call, key: str, start: float) -> None:
        assert definition.order is not None
        assert definition.read is not None
        assert self.runs is not None
        order = definition.order(call)
        done, state = self.runs.find(order), CACHED
        if done is None:
            done, state = self.runs.start(name, order), COMPUTED
            self.kept.counts[name] += 1
        outputs = definition.read(call, done)
        seconds = time.perf_counter() - start
        cost = seconds if state == COMPUTED else done.cost_s
        self._done(name, definition, outputs, State(state, seconds, cost, key, folder=done.folder))

    def _done(self, name: str, definition: Definition, outputs: Outputs, state: State) -> None:
        self.outputs[name] = outputs
        numbers = {o.name: float(outputs[o.name]) for o in definition.outputs if o.type == NUMBER}
        self._set(name, attrs.evolve(state, remark=definition.remark(outputs), numbers=numbers))

    def _failed(self, name: str, error: MuError, key: str, seconds: float) -> None:
        cause = error.node if isinstance(error, NodeError) else ""
        self._set(name, State(FAILED, seconds, key=key, error=error, because=cause))
        if cause in self.states and cause != name:
            # There is the fault to be repaired.
            found = self.states[cause]
            self._set(cause, attrs.evolve(found, state=FAILED, error=error, because=""))

    def _lacking(self, node: Node, definition: Definition) -> str | None:
        """First unevaluated source that the node cannot do without, or None."""
        for key, sources in node.links.items():
            taken = definition.input(key)
            optional = taken is not None and (taken.many or not taken.needed)
            for source in sources:
                muted = self.states[source.node].state == MUTED
                if not self._is_made(source.node) and not (muted and optional):
                    return source.node
        for taken in definition.inputs:
            sources = node.links.get(taken.name, ())
            if taken.needed and not any(self._is_made(s.node) for s in sources):
                return sources[0].node if sources else None
        return None

    def _settings(self, node: Node, definition: Definition) -> dict[str, Any]:
        """Every setting of a node, with linked values in place of its own. Raises InputError."""
        found: dict[str, Any] = {}
        for s in definition.settings:
            source = next(iter(node.links.get(s.name, ())), None)
            if source is not None and self._is_made(source.node):
                value = self._number(source)
                found[s.name] = value if value is None else s.checked(value)
            else:
                found[s.name] = s.checked(node.settings.get(s.name, s.description.default))
        return found

    def _number(self, source: Source) -> Any:
        """A number from another node; None where a refresh cannot determine it."""
        if source.node in self.outputs:
            return self.outputs[source.node][source.output]
        return self.states[source.node].numbers.get(source.output)

    def _call(self, name: str, node: Node, definition: Definition, settings: dict[str, Any]) -> Call:
        inputs: dict[str, Any] = {}
        for taken in definition.inputs:
            sources = [s for s in node.links.get(taken.name, ()) if s.node in self.outputs]
            values = tuple((s.node, self.outputs[s.node][s.output]) for s in sources)
            inputs[taken.name] = values if taken.many else values[0][1] if values else None
        return Call(name, settings, inputs, node.muted)

    def _key(self, name: str, node: Node, definition: Definition, settings: Mapping[str, Any]) -> str:
        links = [
            (taken.name, s.output, self.states[s.node].key, s.node if taken.many else "")
            for taken in definition.inputs
            for s in node.links.get(taken.name, ())
            if self._is_made(s.node)
        ]
        files = [_content(s.path, settings[s.name]) for s in definition.settings if s.path]
        # Outputs that contain the node's name, as the cause of an error, belong to that node alone.
        own = name if definition.named else ""
        return hashed(node.kind, node.muted, sorted(settings.items()), links, files, own)


def _content(path: str, value: str) -> Any:
    """Digest by which a change of a named file or folder is detected."""
    if not value:
        return ""
    place = Path(value)
    try:
        if path == FILE:
            found = place.stat()
            return _digest(place, found.st_size, found.st_mtime_ns)
        if path == FOLDER:
            return sorted(
                (p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in place.iterdir() if p.is_file()
            )
    except OSError:
        # Its reader reports the error.
        return "unreadable"
    return ""


@lru_cache(256)
def _digest(place: Path, size: int, mtime_ns: int) -> str:
    """SHA-256 of a file, read once while size and time stay: a slider asks at every move."""
    return digest(file_bytes(place, LONGEST_FILE))
