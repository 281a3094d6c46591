"""A file system whose n-th call fails: every place of a run where a disk can fail, one after the other.

Calls are those of Python's own that change files under one folder: mkdir, open for writing, write, truncate,
posix_fallocate, fsync and rename. What a library writes by its own means (gmsh's STEP) is not among them, nor
is a mapped file.
"""

from __future__ import annotations

import builtins
import errno
import io
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

# What each call in turn fails with, by its number.
ERRORS = (errno.ENOSPC, errno.EIO, errno.EACCES)
_CHANGES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class FailingFiles:
    """The calls that changed files under `folder`, and which of them fails.

    at: number of the call that fails, from 1 on, or 0 for none; for_good: whether all after it fail, too.
    calls: words for each, such as "fsync summary.json". failed: how many calls were made to fail.
    """

    def __init__(self, folder: Path, at: int = 0, for_good: bool = False) -> None:
        self.folder, self.at, self.for_good = os.path.realpath(folder), at, for_good
        self.calls: list[str] = []
        self.failed = 0
        self.names: dict[int, str] = {}
        self.full: set[int] = set()
        self._lock = threading.Lock()

    @property
    def places(self) -> int:
        """How many calls there were."""
        return len(self.calls)

    @property
    def where(self) -> str:
        """The first call that failed, in words."""
        return self.calls[self.at - 1]

    def concerns(self, path: Any) -> bool:
        """Whether a path, or the file of a number, lies in the folder."""
        if isinstance(path, int):
            return path in self.names
        found = os.path.realpath(os.fsdecode(path))
        return found == self.folder or found.startswith(self.folder + os.sep)

    def call(self, kind: str, path: Any) -> None:
        """Count a call; raises the OSError of one that fails."""
        if (number := self.fails(kind, path)) is not None:
            raise OSError(number, os.strerror(number), self._name(path))

    def fails(self, kind: str, path: Any) -> int | None:
        """Count a call; the number of its error, or None where it works."""
        with self._lock:
            self.calls.append(f"{kind} {Path(self._name(path)).name}")
            n = len(self.calls)
            if not self.at or not (n == self.at or (self.for_good and n > self.at)):
                return None
            number = ERRORS[self.at % len(ERRORS)]
            if kind == "truncate" and number == errno.ENOSPC:
                # It needs no room.
                return None
            self.failed += 1
            return number

    def write(self, handle: int, data: Any, write: Any) -> int:
        """Count a write; on a full disk the first half still finds room, and the next call says so."""
        if handle in self.full:
            self.full.discard(handle)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        number = self.fails("write", handle)
        if number == errno.ENOSPC and len(data) > 1:
            self.full.add(handle)
            return write(memoryview(data).cast("B")[: len(data) // 2])
        if number is not None:
            raise OSError(number, os.strerror(number))
        return write(data)

    def forget(self, handle: int) -> None:
        """A file was closed: its number may be another's next."""
        self.names.pop(handle, None)
        self.full.discard(handle)

    def _name(self, path: Any) -> str:
        return self.names.get(path, "?") if isinstance(path, int) else os.fsdecode(path)


@contextmanager
def failing(folder: Path, at: int = 0, for_good: bool = False) -> Iterator[FailingFiles]:
    """While the body runs, the `at`-th call that changes files under `folder` fails; see FailingFiles."""
    files = FailingFiles(folder, at, for_good)
    real = {name: getattr(os, name) for name in ("open", "close", "write", "ftruncate", "fsync", "mkdir")}
    if hasattr(os, "posix_fallocate"):
        real["posix_fallocate"] = os.posix_fallocate
    real_open = io.open

    class Raw(io.FileIO):
        """An unbuffered file of the folder."""

        def __init__(self, path: Any, mode: str) -> None:
            super().__init__(path, mode)
            files.names[self.fileno()] = os.fsdecode(path)

        def write(self, data: Any) -> int:
            return files.write(self.fileno(), data, super().write)

        def truncate(self, size: int | None = None) -> int:
            files.call("truncate", self.fileno())
            return super().truncate(size)

        def close(self) -> None:
            if not self.closed:
                files.forget(self.fileno())
            super().close()

    def open_(
        file: Any, mode: str = "r", buffering: int = -1, encoding: Any = None, errors: Any = None,
        newline: Any = None, closefd: bool = True, opener: Any = None,
    ) -> Any:  # fmt: skip
        if isinstance(file, int) or not set(mode) & set("wax+") or not files.concerns(file):
            return real_open(file, mode, buffering, encoding, errors, newline, closefd, opener)
        files.call("open", file)
        raw = Raw(file, mode.replace("b", "").replace("t", ""))
        if buffering == 0:
            return raw
        stream = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return (
            stream if "b" in mode else io.TextIOWrapper(stream, io.text_encoding(encoding), errors, newline)
        )

    def os_open(path: Any, flags: int, *rest: Any, **options: Any) -> int:
        ours = options.get("dir_fd") is None and files.concerns(path)
        if ours and flags & _CHANGES:
            files.call("open", path)
        handle = real["open"](path, flags, *rest, **options)
        if ours:
            files.names[handle] = os.fsdecode(path)
        return handle

    def close(handle: int) -> None:
        files.forget(handle)
        real["close"](handle)

    def write(handle: int, data: Any) -> int:
        if not files.concerns(handle):
            return real["write"](handle, data)
        return files.write(handle, data, lambda part: real["write"](handle, part))

    def counted(name: str, kind: str) -> Any:
        def call(path: Any, *rest: Any, **options: Any) -> Any:
            if files.concerns(path):
                files.call(kind, path)
            return real[name](path, *rest, **options)

        return call

    def renaming(original: Any) -> Any:
        def rename(source: Any, target: Any, **options: Any) -> None:
            if files.concerns(target):
                files.call("rename", target)
            original(source, target, **options)

        return rename

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(io, "open", open_)
        patch.setattr(builtins, "open", open_)
        patch.setattr(os, "open", os_open)
        patch.setattr(os, "close", close)
        patch.setattr(os, "write", write)
        for name in ("ftruncate", "posix_fallocate", "fsync", "mkdir"):
            if name in real:
                patch.setattr(
                    os, name, counted(name, name.removeprefix("f") if name == "ftruncate" else name)
                )
        for name in ("rename", "replace"):
            patch.setattr(os, name, renaming(getattr(os, name)))
        yield files
