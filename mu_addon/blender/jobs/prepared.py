"""Slow parts of operators, computed in a separate process; the operator is called again once they exist.

In background, where timers never fire, and for a script, which continues with the result, they are computed
immediately.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import bpy

from ...files import read_npz, write_npz
from ...run.child import DONE
from ..shared import viewports
from ..shared.operators import NotReady, in_script
from ..shared.registration import at_end, connected
from .start_child import JOB_ENDED, JobKind, child_of, forget


def at_once() -> bool:
    """Return True without a user at a window: in background, and while a script calls an operator."""
    return bool(bpy.app.background or in_script())


@attrs.define(eq=False)
class NotPrepared(NotReady):
    """Raised where a slow part is lacking; `begin` starts the process that computes it.

    job: of `studies.prepare`, run in `folder`; keep: called with the arrays, or None and the error; points
    (p, 3): points to embed, in mm; repeats: True if the operator is called again.
    """

    title: str
    folder: Path
    job: Any
    keep: Callable[[Any, str], None]
    points: Any = None
    repeats: bool = True

    def begin(self, again: Callable[[], None]) -> None:
        """Start the process and call `again` at its end; if it runs already, only add the call."""
        kind, root = _kind(self), self.root
        if kind.is_running(root):
            _waiting[kind.key(root)][1].append(again)
            return
        kind.start(root, self.folder, self._write)
        _waiting[kind.key(root)] = self, [again] * self.repeats

    def _write(self, folder: Path) -> None:
        from ...studies.prepare import POINTS, RESULT
        from ...studies.starting import write_study

        write_study(self.job, folder)
        (folder / RESULT).unlink(missing_ok=True)
        if self.points is not None:
            write_npz(folder / POINTS, {"points": self.points}, packed=False)


_waiting: dict[str, tuple[NotPrepared, list[Callable[[], None]]]] = {}
"""By key of a job: the thing that it makes, and the calls at its end."""


def _kind(wanted: NotPrepared) -> JobKind:
    name = wanted.root.mu_unit.uuid
    return JobKind(f"prepare-{wanted.folder.name}", lambda _: name, lambda _: wanted.folder, wanted.title)


@connected(JOB_ENDED)
def _ended(key: str) -> None:
    from ...studies.prepare import RESULT

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


@at_end
def _forget() -> None:
    _waiting.clear()
