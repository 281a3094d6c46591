"""A run's folder: whose it is, and whether what lies in it belongs to these inputs."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from ..errors import InputError
from ..files import make_folder, output_error, write_text

# What every run writes.
ALWAYS = ("summary.json", "log.ndjson")


def claim(
    folder: Path, header: str, inputs: Mapping[str, str], results: Iterable[str], optional: Iterable[str] = ()
) -> None:
    """Make a folder that of a run with these inputs, text by file name; the first begins with `header`.

    Results of other inputs, files and folders by name or pattern, are moved to stale/, never shown as
    current. optional: inputs that a run may do without. Raises InputError where the folder holds somebody
    else's files under these names, and OutputError.
    """
    make_folder(folder)
    names, results = list(inputs), list(results)
    may = list(dict.fromkeys((*names, *optional)))
    if not _read(folder / names[0]).startswith(header):
        # An input that is there already, to the letter, is no loss.
        kept = [name for name, text in inputs.items() if _read(folder / name) == text]
        foreign = [name for name in (*may, *results) if (folder / name).exists() and name not in kept]
        if foreign:
            raise InputError(
                f"the folder holds a file of another kind of run, or somebody else's: {foreign[0]}",
                str(folder),
                "choose a new or empty folder for the results",
            )
    if any((folder / name).is_file() and _read(folder / name) != inputs.get(name) for name in may):
        _set_aside(folder, (*may, *results, *ALWAYS))


def keep_inputs(folder: Path, inputs: Mapping[str, str]) -> None:
    """Write a run's inputs into its folder. Raises OutputError."""
    for name, text in inputs.items():
        write_text(folder / name, text)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
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
