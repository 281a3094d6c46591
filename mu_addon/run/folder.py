"""A run's folder: its owner, and the inputs that its content was made from."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from ..errors import InputError, OutputError
from ..files import make_folder, output_error, write_text
from ..reading import file_bytes, parse_toml
from .lock import LOCK, FolderLock

if TYPE_CHECKING:
    from .context import RunContext

# What every run writes.
ALWAYS = ("summary.json", "log.ndjson")
# Folders of a run, and its lock.
OWN = ("cache", "stale", LOCK)


# A table of a file of inputs for keys that decide no result: paths of other files, number of processes.
RUN = "run"


@attrs.frozen
class FolderLayout:
    """Layout of a folder of one kind of run.

    inputs: name of its first input file; header: first line of that file, which identifies the folder;
    results: files and folders by name or pattern; optional: inputs that a run may lack; to_fill: results that
    are filled in by hand, which stay whatever the inputs become.
    """

    inputs: str
    header: str
    results: tuple[str, ...]
    optional: tuple[str, ...] = ()
    to_fill: tuple[str, ...] = ()

    def is_of(self, folder: Path) -> bool:
        """Return True if a folder is of such a run."""
        return _read(folder / self.inputs).startswith(self.header)


def begin(context: RunContext, folder: Path, layout: FolderLayout, inputs: Mapping[str, str]) -> None:
    """Make a folder a run's until it ends: locked, claimed, its log open, its inputs written.

    See `claim`. Raises InputError, also where another process works in the folder, and OutputError.
    """
    context.lock_folder(folder)
    claim(folder, layout, inputs)
    context.open_folder(folder)


def claim(folder: Path, layout: FolderLayout, inputs: Mapping[str, str]) -> None:
    """Make a folder a run's with these inputs, text by file name, and write them.

    Results of other inputs are moved to stale/, never shown as current. Inputs are compared without the table
    `RUN` of a TOML file. Raises InputError where the folder holds other files under these names or a link
    among them, and OutputError.
    """
    make_folder(folder)
    may = tuple(dict.fromkeys((*inputs, *layout.optional)))
    _refuse_links(folder, (*may, *layout.results, *ALWAYS, *OWN))
    if not layout.is_of(folder):
        # An input that is there already, to the letter, is no loss.
        kept = [name for name, text in inputs.items() if _read(folder / name) == text]
        foreign = [name for name in (*may, *layout.results) if (folder / name).exists() and name not in kept]
        if foreign:
            raise InputError(
                f"the folder contains a file of another kind of run, or an unknown file: {foreign[0]}",
                str(folder),
                "choose a new or empty folder for the results",
            )
    before = {name: _read(folder / name) for name in may if (folder / name).is_file()}
    if any(not _same(name, text, inputs.get(name)) for name, text in before.items()):
        _set_aside(folder, [n for n in (*may, *layout.results, *ALWAYS) if n not in layout.to_fill])
    keep_inputs(folder, inputs, layout.inputs)


def write_run(folder: Path, layout: FolderLayout, inputs: Mapping[str, str]) -> None:
    """Write a run's inputs into its folder, for another process to `resume` it; see `claim`.

    Raises InputError, also where another process works in the folder, and OutputError.
    """
    lock = FolderLock(folder)
    try:
        claim(folder, layout, inputs)
    finally:
        lock.release()


def same_inputs(folder: Path, inputs: Mapping[str, str]) -> bool:
    """Return True if a folder holds all of these inputs."""
    return all(
        (folder / name).is_file() and _same(name, _read(folder / name), text) for name, text in inputs.items()
    )


def _same(name: str, before: str, now: str | None) -> bool:
    """Return True if a file of inputs has the same meaning as before."""
    if now is None or before == now or not name.endswith(".toml"):
        return before == now
    return _document(before) == _document(now) is not None


def _document(text: str) -> dict[str, Any] | None:
    try:
        return {key: value for key, value in parse_toml(text, "").items() if key != RUN}
    # Thousands of nested brackets exhaust the parser's stack.
    except InputError:
        return None


def keep_inputs(folder: Path, inputs: Mapping[str, str], known_by: str = "") -> None:
    """Write a run's inputs into its folder, last the file that identifies it. Raises OutputError.

    A run that was stopped between two of them has therefore not begun, and starts again.
    """
    for name in sorted(inputs, key=lambda name: name == known_by):
        write_text(folder / name, inputs[name])


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
    """Raise InputError for a link under a name that a run writes, as it would write to a file elsewhere."""
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
    """Move an earlier run's inputs and results to stale/, replacing those set aside before."""
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
