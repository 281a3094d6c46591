"""Child processes of jobs: one for each job, read by a timer.

Jobs of minutes outlive Blender, unless the user decides otherwise, and the next session takes them over
(`sessions`); the others end with their session.

Running jobs are kept here, in Python, and never in the .blend file, so that a file loaded later has no button
stuck at "running". This module does not write to Blender's data.
"""

from __future__ import annotations

import atexit
import importlib
import importlib.util
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import attrs
import bpy

from ...errors import InputError, MuError
from ...run.child import FAILED, RUNNING, WAITING, Child
from ...run.found_child import FoundChild
from ...run.interpreter import environment, worker_command
from ...run.progress_estimate import Plan
from ..shared import viewports
from ..shared.registration import at_end, at_start, timer
from ..shared.updates import Signal
from . import lasting_jobs

INTERVAL_S = 0.2
REDRAW_S = 1.0
"""Time between two drawings of a job that runs."""
LOAD_AFTER_S, LOAD_EVERY_S = 1.0, 0.1
WRITERS = (
    "tomlkit",
    "mu_addon.evidence.effect",
    "mu_addon.evidence.prediction.specimen",
    "mu_addon.evidence.unit_body",
    "mu_addon.fem.newton_settings",
    "mu_addon.placement.graph",
    "mu_addon.simulate_and_place.named_effects",
    "mu_addon.studies.unit_ranking",
    "mu_addon.studies.grip",
    "mu_addon.studies.live",
    "mu_addon.studies.prepare",
    "mu_addon.studies.export",
    "mu_addon.studies.specimens",
    "mu_addon.studies.check",
    "mu_addon.studies.import_",
    "pyparsing",
    "PIL.Image",
    "PIL.PngImagePlugin",
    "dateutil.parser",
    "kiwisolver",
    "matplotlib",
)
"""Modules that write a job's inputs or colour a result, each loaded in a tenth of a second; no solver."""
CHILD_MAIN = Path(__file__).with_name("child_main.py")
SOLVER = ("warp", "scipy", "cvxopt", "meshio", "matplotlib")
"""Modules that a simulation needs."""
PACKAGE = __package__.rpartition(".blender")[0]
"""Name of the extension's package, under which Blender keeps its preferences."""
OWN_FOLDER = "blender"
"""Folder within a run's folder for files that the child adds to its outputs."""

JOB_ENDED, JOB_NEWS = Signal(), Signal()
"""Sent with the key of a job that has ended, or has said something."""


@attrs.define(eq=False)
class Job:
    """A job of this session, running or ended: its key, its child, its title in the header, "" for none.

    heavy: takes the machine for minutes, and runs one at a time; lasts: outlives Blender if the user wants.
    """

    key: str
    child: Child
    title: str = ""
    heavy: bool = False
    lasts: bool = False

    @property
    def runs(self) -> bool:
        """True if it runs, or waits for another one."""
        return self.child.state in (RUNNING, WAITING)

    @property
    def goes_on(self) -> bool:
        """True if it outlives Blender: it runs, and does not wait."""
        return self.lasts and self.child.state == RUNNING and _wanted()


_jobs: dict[str, Job] = {}
"""By key, in the order in which they were started."""


def missing(modules: Sequence[str] = SOLVER) -> list[str]:
    """Names of the modules that this Blender lacks."""
    return [name for name in modules if importlib.util.find_spec(name) is None]


def lacking(modules: Sequence[str] = SOLVER) -> str:
    """Names of the modules that this Blender lacks, as text; empty if it has all."""
    names = missing(modules)
    return f"Not in this Blender: {', '.join(names)}" if names else ""


def start(
    arguments: Sequence[str],
    folder: Path,
    ends_with_parent: bool = False,
    plan: Plan = (),
    waits: bool = False,
) -> Child:
    """Start one command line of the core for a run in `folder`; raises MuError. See `Child`."""
    command = worker_command(CHILD_MAIN, arguments, bpy.app.binary_path)
    # A controlled one reads its input by itself.
    watches = ends_with_parent and "--controlled" not in arguments
    given = environment() | ({"MU_ENDS_WITH_INPUT": "1"} if watches else {})
    return Child(command, folder / OWN_FOLDER, given, ends_with_parent, plan, waits)


@attrs.frozen(eq=False)
class JobKind:
    """A kind of job for objects of the scene, one at a time for each object.

    name: of the kind; uuid_of, folder_of: identifier of a root object and folder of its run. title: name of
    the job; heavy: takes the machine for minutes, so that only one such job runs at a time and others wait;
    plan_of: its expected stages for an object; outlives: may continue after Blender ends, as heavy ones may;
    prefix: of the names of its operators, see `job_operators`.
    """

    name: str
    uuid_of: Callable[[Any], str]
    folder_of: Callable[[Any], Path]
    title: str = "job"
    heavy: bool = False
    plan_of: Callable[[Any], Plan] = lambda root: ()
    outlives: bool = False
    prefix: str = ""

    def key(self, root: Any) -> str:
        """Identifier of the job of that object."""
        return f"{self.uuid_of(root)}:{self.name}"

    def child(self, root: Any) -> Child | None:
        """The latest child of this session for the object, running or ended, or None."""
        return child_of(self.key(root))

    def is_running(self, root: Any) -> bool:
        """Return True if the job runs, or waits for another one."""
        return runs(self.key(root))

    def start(
        self, root: Any, folder: Path, write_inputs: Callable[[Path], None], options: Sequence[str] = ()
    ) -> Child:
        """Write the inputs of the object's job into a folder, and run it by `resume`; raises MuError.

        options: of `resume`, which decide no result.
        """
        if self.is_running(root):
            raise InputError("this job is running already", str(folder), "wait for it or cancel it")
        write_inputs(folder)
        key, plan = self.key(root), self.plan_of(root)
        waits = self.heavy and is_busy()
        child = start(["resume", str(folder), "--json", *options], folder, plan=plan, waits=waits)
        title, lasts = f"{root.name}: {self.title}", self.heavy or self.outlives
        if lasts:
            record = lasting_jobs.Record(key, title, folder, time.time(), tuple(plan), self.heavy)
            lasting_jobs.keep(record)
        return watch(key, child, title, self.heavy, lasts)

    def dismiss(self, root: Any) -> None:
        """Remove an ended job, so that no panel shows it."""
        if not self.is_running(root):
            forget(self.key(root))


def child_of(key: str) -> Child | None:
    """The latest child of the job of that key, running or ended, or None."""
    return _jobs[key].child if key in _jobs else None


def runs(key: str) -> bool:
    """Return True if the job of that key runs, or waits for another one."""
    return key in _jobs and _jobs[key].runs


def running() -> list[Job]:
    """The running or waiting jobs, in the order in which they were started."""
    return [job for job in _jobs.values() if job.runs]


def is_busy() -> bool:
    """Return True if a job that takes the machine for minutes runs."""
    return any(job.heavy for job in running())


def ended() -> list[Job]:
    """The jobs with a title that have ended and were not dismissed, the latest last."""
    return [job for job in _jobs.values() if job.title and not job.runs]


def _wanted() -> bool:
    """Return True if the user lets jobs outlive Blender; False without preferences, as in a script."""
    extension = bpy.context.preferences.addons.get(PACKAGE)
    return bool(getattr(getattr(extension, "preferences", None), "jobs_go_on", False))


def forget(key: str) -> None:
    """Remove a job that has ended."""
    _jobs.pop(key, None)


def watch(key: str, child: Child, title: str = "", heavy: bool = False, lasts: bool = False) -> Child:
    """Let the timer read a child's messages, as the job of that key; see `Job`."""
    # Appended again: jobs are listed in the order in which they were started.
    forget(key)
    _jobs[key] = Job(key, child, title, heavy, lasts)
    _poll.soon(INTERVAL_S)
    viewports.redraw()
    return child


def poll() -> bool:
    """Read the new output of every child; return True if there was any."""
    news = [job.key for job in _jobs.values() if job.child.poll()]
    for key in news:
        JOB_NEWS.send(key)
    return _begin_next() or bool(news)


def _begin_next() -> bool:
    """Start the first waiting job if none of its kind runs; return True if there was one."""
    heavy = [job.child for job in _jobs.values() if job.heavy]
    waiting = [child for child in heavy if child.state == WAITING]
    if not waiting or any(child.state == RUNNING for child in heavy):
        return False
    try:
        waiting[0].begin()
    except MuError as error:
        what = {"what": error.what, "where": error.where, "what_to_do": error.remedy}
        waiting[0].state, waiting[0].error = FAILED, what
    return True


class _Redraws:
    """Redraws for the running jobs, one each `REDRAW_S`.

    Without a graphics card a frame takes a tenth of a second of the processor that the solver needs.
    """

    def __init__(self) -> None:
        self._news, self._last_s = False, -math.inf

    def tell(self, news: bool, changed: bool) -> None:
        """Redraw if due. news: a job has sent something; changed: one has ended."""
        self._news |= news
        if not changed and time.monotonic() - self._last_s < REDRAW_S:
            return
        self._last_s = time.monotonic()
        # The time left counts down between messages, too.
        viewports.redraw_status()
        # A report of progress changes no scene.
        if changed:
            viewports.redraw()
        elif self._news:
            viewports.redraw_regions("UI")
        self._news = False


_redraws = _Redraws()


@timer(lasts=True)
def _poll() -> float | None:
    before = running()
    news = poll()
    if news or before:
        _redraws.tell(news, before != running())
    for job in before:
        if not job.runs:
            lasting_jobs.drop(job.key)
            JOB_ENDED.send(job.key)
    return INTERVAL_S if running() else None


def _end_all() -> None:
    """End the jobs that do not outlive Blender."""
    left = [job for job in _jobs.values() if job.goes_on]
    for job in _jobs.values():
        if job not in left:
            job.child.kill()
            lasting_jobs.drop(job.key)
    lasting_jobs.close(bool(left))


@timer(lasts=True, after_s=LOAD_AFTER_S)
def _take_up() -> None:
    """Watch the jobs of former sessions, running or ended."""
    for record in lasting_jobs.take_up():
        if runs(record.key):
            continue
        try:
            child = FoundChild(record.run, record.run / OWN_FOLDER, record.plan, record.started_s)
        except MuError:
            # Its folder is gone, and its messages with it.
            continue
        lasting_jobs.keep(record)
        watch(record.key, child, record.title, record.heavy, lasts=True)


@timer(lasts=True, after_s=LOAD_AFTER_S)
def _load_writer() -> float | None:
    """Load the writers of a job's inputs, a module at a time, so that the first job starts quickly."""
    if missing(WRITERS[:1]):
        return None
    for name in WRITERS:
        module = name.replace("mu_addon", PACKAGE, 1) if name.startswith("mu_addon.") else name
        if module not in sys.modules:
            importlib.import_module(module)
            return LOAD_EVERY_S
    return None


@at_start
def _end_at_exit() -> None:
    atexit.register(_end_all)


@at_end
def _end() -> None:
    atexit.unregister(_end_all)
    _end_all()
    _jobs.clear()
