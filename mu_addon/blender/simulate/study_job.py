"""A study as a job of an object in the scene: start, expected time, state and result, from its declaration.

By hand stay the fields that a panel asks for in its own way, the words on a button, and gestures on results.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from ...errors import MuError
from ...reading import file_bytes, parse_json
from ...run.folder import write_run
from ...run.progress_estimate import Plan
from ...run.study import Study
from ...run.summary import SUMMARY
from ...studies import study
from ..jobs.panel import timed
from ..jobs.start_child import SOLVER, JobKind, lacking
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..shared.wording import in_panel
from . import study_folder, timings

OF_UNIT = ("unit", "path")
"""Inputs that are the unit's own parameters."""


@attrs.frozen(eq=False)
class Found:
    """A result: content of its file, and the digest of that; stale: why it is not of the present inputs."""

    folder: Path
    stale: str
    content: dict[str, Any]
    digest: str


@attrs.frozen(eq=False)
class StudyJob:
    """A study of an object: a unit, unless `claim` is given.

    study: its name; kind: of the job, which several studies of an object may share; folder_of: folder of its
    run; given: its inputs by name, raises MuError; fields: property by input, of the group `group`; hindered:
    why it cannot start, beside what its inputs say; result: file that is shown, made by `made_of` of its
    JSON and its folder; beside: inputs that leave the result valid. stale: the reason, where `given` takes
    long or differs (None: by the inputs); claim: called before the start; texts: of its inputs' files, for
    the job to check, where its inputs take long to make.
    """

    study: str
    kind: JobKind
    folder_of: Callable[[Any], Path]
    given: Callable[[Any], dict[str, Any]]
    group: str = ""
    fields: Mapping[str, str] = attrs.field(factory=dict)
    hindered: Callable[[Any], str] = lambda root: ""
    needed: Sequence[str] = SOLVER
    result: str = SUMMARY
    made_of: Callable[[Any, Path], Any] = lambda content, folder: content
    beside: Sequence[str] = ()
    stale: Callable[[Any, Path], str | None] = lambda root, folder: None
    quick: Callable[[Any], bool] = lambda root: True
    claim: Callable[[Any], Any] = study_folder.assign_folder
    texts: Callable[[Any], dict[str, str]] | None = None
    _read: FileCache[tuple[Any, str]] = attrs.field(factory=FileCache, init=False)
    _before: FileCache[Study] = attrs.field(factory=FileCache, init=False)

    def inputs(self, root: Any) -> Study:
        """The study of an object in its present state; raises MuError."""
        group = getattr(root, self.group, None)
        plain = {name: getattr(group, field) for name, field in self.fields.items()}
        plain = {name: exact(value) if type(value) is float else value for name, value in plain.items()}
        return study(self.study)(**plain, **self.given(root))

    def trouble(self, root: Any) -> str:
        """Reason why it cannot be started now, or ""; quick: False where the inputs take long to make."""
        why = "" if not self.kind.is_running(root) else f"The {self.kind.title} is running"
        why = why or lacking(self.needed) or self.hindered(root)
        if why or not self.quick(root):
            return why
        try:
            self.inputs(root)
        except MuError as error:
            return in_panel(": ".join(text for text in (error.what, error.remedy) if text))
        return ""

    def start(self, root: Any) -> None:
        """Write its inputs and start it; raises MuError."""
        self.claim(root)
        self.kind.start(root, self.folder_of(root), lambda folder: self.write(root, folder))

    def write(self, root: Any, folder: Path) -> None:
        """Write its inputs into a folder; raises MuError."""
        texts = self.inputs(root).texts() if self.texts is None else self.texts(root)
        write_run(folder, study(self.study).layout(), texts)

    def label(self, root: Any, name: str) -> str:
        """Words on its button: with the seconds that it took here, or is declared to take."""
        try:
            return timed(name, self.announced(root))
        except MuError:
            return name

    def announced(self, root: Any) -> tuple[float, bool]:
        """Expected seconds, and True if every stage was measured on this machine; raises MuError."""
        return timings.announced(self.inputs(root))

    def plan(self, root: Any) -> Plan:
        """Expected stages with the seconds of each; raises MuError."""
        return timings.expected(self.inputs(root))[0]

    def child(self, root: Any) -> Any:
        """Its own child of this session, running or ended, or None."""
        child = self.kind.child(root)
        return child if child is not None and child.folder.parent == self.folder_of(root) else None

    def found(self, root: Any) -> Found | None:
        """Its result, or None; read again only when a file changes."""
        folder = self.folder_of(root)
        path = folder / self.result

        def read() -> tuple[Any, str]:
            content = file_bytes(path)
            return self.made_of(parse_json(content, path.name), folder), hashlib.sha256(content).hexdigest()

        known = self._read.read([path], read)
        return None if known is None else Found(folder, self._stale(root, folder), *known)

    def _stale(self, root: Any, folder: Path) -> str:
        """Why the result is not of the present inputs, or ""."""
        own = self.stale(root, folder)
        if own is not None:
            return own
        kind, layout = study(self.study), study(self.study).layout()
        files = [folder / name for name in (layout.inputs, *layout.optional)]
        before = self._before.read(files, lambda: kind.read(folder))
        if before is None:
            return "its inputs cannot be read"
        try:
            changed = [name for name in self.inputs(root).changed(before) if name not in self.beside]
        except MuError as error:
            return error.what
        if not changed:
            return ""
        own = "other parameters" if changed[0] in OF_UNIT else f"another {changed[0].replace('_', ' ')}"
        return f"made with {own}"
