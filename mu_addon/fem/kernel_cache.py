"""Warp's cache of compiled kernels, so that what became of it on the disk ends no run.

Warp writes it without fsync and reads it without doubt: after a power cut an entry may be cut short, and a
home may be full or read-only.
"""

from __future__ import annotations

import atexit
import re
import shutil
import sys
import tempfile
from pathlib import Path

from ..errors import InputError
from ..reading import file_bytes, parse_json

NEEDED_BYTES = 20_000_000
"""Room for the kernels of a run, several times what they take."""
# Where a process builds an entry, before it gets its name.
_BEING_BUILT = re.compile(r"_p\d+_t\d+$")


def usable_cache(cache: Path) -> Path:
    """The cache without entries that are damaged; or a copy for this process, where it cannot be written.

    The copy is removed when the process ends. Raises OSError where there is no room for it either.
    """
    damaged = [entry for entry in entries(cache) if not is_whole(entry)]
    if _writable(cache):
        for entry in damaged:
            shutil.rmtree(entry, ignore_errors=True)
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


def is_whole(entry: Path) -> bool:
    """Whether the files of an entry are as long as they say, and can be read."""
    try:
        for path in entry.iterdir():
            if path.suffix == ".meta":
                parse_json(file_bytes(path), path.name)
            elif path.suffix == ".o" and not _object_is_whole(file_bytes(path)):
                return False
    except (OSError, InputError):
        return False
    return True


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
