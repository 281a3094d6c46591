"""Results of a study: each made once, from what it depends on, and kept in the folder's cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..errors import InputError
from .cache import Cache, key
from .progress import Progress
from .stored import content, packed, unpacked
from .study import TELL, Dropped, Members, Stage, Study, Tell, parameters_of

Task = tuple[str, Any]
"""A stage's name and a member of its set, None of a stage without one."""
# Array of an entry of the cache with the hash of what it holds, whatever its own name.
_CONTENT = "content"


class Results:
    """Inputs, derived values and results of a study: made, or read from the cache, when they are asked for.

    members: of each stage that the study wants; failed: tasks that have no result, with the reason, "" of one
    that was dropped; growing: names of stages whose sets are not whole yet.
    """

    def __init__(self, study: Study, folder: Path, progress: Progress) -> None:
        self.study, self.folder, self.progress = study, folder, progress
        self.cache = Cache(folder / "cache")
        self.stages = study.all_stages()
        wanted = {name: one for name, one in self.stages.items() if one.wanted(study)}
        # What cannot do without a stage that is not wanted is not wanted either.
        while without := [
            n for n, one in wanted.items() if any(self._lacks(one, p, wanted) for p in one.needs)
        ]:
            wanted = {name: one for name, one in wanted.items() if name not in without}
        self.members = {n: list(s.over.members(study)) if s.over else [None] for n, s in wanted.items()}
        self.failed: dict[Task, str] = {}
        self.growing: set[str] = set()
        self._given: dict[str, Any] = {name: getattr(study, name) for name in study.inputs()}
        self._contents: dict[str, str] = {}
        self._values: dict[Task, Any] = {}
        self._digests: dict[Task, str] = {}
        # Known to have no result so far: asked again once something was made.
        self._missing: set[Task] = set()

    def _lacks(self, one: Stage, name: str, wanted: Mapping[str, Stage]) -> bool:
        return name in self.stages and name not in wanted and not one.may_lack(name)

    def given(self, name: str) -> Any:
        """An input, or a value derived from inputs, by a method or a property; made once."""
        if name not in self._given:
            method = self.study.derived().get(name)
            self._given[name] = (
                method(self.study, **{p: self.given(p) for p in parameters_of(method)})
                if method
                else getattr(self.study, name)
            )
        return self._given[name]

    def taken(self, task: Task, name: str) -> list[Task]:
        """The tasks of which a task takes the results by one of its parameters; none for an input."""
        if name not in self.stages:
            return []
        wanted = self._wanted(task, name)
        return [(name, one) for one in (wanted if isinstance(wanted, list) else [wanted])]

    def all_taken(self, task: Task) -> Iterator[Task]:
        """The tasks of which a task takes the results, and those that these are made of in memory."""
        for name in self.stages[task[0]].needs:
            for one in self.taken(task, name):
                yield one
                # A kept result that is not there any more is read again.
                if not self.stages[one[0]].title:
                    yield from self.all_taken(one)

    def is_unknown(self, task: Task, name: str) -> bool:
        """Return True if a task takes, by one of its parameters, a whole set that still grows."""
        over = self.stages[task[0]].over
        chosen = over is not None and name in over.needs(self.study, task[1])
        return name in self.growing and name != task[0] and not chosen

    def _wanted(self, task: Task, name: str) -> Any:
        """What a task takes of another stage: a member, or a list of members."""
        stage = self.stages[task[0]]
        needs = stage.over.needs(self.study, task[1]) if stage.over else {}
        if unknown := set(needs) - set(stage.needs):
            raise TypeError(f"stage {stage.name} has no parameter {', '.join(unknown)}")
        if name in needs:
            return needs[name]
        return self.members.get(name, []) if self.stages[name].over else None

    def key(self, task: Task) -> str | None:
        """Hash of all that a task's result depends on; None while it lacks something that it takes."""
        stage, member = self.stages[task[0]], task[1]
        own = stage.given_by(self.study, member) if stage.over and stage.over.gives else member
        parts: list[Any] = [__version__, stage.name, stage.revision, content(own)]
        for name in stage.needs:
            if name not in self.stages:
                parts += [name, self._content(name)]
                continue
            several = isinstance(self._wanted(task, name), list)
            for one in self.taken(task, name):
                digest = self.digest(one)
                if digest is None and not ((several or stage.may_lack(name)) and self.is_out(one)):
                    return None
                parts += [name, content(one[1]), digest or ""]
        return key(*parts)

    def _content(self, name: str) -> str:
        if name not in self._contents:
            # Nothing is kept in a folder that the study joins: no key outlives the run.
            self._contents[name] = name if self.study.joins else content(self.given(name))
        return self._contents[name]

    def digest(self, task: Task) -> str | None:
        """Hash of a result's content, or None while there is none."""
        if task not in self._digests:
            if task in self._missing:
                return None
            name = self._name(task)
            if name is not None and not self.stages[task[0]].kept:
                self._digests[task] = name
            elif name is None or not self._load(task, name):
                self._missing.add(task)
                return None
        return self._digests[task]

    def _name(self, task: Task) -> str | None:
        """Key of a task that may have a result, else None."""
        if self.is_out(task):
            return None
        if task[1] not in self.members[task[0]]:
            raise TypeError(f"stage {task[0]} has no member {task[1]!r}")
        return self.key(task)

    def is_out(self, task: Task) -> bool:
        """Return True if a task has no result and will have none."""
        return task in self.failed or task[0] not in self.members

    def is_kept(self, task: Task) -> bool:
        """Return True if a result is in the cache."""
        return self.stages[task[0]].kept and self.digest(task) is not None

    def is_there(self, task: Task) -> bool:
        """Return True if a result can be given without the work of a stage of the run."""
        stage = self.stages[task[0]]
        if stage.title and not stage.kept:
            return task in self._values
        if not stage.kept:
            if any(self.is_unknown(task, name) for name in stage.needs):
                return False
            every = [one for name in stage.needs for one in self.taken(task, name)]
            if not all(self.is_out(one) or self.is_there(one) for one in every):
                return False
        return self.digest(task) is not None

    def _load(self, task: Task, name: str) -> bool:
        """Read a kept result, if the cache has it and it is of the stage's type."""
        stage = self.stages[task[0]]
        arrays = self.cache.get(stage.name, name)
        if arrays is None or _CONTENT not in arrays:
            return False
        digest = str(arrays.pop(_CONTENT))
        try:
            self._values[task] = unpacked(stage.result_type, arrays)
        except (ValueError, TypeError, InputError):
            # Of a class that has changed since: made anew.
            return False
        self._digests[task] = digest
        return True

    def value(self, task: Task) -> Any:
        """A result: remembered, from the cache, or made now. Raises Dropped where it has none."""
        if task not in self._values:
            name = self._name(task)
            if name is None:
                raise Dropped
            if not self.stages[task[0]].kept or not self._load(task, name):
                self._make(task, name)
        return self._values[task]

    def several(self, name: str, members: Sequence[Any]) -> Members:
        """Results of those members of a stage's set that have one."""
        found = Members()
        for member in members:
            try:
                found[member] = self.value((name, member))
            except Dropped:
                found.complete = False
        return found

    def _make(self, task: Task, name: str) -> None:
        """Do the work of a task, and keep its result."""
        values = {n: self._of_parameter(task, n) for n in self.stages[task[0]].needs}
        self._keep(task, name, self.made(task, values))

    def made(self, task: Task, values: Mapping[str, Any]) -> Any:
        """The result of a task by the work of its stage; values: of what it takes, by parameter."""
        stage = self.stages[task[0]]
        more = (
            {TELL: Tell(self.progress, self.folder / "cache")} if TELL in parameters_of(stage.method) else {}
        )
        # Without the study: what a stage does not name cannot decide its result.
        return stage.method(None, **values, **stage.given_by(self.study, task[1]), **more)

    def taken_values(self, task: Task) -> dict[str, Any]:
        """What a task takes of other stages, by parameter."""
        return {n: self._of_parameter(task, n) for n in self.stages[task[0]].needs if n in self.stages}

    def keep(self, task: Task, found: Any) -> None:
        """Keep a result that was made elsewhere."""
        name = self._name(task)
        assert name is not None
        self._keep(task, name, found)

    def _keep(self, task: Task, name: str, found: Any) -> None:
        stage = self.stages[task[0]]
        self._values[task], self._digests[task] = found, name
        self._missing.clear()
        if stage.kept:
            arrays = packed(found)
            if content(unpacked(stage.result_type, arrays)) != content(found):
                raise TypeError(f"stage {stage.name} does not give a {stage.result_type}")
            digest = key(*(part for item in sorted(arrays.items()) for part in item))
            self.cache.put(stage.name, name, {**arrays, _CONTENT: np.asarray(digest)})
            self._digests[task] = digest

    def drop(self, task: Task) -> None:
        """Remove a kept result, so that it is made anew."""
        name = self._name(task)
        if name is not None:
            self.cache.drop(task[0], name)
        self._values.pop(task, None)
        self._digests.pop(task, None)

    def _of_parameter(self, task: Task, name: str) -> Any:
        if name not in self.stages:
            return self.given(name)
        wanted = self._wanted(task, name)
        if isinstance(wanted, list):
            return self.several(name, wanted)
        lacks = self.is_out((name, wanted)) and self.stages[task[0]].may_lack(name)
        return None if lacks else self.value((name, wanted))

    def forget(self, is_needed: Callable[[Task], bool]) -> None:
        """Release results that are not needed, and that are kept or can be made anew."""
        for task in [*self._values]:
            stage = self.stages[task[0]]
            if not is_needed(task) and (stage.kept or not stage.title):
                del self._values[task]

    def catch_up(self, failed: dict[Task, str], members: dict[str, list[Any]]) -> None:
        """Take over what another process knows; what was missing may be in the cache by now."""
        self.failed, self.members = failed, members
        self._missing.clear()

    def grow(self, name: str, members: Sequence[Any]) -> None:
        """Add members to a stage's set; what was made in memory of the smaller set is forgotten."""
        self.members[name] = [*self.members[name], *members]
        self._missing.clear()
        for task in [*self._digests]:
            if not self.stages[task[0]].title:
                del self._digests[task]
                self._values.pop(task, None)
