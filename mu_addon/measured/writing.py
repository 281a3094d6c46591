"""Experiments put into a folder of measured data: checked by its reader first, then written completely."""

from __future__ import annotations

import csv
import io
import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..files import write_text
from ..reading import file_text
from ..run.parts import File
from .folder import FILE, read_folder
from .table import Remark


def file_stem(name: str) -> str:
    """Name of an experiment as the name of its file, without the ending."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "experiment"


def csv_text(columns: Mapping[str, Array], shown: Callable[[float], str] = "{:.10g}".format) -> str:
    """CSV text of columns (n,), empty where a value is missing; shown: text of a number."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow(["" if np.isnan(v) else shown(v) for v in row])
    return stream.getvalue()


@attrs.frozen
class Entry:
    """An experiment to be put into a folder: its [[experiment]] in TOML, its CSV file's name and content."""

    name: str
    block: str
    file: str
    text: str

    def tried(self) -> tuple[Remark, ...]:
        """Remarks of the reader of measured data, before anything is written; raises its InputError."""
        with tempfile.TemporaryDirectory() as scratch:
            write_text(Path(scratch) / FILE, self.block)
            write_text(Path(scratch) / self.file, self.text)
            try:
                measured = read_folder(Path(scratch))
            except InputError as error:
                where = error.where.replace(scratch, "").lstrip("/\\")
                raise InputError(error.what, where, error.remedy) from error
        return tuple(
            Remark(r.what, Path(r.where.replace(scratch, "")).name, r.remedy) for r in measured.remarks
        )


def added(entries: Sequence[Entry]) -> list[File]:
    """Parts that put experiments into a run's folder of measured data, beside those that it has.

    One with the same entry is replaced. Writing raises InputError where another holds a name or a file.
    """

    def table(path: Path, entry: Entry) -> str:
        # Before the first of them is written.
        if entry is entries[0]:
            _require_free(path.parent, entries)
        return entry.text

    def listed(path: Path) -> str:
        text = file_text(path) if path.exists() else ""
        for entry in entries:
            text = text if entry.block in text else f"{text.rstrip()}\n\n{entry.block}".lstrip()
        return text

    return [*(File(one.file, partial(table, entry=one)) for one in entries), File(FILE, listed)]


def _require_free(folder: Path, entries: Sequence[Entry]) -> None:
    """Raise InputError where another experiment of the folder has the name or the file of one of these."""
    listed = folder / FILE
    text = file_text(listed) if listed.exists() else None
    new = [one for one in entries if text is not None and one.block not in text]
    for other in read_folder(folder).experiments if new else ():
        if any(other.name == one.name or other.file.name == one.file for one in new):
            raise InputError(
                f"an experiment named {other.name!r}, in {other.file.name}, already exists",
                str(listed),
                "rename this experiment, or remove the other one",
            )
