"""A run's inputs read back from its folder: TOML with every key and type checked."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from ..errors import InputError
from ..toml_reader import TomlTable, read_toml
from .folder import RUN

FORMAT = 1


def digest(content: str | bytes) -> str:
    """SHA-256 of a file's content, in hexadecimal."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


INPUTS = "inputs", "choose another folder"
"""What such a file is, and what to do where it cannot be read."""


def read_inputs(
    path: Path, words: Sequence[str] = INPUTS, version: int = FORMAT
) -> tuple[TomlTable, dict[str, Any]]:
    """Inputs of a file, and its table `[run]` of keys that decide no result. Raises InputError.

    words: what the file is, and what to do where it cannot be read; version: the format's number.
    """
    document = read_toml(path, *words)
    found = document.values.get("format")
    newer = isinstance(found, int) and not isinstance(found, bool) and found > version
    remedy = "use the newer version that wrote it" if newer else "start it again in another folder"
    document.of_format(version, remedy)
    keys = {key: value for key, value in document.values.items() if key not in ("format", RUN)}
    return attrs.evolve(document, values=keys), dict(document.inner(RUN).values)


def named_path(path: Path, run: Mapping[str, Any], key: str, what: str) -> Path:
    """Path of a file or folder that a run reads and does not keep, by its file of inputs.

    Raises InputError where that does not name it, or where it no longer exists.
    """
    named = run.get(key)
    if not isinstance(named, str):
        raise InputError(
            f"{path.name} does not name the place of the {what}",
            f"{path}, [{RUN}] {key}",
            "start the run by its own command, with this folder as --out: finished stages are kept",
        )
    found = Path(named)
    if not found.exists():
        raise InputError(
            f"the {what} is not where it was", named, f"restore it, or correct {path}, [{RUN}] {key}"
        )
    return found


def require_digest(path: Path, content: bytes, sha256: Any, what: str) -> None:
    """Raise InputError if a file is not the one that a run was made with."""
    if digest(content) != sha256:
        raise InputError(
            f"the {what} has changed since the run was made",
            str(path),
            "restore it, or use a separate folder for this one",
        )
