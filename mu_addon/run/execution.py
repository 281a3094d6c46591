"""The work of a study in its folder: each stage, from the cache where nothing that it takes has changed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..errors import InputError, MuError
from ..files import write_bytes
from .cache import Cache, key
from .context import RunContext
from .parts import Fact, Fault, File, Part, Sentence, Warn, flat
from .pool import Pool
from .progress import Progress
from .progress_estimate import LOADED, LOADED_S, Plan
from .stored import content, packed, unpacked
from .study import TELL, Dropped, Members, Section, Stage, Study, Tell, parameters_of

Task = tuple[str, Any]
"""A stage's name and a member of its set, None of a stage without one."""
# Array of an entry of the cache with the hash of what it holds, whatever its own name.
_CONTENT = "content"


class Execution:
    """A study at work in a folder; `run` it once.

    lines: sentences for the end of a command; fault: an error that is the result. Results are read from the
    folder's cache when they are needed.
    """

    def __init__(self, study: Study, folder: Path, context: RunContext) -> None:
        self.study, self.folder, self.context = study, folder, context
        self.cache = Cache(folder / "cache")
        self.lines: list[str] = []
        self.fault: MuError | None = None
        self.shown: list[tuple[Section, list[Part]]] = []
        self.failed: dict[Task, str] = {}
        self._stages = study.stages()
        self._members = {n: self._members_of(s) for n, s in self._stages.items() if s.wanted(study)}
        self._given: dict[str, Any] = {name: getattr(study, name) for name in study.inputs()}
        self._values: dict[Task, Any] = {}
        self._digests: dict[Task, str] = {}
        self._done: set[Task] = set()
        self._parts: dict[str, tuple[str, list[Part]]] = {}

    def _members_of(self, stage: Stage) -> list[Any]:
        return list(stage.over.members(self.study)) if stage.over else [None]

    @property
    def tasks(self) -> list[Task]:
        """Every result that the study wants, in order, without those that are made when they are taken."""
        return [(n, m) for n, members in self._members.items() if self._stages[n].title for m in members]

    def _titled(self) -> Iterator[tuple[str, list[Task]]]:
        """Tasks by the title of their progress."""
        for title, tasks in groupby(self.tasks, lambda task: self._stages[task[0]].title_of(task[1])):
            yield title, list(tasks)

    def plan(self) -> Plan:
        """Stages with the seconds that are left of each, by what the cache holds."""
        found = []
        for title, tasks in self._titled():
            seconds = self._stages[tasks[0][0]].seconds(self.study)
            missing = sum(not self._is_kept(task) for task in tasks) / len(tasks)
            found.append((title, max(missing * seconds, min(LOADED * seconds, LOADED_S))))
        return found

    def _is_kept(self, task: Task) -> bool:
        return self._stages[task[0]].kept and self.digest(task) is not None

    # Values and what identifies them.

    def given(self, name: str) -> Any:
        """An input, or a value derived from inputs; made once."""
        if name not in self._given:
            method = self.study.derived()[name]
            self._given[name] = method(self.study, **{p: self.given(p) for p in parameters_of(method)})
        return self._given[name]

    def _wanted_of(self, task: Task, name: str) -> Any:
        """What a task takes of another stage: a member, or a list of members."""
        stage, (_, member) = self._stages[task[0]], task
        needs = stage.over.needs(self.study, member) if stage.over else {}
        if name in needs:
            return needs[name]
        return self._members.get(name, []) if self._stages[name].over else None

    def key(self, task: Task) -> str | None:
        """Hash of all that a task's result depends on; None while one of its needs has no result."""
        stage, member = self._stages[task[0]], task[1]
        parts: list[Any] = [__version__, stage.name, stage.revision, content(member)]
        for name in stage.needs:
            if name not in self._stages:
                parts += [name, content(self.given(name))]
                continue
            taken = self._wanted_of(task, name)
            several = isinstance(taken, list)
            for one in taken if several else [taken]:
                digest = self.digest((name, one))
                if digest is None and not (several and self._is_out((name, one))):
                    return None
                parts += [name, content(one), digest or ""]
        return key(*parts)

    def _is_out(self, task: Task) -> bool:
        """Return True if a task has no result and will have none."""
        return task in self.failed

    def digest(self, task: Task) -> str | None:
        """Hash of a result's content, or None while there is none."""
        if task not in self._digests:
            if self._is_out(task) or task[0] not in self._members:
                return None
            stage, name = self._stages[task[0]], self.key(task)
            if name is None:
                return None
            if not stage.kept:
                self._digests[task] = name
            elif self._load(task, name) is None:
                return None
        return self._digests[task]

    def _load(self, task: Task, name: str) -> Any:
        """A kept result, remembered; None where the cache has none that can be read."""
        stage = self._stages[task[0]]
        arrays = self.cache.get(stage.name, name)
        if arrays is None or _CONTENT not in arrays:
            return None
        digest = str(arrays.pop(_CONTENT))
        try:
            found = unpacked(stage.result_type, arrays)
        except (ValueError, TypeError, InputError):
            # Of a class that has changed since: made anew.
            return None
        self._values[task], self._digests[task] = found, digest
        return found

    def value(self, task: Task) -> Any:
        """A result: remembered, from the cache, or made now. Raises Dropped where it has none."""
        if self._is_out(task) or task[0] not in self._members:
            raise Dropped
        if task not in self._values:
            name = self.key(task)
            if name is None:
                raise Dropped
            if not self._stages[task[0]].kept or self._load(task, name) is None:
                self._make(task, name)
        return self._values[task]

    def _make(self, task: Task, name: str) -> None:
        stage, member = self._stages[task[0]], task[1]
        taken = {n: self._taken(task, n) for n in stage.needs}
        if TELL in parameters_of(stage.method):
            taken[TELL] = Tell(self.context.progress)
        own = stage.over.values(member) if stage.over else {}
        found = stage.method(self.study, **taken, **own)
        self._values[task], self._digests[task] = found, name
        if stage.kept:
            arrays = packed(found)
            digest = key(*(part for item in sorted(arrays.items()) for part in item))
            self.cache.put(stage.name, name, {**arrays, _CONTENT: np.asarray(digest)})
            self._digests[task] = digest

    def _taken(self, task: Task, name: str) -> Any:
        if name not in self._stages:
            return self.given(name)
        wanted = self._wanted_of(task, name)
        return self._several(name, wanted) if isinstance(wanted, list) else self.value((name, wanted))

    def _several(self, name: str, members: Sequence[Any]) -> Members:
        """Results of members that have one."""
        found = Members()
        for member in members:
            try:
                found[member] = self.value((name, member))
            except Dropped:
                found.complete = False
        return found

    # The run.

    def run(self) -> None:
        """Make every result, and show what there is after each stage; raises the error of a stage."""
        self.show()
        for title, tasks in self._titled():
            with self.context.progress.stage(title):
                self._make_all(tasks)
            self.show()
            self._forget()

    def _make_all(self, tasks: list[Task]) -> None:
        """Make the results of tasks, each after those that it takes, in this process or in several."""
        waiting, running, found = list(tasks), dict[Future[None], Task](), 0
        workers = self.study.processes if any(self._stages[name].parallel for name, _ in tasks) else 1
        with closing(Pool(workers, tasks[0][0], _begin, (self.study, self.folder))) as pool:
            while waiting or running:
                for task in self._worth(waiting):
                    if workers == 1 or not self._stages[task[0]].parallel or self._is_kept(task):
                        self._finish(task)
                        self._settle(task, waiting)
                        break
                    if len(running) == workers:
                        break
                    running[pool.submit(_in_process, task, self.failed, self._members)] = task
                    waiting.remove(task)
                else:
                    if not running:
                        # Never chosen, or without what they take.
                        self.failed |= dict.fromkeys(waiting, "")
                        self._done.update(waiting)
                        break
                if running and (len(running) == workers or not self._worth(waiting)):
                    for future in wait(running, return_when=FIRST_COMPLETED).done:
                        task = running.pop(future)
                        self._finish(task, partial(pool.result, future))
                        self._settle(task, waiting)
                found = sum(task in self._done for task in tasks)
                self.context.progress.update(found / max(len(tasks), found + len(waiting) + len(running)))

    def _settle(self, task: Task, waiting: list[Task]) -> None:
        """Take a finished task from those that wait, and add the members that grow from it."""
        if task in waiting:
            waiting.remove(task)
        over = self._stages[task[0]].over
        if over and over.grows:
            known = self._members[task[0]]
            new = [m for m in over.grows(self.study, self._results(task[0])) if m not in known]
            known += new
            waiting += [(task[0], member) for member in new]

    def _worth(self, waiting: Sequence[Task]) -> list[Task]:
        """The tasks that can be made now, and are worth it, in order."""
        ready = [task for task in waiting if self._is_ready(task)]
        found: list[Task] = []
        for name, group in groupby(ready, lambda task: task[0]):
            members = [member for _, member in group]
            over = self._stages[name].over
            if over and over.choose:
                members = [m for m in over.choose(self.study, members, self._results(name)) if m in members]
            found += [(name, member) for member in members]
        return found

    def _results(self, name: str) -> Members:
        return self._several(name, [member for member in self._members[name] if (name, member) in self._done])

    def _is_ready(self, task: Task) -> bool:
        """Return True if all that a task takes is made, or will not be."""
        for name in self._stages[task[0]].needs:
            for one in self._takes(task, name):
                made = one in self._done if self._stages[name].title else self._is_ready(one)
                if not made and name in self._members:
                    return False
        return True

    def _takes(self, task: Task, name: str) -> list[Task]:
        """The tasks of which a task takes the results, of one of its parameters."""
        if name not in self._stages:
            return []
        wanted = self._wanted_of(task, name)
        return [(name, one) for one in (wanted if isinstance(wanted, list) else [wanted])]

    def _finish(self, task: Task, work: Callable[[], Any] | None = None) -> None:
        """Make a task's result, by `work` if that is given; a failure that may be becomes a warning."""
        stage = self._stages[task[0]]
        try:
            if work is not None:
                work()
            if self.digest(task) is None or not stage.kept:
                self.value(task)
        except Dropped:
            self.failed[task] = ""
        except MuError as error:
            if not stage.failing:
                raise
            where = f" ({error.where})" if error.where and isinstance(error, InputError) else ""
            self.failed[task] = f"{stage.failing.format(**self._words(stage, task[1]))}: {error.what}{where}."
            self.warn(self.failed[task])
        self._done.add(task)

    def _words(self, stage: Stage, member: Any) -> dict[str, Any]:
        return stage.over.values(member) if stage.over else {}

    def _forget(self) -> None:
        """Release results that no task to come takes: a factor, a field of displacements."""
        to_come = [task for task in self.tasks if task not in self._done]
        needed: set[str] = set()
        names = {name for name, _ in to_come}
        while names - needed:
            needed |= names
            names = {n for name in needed for n in self._stages[name].needs if n in self._stages}
        for task in [*self._values]:
            stage = self._stages[task[0]]
            if task[0] not in needed and (stage.kept or not stage.title):
                del self._values[task]

    def warn(self, text: str) -> None:
        """Warn the user, now and in the report."""
        warnings = self.context.summary.setdefault("warnings", [])
        if text not in warnings:
            warnings.append(text)
            self.context.progress.warning(text)

    # What it shows.

    def show(self) -> None:
        """Write files and summary of all results that there are."""
        self.shown, self.lines = [], []
        for one in self.study.sections():
            parts = self._section(one)
            self.shown.append((one, parts))
            for part in flat(parts):
                if isinstance(part, Fact) and part.key:
                    _put(self.context.summary, part.key.split("."), part.value)
                elif isinstance(part, Sentence) and part.terminal:
                    self.lines.append(part.text)

    def _section(self, one: Section) -> list[Part]:
        """A section's parts, made anew if what it shows is; its files are then written."""
        name = one.method.__name__
        taken: dict[str, Any] = {}
        state = []
        for parameter in one.parameters:
            if parameter in self._stages:
                there = [task for task in self._of(parameter) if self._is_there(task)]
                state.append(key(*(part for task in there for part in (content(task[1]), self.digest(task)))))
        if name in self._parts and self._parts[name][0] == key(*state):
            return self._parts[name][1]
        parts: list[Part] = []
        for parameter, needed in one.parameters.items():
            taken[parameter] = self._for_show(parameter)
            if needed and taken[parameter] is None:
                break
        else:
            parts = list(one.method(self.study, **taken))
        self._parts[name] = key(*state), parts
        for part in flat(parts):
            if isinstance(part, File):
                self._write(part)
            elif isinstance(part, Warn) and part.repeated:
                self.warn(part.text)
            elif isinstance(part, Warn):
                self.context.progress.warning(part.text, part.where, part.remedy)
            elif isinstance(part, Fault):
                self.fault = part.error
        return parts

    def _of(self, name: str) -> list[Task]:
        return [(name, member) for member in self._members.get(name, [])]

    def _is_there(self, task: Task) -> bool:
        """Return True if a result can be shown without the work of a stage of the run."""
        stage = self._stages[task[0]]
        if stage.kept:
            return self.digest(task) is not None
        if stage.title:
            return task in self._values
        taken = [one for name in stage.needs for one in self._takes(task, name)]
        there = all(self._is_out(one) or self._is_there(one) for one in taken)
        return there and self.digest(task) is not None

    def _for_show(self, name: str) -> Any:
        """An input, or the results so far; None without any."""
        if name not in self._stages:
            return self.given(name)
        there = [task for task in self._of(name) if self._is_there(task)]
        found = self._several(name, [member for _, member in there])
        found.complete = len(found) == len(self._of(name))
        if self._stages[name].over:
            return found or None
        return next(iter(found.values()), None)

    def _write(self, file: File) -> None:
        made = file.make(self.folder / file.name)
        if made is not None:
            write_bytes(self.folder / file.name, made.encode() if isinstance(made, str) else made)


# The study of a process of the pool, which remembers what it made.
_HERE: list[Execution] = []


def _begin(study: Study, folder: Path) -> None:
    _HERE[:] = [Execution(study, folder, RunContext(Progress()))]


def _in_process(task: Task, failed: dict[Task, str], members: dict[str, list[Any]]) -> None:
    """Make a result in a process of the pool, which leaves it in the cache; raises the stage's errors.

    failed, members: those of the process that submits it.
    """
    (work,) = _HERE
    work.failed, work._members = failed, members
    work.value(task)


def _put(table: dict[str, Any], path: Sequence[str], value: Any) -> None:
    *levels, last = path
    for level in levels:
        table = table.setdefault(level, {})
    table[last] = value
