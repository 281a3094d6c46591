"""Runs of an evaluation, each in a folder named by the hash of its inputs."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

import attrs

from ..errors import MuError
from ..files import make_folder
from ..graph.evaluation import Finished, Order
from ..graph.records import FOLDER
from ..run.context import run_to_end
from ..run.folder import same_inputs
from ..run.progress import Message, Progress, Sink
from ..run.summary import SUMMARY, read_summary
from ..studies.starting import start

CACHE = "cache"
# Exit statuses of a run that was asked to stop.
_STOPPED = (130, 143)


@attrs.define
class FolderRuns:
    """Runs in a folder, started if they are not finished; a killed one is resumed.

    progress: gets the stages of each, by node; reports: write a report for each.
    """

    folder: Path
    progress: Progress = attrs.field(factory=Progress)
    reports: bool = False

    def place(self, order: Order) -> Path:
        """Folder of a run."""
        return self.folder / FOLDER / f"{order.study.command}-{order.key[:16]}"

    def find(self, order: Order) -> Finished | None:
        """Find the run in its folder, complete and with the same inputs."""
        place = self.place(order)
        summary = read_summary(place / SUMMARY)
        if not order.is_done(summary) or not order.study.layout().is_of(place):
            return None
        found = Finished(place, summary, order.study)
        return found if same_inputs(place, order.study.texts()) else None

    def start(self, node: str, order: Order) -> Finished:
        """Run it to its end; raises its MuError, and Stopped when the whole evaluation is to stop."""
        errors: list[Message] = []
        inner = Progress([_of_node(node, self.progress, errors)])
        place = self.place(order)
        if order.after is not None:
            _take_up(order.after / CACHE, place / CACHE)
        with run_to_end(inner) as context, inner.beating():
            context.wants_report = self.reports
            start(order.study, place, context)
        summary = read_summary(place / SUMMARY)
        stopped = context.status in _STOPPED
        if context.status and (stopped or not order.is_done(summary)):
            message = errors[-1] if errors else {}
            found = MuError(
                str(message.get("what", "the run failed")),
                str(message.get("where", "")) or str(place),
                str(message.get("what_to_do", "")),
            )
            found.status = context.status
            if stopped:
                raise Stopped(found)
            raise found
        return Finished(place, summary, order.study)


class Stopped(Exception):
    """The evaluation was asked to stop; `error` says how."""

    def __init__(self, error: MuError) -> None:
        super().__init__(str(error))
        self.error = error


def _take_up(before: Path, now: Path) -> None:
    """Copy the finished work of one run, files named by the hash of their inputs, into another's cache."""
    with suppress(OSError):
        for path in before.glob("*.npz"):
            make_folder(now)
            if not (now / path.name).exists():
                shutil.copyfile(path, now / f".{path.name}.part")
                (now / f".{path.name}.part").replace(now / path.name)


def _of_node(node: str, progress: Progress, errors: list[Message]) -> Sink:
    """A sink that passes on a run's stages and warnings under the node's name, and keeps its errors."""

    def sink(message: Message) -> None:
        if message["type"] == "error":
            errors.append(message)
        elif message["type"] == "progress":
            progress.part(node, message)
        elif message["type"] == "warning":
            progress.emit({**message, "what": f"{node}: {message['what']}"})

    return sink
