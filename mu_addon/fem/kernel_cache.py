"""Warp's cache of compiled kernels, protected so that damage on the disk ends no run.

Warp writes it without fsync and reads it without a check. A power cut may truncate an entry, a disk may
corrupt it, and a home folder may be full or read-only. Code with one wrong bit ends the process or computes
wrong values, so every entry gets the digests of its files.
"""

from __future__ import annotations

import atexit
import hashlib
import re
import shutil
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from ..errors import InputError, OutputError
from ..files import write_json
from ..reading import file_bytes, parse_json

NEEDED_BYTES = 20_000_000
"""Free disk space required for the kernels of a run, several times their size."""
_SEAL = "sha256.json"
"""File of an entry that holds the SHA-256 of each other one, by name."""
# Where a process builds an entry, before renaming it.
_BEING_BUILT = re.compile(r"_p\d+_t\d+$")


def usable_cache(cache: Path) -> Path:
    """Return the cache without damaged entries, or a copy for this process if it cannot be written.

    The copy is removed when the process ends. Raises OSError if that has no room either. In a writable cache
    every entry is sealed: existing ones at once, entries of this process at its end.
    """
    damaged = [entry for entry in entries(cache) if not is_whole(entry)]
    if _writable(cache):
        for entry in damaged:
            shutil.rmtree(entry, ignore_errors=True)
        seal(cache)
        atexit.register(seal, cache)
        return cache
    own = own_cache()
    for entry in entries(cache):
        if entry not in damaged:
            shutil.copytree(entry, own / entry.name)
    return own


def own_cache() -> Path:
    """Make a folder for this process alone, removed when it ends; raises OSError."""
    own = Path(tempfile.mkdtemp(prefix="mu-kernels-"))
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return own


def entries(cache: Path) -> list[Path]:
    """Folders of a cache's entries, each with a module's kernels."""
    if not cache.is_dir():
        return []
    found = [path for path in cache.glob("wp_*") if path.is_dir()]
    return [path for path in found if not _BEING_BUILT.search(path.name)]


def seal(cache: Path) -> None:
    """Write the digests of an entry's files into its folder, if it has files without one.

    Existing digests are kept: they are of the files as first written.
    """
    for entry in entries(cache):
        with suppress(OSError, InputError, OutputError):
            sealed = _sealed(entry)
            found = {
                path.name: _digest(file_bytes(path)) for path in _files(entry) if path.name not in sealed
            }
            # Another process that builds the same removes the whole entry first.
            if found and entry.is_dir():
                write_json(entry / _SEAL, sealed | found)


def is_whole(entry: Path) -> bool:
    """Return True if an entry's files can be read, have their stated length and match their digests."""
    try:
        sealed = _sealed(entry)
        contents = {path.name: file_bytes(path) for path in _files(entry)}
        for name, content in contents.items():
            if name.endswith(".meta"):
                parse_json(content, name)
            elif name.endswith(".o") and not _object_is_whole(content):
                return False
        return all(name in contents and _digest(contents[name]) == sealed[name] for name in sealed)
    except (OSError, InputError):
        return False


def _files(entry: Path) -> list[Path]:
    """Files that Warp wrote into an entry; one whose name begins with a dot is a seal being written."""
    return [path for path in entry.iterdir() if path.name != _SEAL and not path.name.startswith(".")]


def _sealed(entry: Path) -> dict[str, object]:
    """Digests by the names of an entry's files, none if it is not sealed; raises OSError, InputError."""
    try:
        content = file_bytes(entry / _SEAL)
    except FileNotFoundError:
        return {}
    sealed = parse_json(content, _SEAL)
    if not isinstance(sealed, dict):
        raise InputError("these are not digests", _SEAL, "remove the folder that it lies in")
    return sealed


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _object_is_whole(content: bytes) -> bool:
    """Return True if an ELF file is complete up to its table of sections, or any other file is not empty."""
    if content[:4] != b"\x7fELF":
        return sys.platform != "linux" and bool(content.strip(b"\0"))
    begin, size, count = (int.from_bytes(content[a:b], "little") for a, b in ((40, 48), (58, 60), (60, 62)))
    return 0 < begin <= len(content) - size * count


def _writable(cache: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=cache):
            return shutil.disk_usage(cache).free >= NEEDED_BYTES
    except OSError:
        return False
