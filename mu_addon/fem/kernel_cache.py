"""Warp's cache of compiled kernels, so that what became of it on the disk ends no run.

Warp writes it without fsync and reads it without doubt: after a power cut an entry may be cut short, a disk
may return other bits than it was given, and a home may be full or read-only. Code of which one bit is wrong
ends the process, or computes something else, so every entry is given the digests of its files.
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
"""Room for the kernels of a run, several times what they take."""
_SEAL = "sha256.json"
"""File of an entry that holds the SHA-256 of each other one, by name."""
# Where a process builds an entry, before it gets its name.
_BEING_BUILT = re.compile(r"_p\d+_t\d+$")


def usable_cache(cache: Path) -> Path:
    """The cache without entries that are damaged; or a copy for this process, where it cannot be written.

    The copy is removed when the process ends. Raises OSError where there is no room for it either. Of a cache
    that can be written every entry is sealed: at once, and what this process adds when it ends.
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
    """A folder for this process alone, removed when it ends; raises OSError."""
    own = Path(tempfile.mkdtemp(prefix="mu-kernels-"))
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return own


def entries(cache: Path) -> list[Path]:
    """The folders of a cache's entries, a module's kernels each."""
    if not cache.is_dir():
        return []
    found = [path for path in cache.glob("wp_*") if path.is_dir()]
    return [path for path in found if not _BEING_BUILT.search(path.name)]


def seal(cache: Path) -> None:
    """Write the digests of an entry's files beside them, of every entry that has files without one.

    What has a digest keeps it: it is what the file held when it was new.
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
    """Whether the files of an entry can be read, are as long as they say and hold what was sealed."""
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
    """What Warp wrote into an entry; a file whose name begins with a dot is a seal being written."""
    return [path for path in entry.iterdir() if path.name != _SEAL and not path.name.startswith(".")]


def _sealed(entry: Path) -> dict[str, object]:
    """Digests by the names of an entry's files, none if it is not sealed; raises OSError, InputError."""
    try:
        content = file_bytes(entry / _SEAL)
    except FileNotFoundError:
        return {}
    sealed = parse_json(content, _SEAL)
    if not isinstance(sealed, dict):
        raise InputError("these are no digests", _SEAL, "remove the folder that it lies in")
    return sealed


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _object_is_whole(content: bytes) -> bool:
    """Whether an object file of ELF holds its table of sections, its end; any other must not be empty."""
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
