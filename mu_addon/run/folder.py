"""A run's folder: its owner, and whether its content belongs to these inputs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, OutputError
from ..files import make_folder, output_error, write_text
from ..reading import file_bytes
from .lock import LOCK

if TYPE_CHECKING:
    from .context import RunContext

# What every run writes.
ALWAYS = ("summary.json", "log.ndjson")
# Folders of a run, and its lock.
OWN = ("cache", "stale", LOCK)


def begin(
    context: RunContext,
    folder: Path,
    header: str,
    inputs: Mapping[str, str],
    results: Iterable[str],
    optional: Iterable[str] = (),
) -> None:
    """Make a folder that of a run, alone in it until it ends: locked, claimed, its log open, its inputs kept.

    See `claim`. Raises InputError, also where another process works in the folder, and OutputError.
    """
    context.lock_folder(folder)
    claim(folder, header, inputs, results, optional)
    context.open_folder(folder)
    keep_inputs(folder, inputs)


def claim(
    folder: Path, header: str, inputs: Mapping[str, str], results: Iterable[str], optional: Iterable[str] = ()
) -> None:
    """Make a folder that of a run with these inputs, text by file name; the first begins with `header`.

    Results of other inputs, files and folders by name or pattern, are moved to stale/, never shown as
    current. optional: inputs that a run may do without. Raises InputError where the folder holds somebody
    else's files under these names or a link among them, and OutputError.
    """
    make_folder(folder)
    names, results = list(inputs), list(results)
    may = list(dict.fromkeys((*names, *optional)))
    _refuse_links(folder, (*may, *results, *ALWAYS, *OWN))
    if not _read(folder / names[0]).startswith(header):
        # An input that is there already, to the letter, is no loss.
        kept = [name for name, text in inputs.items() if _read(folder / name) == text]
        foreign = [name for name in (*may, *results) if (folder / name).exists() and name not in kept]
        if foreign:
            raise InputError(
                f"the folder contains a file of another kind of run, or an unknown file: {foreign[0]}",
                str(folder),
                "choose a new or empty folder for the results",
            )
    if any((folder / name).is_file() and _read(folder / name) != inputs.get(name) for name in may):
        _set_aside(folder, (*may, *results, *ALWAYS))


def keep_inputs(folder: Path, inputs: Mapping[str, str]) -> None:
    """Write a run's inputs into its folder. Raises OutputError."""
    for name, text in inputs.items():
        write_text(folder / name, text)


def require_space(folder: Path, needed: int) -> None:
    """Raise OutputError where the disk of an existing `folder` has less than `needed` bytes left."""
    try:
        free = shutil.disk_usage(folder).free
    except OSError:
        # A disk that cannot tell is not known to be full; writing will show.
        return
    if free < needed:
        raise OutputError(
            f"the disk has too little free space: the run writes up to {_size(needed)}, and "
            f"{_size(free)} are free",
            str(folder),
            "free some space on that disk, or choose another folder",
        )


def _size(count: int) -> str:
    return f"{count / 1e6:.0f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"


def _refuse_links(folder: Path, patterns: Iterable[str]) -> None:
    """A link under a name that a run writes would send its words into a file elsewhere."""
    for pattern in patterns:
        for path in [folder / pattern, *folder.glob(pattern)]:
            if path.exists() and not path.is_file() and not path.is_dir():
                raise InputError(
                    f"{path.name} in the folder is a pipe or a device",
                    str(path),
                    "remove it, or choose another folder for the results",
                )
            if path.is_symlink() or (hasattr(os.path, "isjunction") and os.path.isjunction(path)):
                raise InputError(
                    f"{path.name} in the folder is a link to another location",
                    str(path),
                    "remove the link, or choose another folder for the results",
                )


def _read(path: Path) -> str:
    try:
        return file_bytes(path).decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except (OSError, UnicodeDecodeError):
        return ""


def _set_aside(folder: Path, patterns: Iterable[str]) -> None:
    """Move an earlier run's inputs and results to stale/, in place of what was set aside before."""
    stale = folder / "stale"
    try:
        if stale.is_dir():
            shutil.rmtree(stale)
        stale.mkdir()
        for pattern in patterns:
            for path in folder.glob(pattern):
                path.replace(stale / path.name)
    except OSError as error:
        raise output_error(error, stale) from error
