"""Experiments put into a folder of measured data: checked by its reader first, then written completely."""

from __future__ import annotations

import csv
import io
import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import write_text
from ..reading import file_text
from .folder import FILE, read_folder
from .table import Remark

Array = np.ndarray[Any, Any]


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


def tried(block: str, file: str, text: str) -> tuple[Remark, ...]:
    """Remarks of the reader of measured data on an experiment before it is written anywhere.

    block: its [[experiment]] in TOML; file, text: its CSV file's name and content. Raises InputError.
    """
    with tempfile.TemporaryDirectory() as scratch:
        write_text(Path(scratch) / FILE, block)
        write_text(Path(scratch) / file, text)
        try:
            measured = read_folder(Path(scratch))
        except InputError as error:
            where = error.where.replace(scratch, "").lstrip("/\\")
            raise InputError(error.what, where, error.remedy) from error
    return tuple(Remark(r.what, Path(r.where.replace(scratch, "")).name, r.remedy) for r in measured.remarks)


def require_free(folder: Path, name: str, block: str, file: str) -> None:
    """Raise InputError where another experiment of the folder has this name or this file."""
    listed = folder / FILE
    if not listed.exists() or block in file_text(listed):
        return
    same = [e for e in read_folder(folder).experiments if e.name == name or e.file.name == file]
    if same:
        raise InputError(
            f"an experiment named {same[0].name!r}, in {same[0].file.name}, already exists",
            str(listed),
            "rename this experiment, or remove the other one",
        )


def add_experiment(folder: Path, name: str, block: str, file: str, text: str) -> tuple[Remark, ...]:
    """Put an experiment into a folder; return the reader's remarks.

    One with the same entry is replaced. Arguments as of `tried`. Raises InputError where another holds the
    name or the file, or the data could not be read again, and OutputError.
    """
    remarks = tried(block, file, text)
    require_free(folder, name, block, file)
    put(folder, block, file, text)
    return remarks


def put(folder: Path, block: str, file: str, text: str) -> None:
    """Write a checked experiment whose name and file are free into a folder; raises OutputError."""
    listed = folder / FILE
    before = file_text(listed) if listed.exists() else ""
    write_text(folder / file, text)
    if block not in before:
        write_text(listed, f"{before.rstrip()}\n\n{block}".lstrip())
