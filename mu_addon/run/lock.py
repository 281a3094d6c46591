"""A lock of a folder for one process, released by the system when its holder ends, however it ends."""

from __future__ import annotations

import errno
import json
import os
import socket
import sys
import time
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import make_folder, output_error
from .supervisor import watcher

LOCK = "run.lock"
# Locked far behind the text, since on Windows nobody else may read what is locked.
_BYTE = 1 << 20


class InUseError(InputError):
    """A folder that another process works in."""


class FolderLock:
    """The lock of one folder, held from its creation until `release`, or until this process ends.

    `held` is False where the file system offers no locks. A lock of the system (flock; LockFile on Windows)
    dies with its holder, so that none is ever left behind, independent of clocks and process numbers. The
    file itself stays: removing it could let two processes lock different files.
    """

    def __init__(self, folder: Path) -> None:
        """Lock `folder`; raises InUseError that names the process holding it, and OutputError."""
        self.path = make_folder(folder) / LOCK
        # A link would lead to another user's file.
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
        try:
            self._handle = os.open(self.path, flags, 0o644)
        except OSError as error:
            raise output_error(error, self.path) from error
        try:
            self.held = _lock(self._handle)
        except BlockingIOError:
            owner = _owner(_signature(self._handle))
            os.close(self._handle)
            self._handle = -1
            raise InUseError(
                f"another run uses this folder: {owner}",
                str(folder),
                "wait for it, stop it, or choose another folder",
            ) from None
        try:
            self._sign()
        except OSError as error:
            self.release()
            raise output_error(error, self.path) from error

    def release(self) -> None:
        """Release the folder; no effect the second time."""
        if self._handle >= 0:
            # Closing unlocks, on every system.
            os.close(self._handle)
            self._handle = -1

    def __del__(self) -> None:
        if getattr(self, "_handle", -1) >= 0:
            self.release()

    def _sign(self) -> None:
        mine = {
            "process": os.getpid(),
            # Its watcher receives a request to stop even while a library keeps this process busy.
            "watcher": watcher(),
            "machine": socket.gethostname(),
            "since": time.strftime("%Y-%m-%d %H:%M:%S"),
        }
        os.ftruncate(self._handle, 0)
        os.lseek(self._handle, 0, os.SEEK_SET)
        os.write(self._handle, (json.dumps(mine) + "\n").encode())


def holder(folder: Path) -> int | None:
    """Number of the process of this machine that works in a folder, or None for none or another machine's.

    For a watched process it is the number of its watcher, which receives requests to stop. 0 until the number
    is written. None where the file system offers no locks.
    """
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    try:
        handle = os.open(folder / LOCK, flags)
    except OSError:
        return None
    try:
        _lock(handle)
    except BlockingIOError:
        found = _signature(handle)
        if found.get("machine", socket.gethostname()) != socket.gethostname():
            return None
        number = found.get("watcher", found.get("process"))
        return number if isinstance(number, int) and number > 0 else 0
    else:
        return None
    finally:
        os.close(handle)


def _signature(handle: int) -> dict[str, Any]:
    """Signature of a lock's holder; empty before it has signed."""
    try:
        os.lseek(handle, 0, os.SEEK_SET)
        signed: Any = json.loads(os.read(handle, 1000))
    except (OSError, ValueError, RecursionError):
        return {}
    return signed if isinstance(signed, dict) else {}


def _owner(signed: dict[str, Any]) -> str:
    """Holder of a lock by its signature, in words."""
    try:
        number = signed.get("watcher", signed["process"])
        return f"process {number:d} on {signed['machine']!s:.80}, since {signed['since']!s:.80}"
    except (ValueError, KeyError, TypeError):
        # It has the lock and has not signed yet.
        return "it has just started"


if sys.platform == "win32":
    import msvcrt

    def _lock(handle: int) -> bool:
        os.lseek(handle, _BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if error.errno in (errno.EACCES, errno.EDEADLK):
                raise BlockingIOError from None
            return False
        return True

else:
    import fcntl

    def _lock(handle: int) -> bool:
        try:
            # Not lockf: that lock would be lost as soon as this process closed the file anywhere else.
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError as error:
            if error.errno == errno.EACCES:
                raise BlockingIOError from None
            return False
        return True
