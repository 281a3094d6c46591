"""The run of a study in its folder: its stages in order, and what it shows after each."""

from __future__ import annotations

import itertools
import platform
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing
from functools import partial
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .. import __version__
from ..errors import InputError, MuError, OutputError
from .cache import REVISION, key
from .cluster import Cluster
from .context import KEEP_EVERY_S, RunContext
from .kept_results import Results, Task
from .parts import Part
from .pool import Pool, WorkerDiedError
from .progress import Progress
from .progress_estimate import LOADED, LOADED_S, Plan
from .shown import Shown
from .stored import content
from .study import Dropped, Growth, Members, Section, Study


class Execution(Shown):
    """A study at work in a folder; `run` it once."""

    def __init__(self, study: Study, folder: Path, context: RunContext) -> None:
        super().__init__(study.complete(), folder, context)
        self.study.require_possible()
        self.results = Results(self.study, folder, context.progress)
        self._stages = self.results.stages
        self._done: set[Task] = set()
        self._grew: set[Task] = set()
        self._parts: dict[str, tuple[str, list[Part]]] = {}
        self._shown_s = 0.0
        self._growth: dict[str, tuple[Growth, Sequence[Any] | str]] = {}
        of = {name: self._stages[name].over for name in self.results.members}
        self.results.growing = {name for name, over in of.items() if over and over.grows}
        self._waiting: list[Task] = []
        self._running: dict[Future[None], Task] = {}
        self._begin_growth()
        for task in self.tasks:
            again = self._stages[task[0]].again
            if again and self.results.is_kept(task) and again(self.study, self.results.value(task)):
                self.results.drop(task)

    @property
    def tasks(self) -> list[Task]:
        """Every result that the study wants, in order, without those that are made when they are taken."""
        return [
            (n, m) for n, members in self.results.members.items() if self._stages[n].title for m in members
        ]

    def _groups(self) -> list[tuple[str, set[str]]]:
        """Stages in order by the title of their progress: neighbours of one title are one stage to a user.

        Members of a stage whose titles differ are a group for each title.
        """
        titled = [
            (self._stages[name].title_of(member) if members else self._stages[name].title, name)
            for name, members in self.results.members.items()
            if self._stages[name].title
            # A set that grows may have no member yet.
            for member in members or [None] * (name in self.results.growing)
        ]
        return [(title, {name for _, name in of}) for title, of in groupby(titled, lambda one: one[0])]

    def _in_group(self, task: Task, title: str, names: set[str]) -> bool:
        """Return True if a task is of a group; one by which a set grew is of the group of its stage."""
        stage = self._stages[task[0]]
        return task[0] in names and (stage.title_of(task[1]) == title or task in self._grew)

    def plan(self) -> Plan:
        """Stages with the seconds that are left of each, by what the cache holds."""
        found: dict[str, float] = {}
        for title, names in self._groups():
            tasks = [task for task in self.tasks if self._in_group(task, title, names)]
            if not tasks:
                continue
            seconds = self._stages[tasks[0][0]].seconds(self.study, title)
            kept = sum(self.results.is_kept(task) for task in tasks)
            missing = 1.0 - kept / self._expected(tasks)
            found.setdefault(title, max(missing * seconds, min(LOADED * seconds, LOADED_S)))
        return [*found.items()]

    def _expected(self, tasks: Sequence[Task]) -> int:
        """Number of tasks of a title, with those by which their sets are expected to grow."""
        sets = {name: self._stages[name].over for name, _ in tasks}
        more = [over.most(self.study) - len(self.results.members[n]) for n, over in sets.items() if over]
        return len(tasks) + sum(count for count in more if count > 0)

    def run(self) -> None:
        """Make every result, and show what there is after each stage; raises the error of a stage."""
        self.show()
        self._waiting = self.tasks
        try:
            with closing(Pool(self._workers, self.study.name, _begin, (self.study, self.folder))) as pool:
                for title, names in self._groups():
                    with self.context.progress.stage(title):
                        self._make_all(pool, title, names)
                    self.show()
                    self._forget()
        except MuError:
            self.show()
            raise

    @property
    def _workers(self) -> int:
        """Number of processes for its stages, 1 without any that may be made in others."""
        parallel = any(self._stages[name].parallel for name in self.results.members)
        return self.study.processes if parallel else 1

    def _make_all(self, pool: Pool, title: str, names: set[str]) -> None:
        """Make the results of a group, each after those that it takes, here, in processes or by a scheduler.

        Processes without work in it begin with that of later groups.
        """
        mine = {task for task in self.tasks if self._in_group(task, title, names)}

        def own(tasks: Iterable[Task]) -> list[Task]:
            return [task for task in tasks if task in mine or (task[0] in names and task in self._grew)]

        def update(message: str = "") -> None:
            done = len(own(self._done))
            left = own([*self._waiting, *self._running.values()])
            self.context.progress.update(
                done / max(self._expected(own(self.tasks)), done + len(left)), message
            )
            if left and time.monotonic() - self._shown_s > KEEP_EVERY_S:
                self.show()

        while (waiting := own(self._waiting)) or own(self._running.values()):
            one_here = self._workers == 1 and not (self.study.elsewhere and self._is_parallel(waiting))
            worth = self._worth(waiting, first=one_here)
            here = next((t for t in worth if one_here or not self._is_for_pool(t)), None)
            if here is not None:
                self._wait_for([here])
                update(self._finish(here))
            elif worth and self.study.elsewhere:
                self._make_elsewhere(worth, update)
            elif self._fill(pool, worth) or self._running:
                self._wait_for(own(self._running.values()))
                for future in wait(self._running, return_when=FIRST_COMPLETED).done:
                    update(self._finish(self._running.pop(future), partial(pool.result, future)))
            else:
                self._give_up(waiting)
                update()

    def _wait_for(self, tasks: Iterable[Task]) -> None:
        """Tell the progress what has been made for longest."""
        every = ((self._stages[name].doing, member) for name, member in tasks)
        words = (doing(self.study, member) for doing, member in every if doing)
        self.context.progress.waits_for = next(words, "")

    def _is_parallel(self, tasks: Sequence[Task]) -> bool:
        return any(self._stages[name].parallel for name, _ in tasks)

    def _fill(self, pool: Pool, worth: Sequence[Task]) -> bool:
        """Give idle processes tasks, without others those of later groups; True if any was given."""
        free = self._workers - len(self._running) if self._workers > 1 else 0
        given = [*worth[:free]]
        if len(given) < free:
            # A stage that chooses its members, by their results so far, is not begun beforehand.
            later = (t for t in self._waiting if t not in worth and not self._chooses(t))
            ready = (t for t in later if self._is_ready(t) and self._is_for_pool(t))
            given += itertools.islice(ready, free - len(given))
        for task in given:
            failed, members = self.results.failed, self.results.members
            self._running[pool.submit(_in_process, task, failed, members)] = task
            self._waiting.remove(task)
        return bool(given)

    def _chooses(self, task: Task) -> bool:
        over = self._stages[task[0]].over
        return over is not None and over.choose is not None

    def _make_elsewhere(self, worth: list[Task], update: Callable[[str], None]) -> None:
        """Have the results of tasks made by the workers of the study's scheduler."""
        orders = [(self.study, task, self.results.taken_values(task), version()) for task in worth]
        with closing(Cluster(self.study.elsewhere)) as cluster:
            for number, found in cluster.results(orders, _elsewhere, self.context.progress.warning):
                update(self._finish(worth[number], partial(self._receive, worth[number], found)))

    def _receive(self, task: Task, found: Any) -> None:
        if isinstance(found, MuError):
            raise found
        self.results.keep(task, found)

    def _is_for_pool(self, task: Task) -> bool:
        return self._stages[task[0]].parallel and not self.results.is_kept(task)

    def _give_up(self, waiting: Sequence[Task]) -> None:
        """Leave members that were not chosen, and what needs them; raises TypeError if there are none."""
        if not any(self._is_ready(task) for task in waiting):
            names = ", ".join({name for name, _ in waiting})
            raise TypeError(f"stages need each other in a circle: {names}")
        self.results.failed |= dict.fromkeys(waiting, "")
        self._done.update(waiting)
        self._waiting = [task for task in self._waiting if task not in waiting]

    def _worth(self, waiting: Sequence[Task], first: bool) -> list[Task]:
        """The tasks that can be made now, and are worth it, in order; first: the first of them suffices."""
        found: list[Task] = []
        for name, group in groupby(waiting, lambda task: task[0]):
            over = self._stages[name].over
            if over is None or over.choose is None:
                ready = (task for task in group if self._is_ready(task))
                found += [one for one in [next(ready, None)] if one] if first else ready
            else:
                members = [task[1] for task in group if self._is_ready(task)]
                found += [
                    (name, m) for m in over.choose(self.study, members, self._so_far(name)) if m in members
                ]
            if first and found:
                break
        return found

    def _so_far(self, name: str) -> Members:
        members = [member for member in self.results.members[name] if (name, member) in self._done]
        return self.results.several(name, members)

    def _is_ready(self, task: Task) -> bool:
        """Return True if all that a task takes is made, or will not be."""
        stage = self._stages[task[0]]
        for name in stage.needs:
            if self.results.is_unknown(task, name):
                return False
            for one in self.results.taken(task, name):
                if name in self.results.members and not self._is_made(one):
                    return False
        return True

    def _finish(self, task: Task, work: Callable[[], Any] | None = None) -> str:
        """Make a task's result, by `work` if that is given; a failure that may be becomes a warning.

        Returns a few words on the result.
        """
        stage, message = self._stages[task[0]], ""
        try:
            if work is not None:
                work()
                self.results.catch_up(self.results.failed, self.results.members)
            if not self.results.is_kept(task):
                self.results.value(task)
            message = stage.says(self.results.value(task)) if stage.says else ""
        except Dropped:
            self.results.failed[task] = ""
        except (OutputError, WorkerDiedError):
            raise
        except MuError as error:
            if not stage.failing:
                raise
            where = f" ({error.where})" if error.where and isinstance(error, InputError) else ""
            words = stage.failing.format(**stage.of_member(task[1]))
            self.results.failed[task] = f"{words}: {error.what}{where}."
            self.tell(self.results.failed[task])
        self._done.add(task)
        if task in self._waiting:
            self._waiting.remove(task)
        self._go_on()
        return message

    def _go_on(self) -> None:
        """Let sets grow that wait for what is known now, and begin others: also once one has ended."""
        for name in [*self._growth]:
            self._grow(name)
        self._begin_growth()

    def _begin_growth(self) -> None:
        """Begin the growth of the sets for which all is known that they take."""
        for name in [n for n in self.results.members if n in self.results.growing - self._growth.keys()]:
            over = self._stages[name].over
            assert over is not None
            assert over.grows is not None
            needed = [task for one in over.after for task in self._tasks_of(one)]
            if not all(self._is_made(task) for task in needed):
                continue
            try:
                growth = over.grows(self.study, *(self.results.value((one, None)) for one in over.after))
                self._growth[name] = growth, next(growth)
            except (StopIteration, Dropped):
                self.results.growing.discard(name)
                return self._go_on()
            self._grow(name)
        return None

    def _tasks_of(self, name: str) -> list[Task]:
        return [(name, member) for member in self.results.members.get(name, [])]

    def _is_made(self, task: Task) -> bool:
        """Return True if a task's result is there, or can be made in memory now, or will never be."""
        return task in self._done if self._stages[task[0]].title else self._is_ready(task)

    def _grow(self, name: str) -> None:
        """Add the members by which a set grows now, that its growth asks for (`Over.grows`)."""
        new: list[Any] = []
        while name in self._growth:
            growth, asked = self._growth[name]
            awaits = isinstance(asked, str)
            tasks = self._tasks_of(asked) if isinstance(asked, str) else [(name, m) for m in asked]
            new += [m for of, m in tasks if of == name and m not in self.results.members[name] + new]
            if not all(self._is_made(task) for task in tasks):
                break
            try:
                self._growth[name] = growth, self._asked_next(growth, tasks, awaits)
            except (StopIteration, Dropped):
                del self._growth[name]
                self.results.growing.discard(name)
        if new:
            self.results.grow(name, new)
            self._grew.update((name, member) for member in new)
            self._waiting += [(name, member) for member in new]
        if name not in self.results.growing:
            self._go_on()

    def _asked_next(self, growth: Growth, tasks: Sequence[Task], awaits: bool) -> Sequence[Any] | str:
        """What a growth asks for after the results of some tasks, or after Dropped of one without."""
        try:
            results = [self.results.value(task) for task in tasks]
        except Dropped as dropped:
            return growth.throw(dropped)
        return growth.send(results[0] if awaits else results)

    def _forget(self) -> None:
        """Release results that no task to come takes: a factor, a field of displacements."""
        needed: set[Task] = set()
        for task in self.tasks:
            if task not in self._done:
                needed.update(self.results.all_taken(task))
        self.results.forget(needed.__contains__)

    def show(self) -> None:
        """Write files and summary of all results that there are."""
        shown = [(one, self._section(one)) for one in self.study.sections()]
        self.put(shown, [text for text in self.results.failed.values() if text])
        self._shown_s = time.monotonic()

    def _section(self, one: Section) -> list[Part]:
        """A section's parts, made anew if what it shows is; its files are then written."""
        name = one.method.__name__
        there = {p: self._there(p) for p in one.parameters if p in self._stages}
        state = key(
            *(part for p in there for t in there[p] for part in (content(t[1]), self.results.digest(t)))
        )
        if name in self._parts and self._parts[name][0] == state:
            return self._parts[name][1]
        parts: list[Part] = []
        if all(there[p] for p, needed in one.parameters.items() if needed and p in there):
            values = {p: self._for_show(p, there.get(p, [])) for p in one.parameters}
            if not any(values[p] is None for p, needed in one.parameters.items() if needed and p in there):
                parts = self.made(one.method(self.study, **values))
        self._parts[name] = state, parts
        return parts

    def _there(self, name: str) -> list[Task]:
        """The tasks of a stage whose results can be shown."""
        tasks = [(name, member) for member in self.results.members.get(name, [])]
        return [task for task in tasks if self.results.is_there(task)]

    def _for_show(self, name: str, there: list[Task]) -> Any:
        """An input, or the results so far; None without any."""
        if name not in self._stages:
            return self.results.given(name)
        found = self.results.several(name, [member for _, member in there])
        if self._stages[name].over is None:
            return next(iter(found.values()), None)
        found.complete = len(found) == len(self.results.members.get(name, []))
        return found or None


# The study of a process of the pool, which remembers what it made.
_HERE: list[Results] = []


def _begin(study: Study, folder: Path) -> None:
    _HERE[:] = [Results(study, folder, Progress())]


def _in_process(task: Task, failed: dict[Task, str], members: dict[str, list[Any]]) -> None:
    """Make a result in a process of the pool, which leaves it in the cache; raises the stage's errors.

    failed, members: those of the process that submits it.
    """
    (results,) = _HERE
    results.catch_up(failed, members)
    # A process may have made a model for another stage: two would take twice the memory.
    results.forget(set(results.all_taken(task)).__contains__)
    results.value(task)


def version() -> str:
    """Version that a scheduler's workers must have, too."""
    return f"{__version__} revision {REVISION}"


def _elsewhere(study: Study, task: Task, taken: dict[str, Any], asked: str) -> Any:
    """Make a result on a worker of a scheduler; taken: what it takes of other stages; asked: `version`.

    Raises the stage's errors, and MuError where this worker is of another version.
    """
    if asked != version():
        raise MuError(
            f"the worker has mu_addon {version()}, the run {asked}",
            platform.node(),
            "install the same version on every worker",
        )
    with TemporaryDirectory(prefix="mu-worker-", ignore_cleanup_errors=True) as folder:
        results = Results(study, Path(folder), Progress())
        own = {n: results.given(n) for n in results.stages[task[0]].needs if n not in results.stages}
        return results.made(task, {**taken, **own})
