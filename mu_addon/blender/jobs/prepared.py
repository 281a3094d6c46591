"""What the window would stand still for is made in a process of its own, and what asked for it asked again.

In background, where timers never fire and no window waits, it is made at once; so it is for a script, which
goes on with what is made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import bpy

from ...files import read_npz, write_npz
from ...run.child import DONE
from ...run.folder import write_run
from ..shared import viewports
from .start_child import JOB_ENDED, JobKind, forget

_scripts = 0


def at_once() -> bool:
    """Whether nobody waits at a window: in background, and while a script calls an operator."""
    return bool(bpy.app.background or _scripts)


@contextmanager
def called_by(script: bool) -> Iterator[None]:
    """While the body runs an operator, called by a script or by a hand."""
    global _scripts
    _scripts += script
    try:
        yield
    finally:
        _scripts -= script


@attrs.define(eq=False)
class Elsewhere(Exception):
    """Raised by who needs what is not there yet; `begin` has it made.

    job: of `usecases.prepare`, done in `folder`; keep: told the arrays found, or None and what went wrong;
    points (p, 3): in mm, where they are embedded; repeats: whether what asked is asked again.
    """

    title: str
    folder: Path
    job: Any
    keep: Callable[[Any, str], None]
    points: Any = None
    repeats: bool = True

    def begin(self, root: Any, again: Callable[[], None]) -> None:
        """Start it, then `again`; for what is being made already, only remember that."""
        kind = _kind(self, root)
        if kind.is_running(root):
            _waiting[kind.key(root)][1].append(again)
            return
        kind.start(root, self.folder, self._write)
        _waiting[kind.key(root)] = self, [again] * self.repeats

    def _write(self, folder: Path) -> None:
        from ...usecases.prepare import LAYOUT, POINTS, RESULT

        write_run(folder, LAYOUT, self.job.texts())
        (folder / RESULT).unlink(missing_ok=True)
        if self.points is not None:
            write_npz(folder / POINTS, {"points": self.points}, packed=False)


_waiting: dict[str, tuple[Elsewhere, list[Callable[[], None]]]] = {}
"""By key of a job: what it makes, and what comes then."""


def _kind(wanted: Elsewhere, root: Any) -> JobKind:
    name = root.mu_unit.uuid
    return JobKind(f"prepare-{wanted.folder.name}", lambda _: name, lambda _: wanted.folder, wanted.title)


def _ended(key: str) -> None:
    from ...usecases.prepare import RESULT
    from .start_child import child_of

    wanted, then = _waiting.pop(key, (None, []))
    child = child_of(key)
    if wanted is None or child is None:
        return
    found = read_npz(wanted.folder / RESULT) if child.state == DONE else None
    wanted.keep(found, "" if found is not None else (child.error or {}).get("what", child.state))
    if found is None or not wanted.repeats:
        return
    forget(key)
    for again in then:
        again()
    viewports.redraw()


def register() -> None:
    """Hear when a job has ended."""
    JOB_ENDED.connect(_ended)


def unregister() -> None:
    """Hear no more of it."""
    JOB_ENDED.disconnect(_ended)
    _waiting.clear()
