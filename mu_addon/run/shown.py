"""What a study shows: figures of its summary, files, warnings, the last lines of a command, its report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from ..errors import MuError
from ..files import write_bytes
from .context import RunContext
from .inputs import digest
from .parts import Fact, Fault, File, Part, Sentence, Warn, flat
from .stored import content
from .study import Section, Study


class Shown:
    """What a study has shown so far in its folder; without a folder no file is written.

    shown: its sections with their parts, for a report; lines: sentences for the end of a command; fault: an
    error that is the result. opening: called before the first file of a study that joins a folder
    (`Study.joins`).
    """

    def __init__(self, study: Study, folder: Path | None, context: RunContext) -> None:
        self.study, self.context = study, context
        self.folder: Any = folder
        self.opening: Callable[[], object] | None = None
        self.shown: list[tuple[Section, list[Part]]] = []
        self.lines: list[str] = []
        self.fault: MuError | None = None
        self._recorded: list[list[str]] = []
        self._warned: set[str] = set()
        # Digest of what each file holds: one that is shown again is not written again.
        self._written: dict[str, str] = {}

    def made(self, parts: Iterable[Part]) -> list[Part]:
        """The parts of a section, their files written."""
        found = list(parts)
        for part in flat(found):
            if isinstance(part, File) and self.folder is not None:
                self._write(part)
        return found

    def put(self, shown: list[tuple[Section, list[Part]]], failed: Iterable[str] = ()) -> None:
        """Show sections in place of those before; failed: what went wrong, told before."""
        every = [part for _, parts in shown for part in flat(parts)]
        summary = self.context.summary
        for path in self._recorded:
            _drop(summary, path)
        self._recorded = [part.key.split(".") for part in every if isinstance(part, Fact) and part.key]
        for part in every:
            if isinstance(part, Fact) and part.key:
                _put(summary, part.key.split("."), part.value)
        warned = [part for part in every if isinstance(part, Warn)]
        for one in warned:
            self.tell(one.text, one.where, one.remedy)
        texts = [*dict.fromkeys([*failed, *(one.text for one in warned if one.repeated)])]
        summary.pop("warnings", None)
        summary |= {"warnings": texts} if texts else {}
        self.fault = next((part.error for part in every if isinstance(part, Fault)), None)
        sentences = [part for part in every if isinstance(part, Sentence)]
        self.lines = [part.text for part in sentences if part.terminal]
        for part in sentences:
            if part.found and part.text not in self._warned:
                self._warned.add(part.text)
                self.context.progress.finding(part.text)
        self.shown = shown

    def tell(self, text: str, where: str = "", remedy: str = "") -> None:
        """Warn the user, once."""
        if text not in self._warned:
            self._warned.add(text)
            self.context.progress.warning(text, where, remedy)

    def open(self) -> None:
        """Begin to use the folder, if it is one that the study joins."""
        opening, self.opening = self.opening, None
        if opening is not None:
            opening()

    def _write(self, file: File) -> None:
        of = "" if file.of is None else content(file.of)
        if of and self._written.get(file.name) == of:
            return
        made = file.make(self.folder / file.name) if callable(file.make) else file.make
        self.open()
        of = of or digest(made or "")
        if made is not None and self._written.get(file.name) != of:
            write_bytes(self.folder / file.name, made.encode() if isinstance(made, str) else made)
        self._written[file.name] = of


def _drop(table: dict[str, Any], path: Sequence[str]) -> None:
    """Take a value out of nested tables, and the tables that this leaves empty."""
    name, *rest = path
    if rest and isinstance(table.get(name), dict):
        _drop(table[name], rest)
    if not rest or table.get(name) == {}:
        table.pop(name, None)


def _put(table: dict[str, Any], path: Sequence[str], value: Any) -> None:
    *levels, last = path
    for level in levels:
        table = table.setdefault(level, {})
    table[last] = value
