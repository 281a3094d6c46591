"""Files that are complete or absent: written under another name, flushed to disk, then renamed."""

from __future__ import annotations

import csv
import errno
import io
import json
import math
import os
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from .errors import OutputError

_REMEDY = {
    errno.ENOSPC: "free some space on that disk, or choose another folder",
    errno.EDQUOT: "free some of your quota, or choose another folder",
    errno.EACCES: "choose a folder you may write to, or change its permissions",
    errno.EPERM: "choose a folder you may write to, or change its permissions",
    errno.EROFS: "that disk is read-only: choose another folder",
    errno.ENOENT: "create the folder first, or correct its name",
    errno.ENOTDIR: "a part of that path is a file: choose another folder",
    errno.EEXIST: "a file of that name is in the way: remove it or choose another folder",
    errno.EISDIR: "a folder of that name is in the way: remove it or choose another name",
    errno.ENAMETOOLONG: "choose a shorter folder name",
    errno.EFBIG: "raise the limit on the size of a file, or choose another disk",
    errno.ELOOP: "a link is in the way: remove it, or choose another folder",
    errno.EIO: "the disk reports a fault: try another one",
}


def output_error(error: OSError, path: Path) -> OutputError:
    """`error`, raised while writing `path`, as an OutputError with a remedy."""
    return OutputError(
        f"cannot write {path.name}: {error.strerror or error}",
        where=str(path),
        remedy=_REMEDY.get(error.errno or 0, "check the disk and the folder"),
    )


def make_folder(path: Path) -> Path:
    """Create `path` and its missing parents; raises OutputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(error, path) from error
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Context with a temporary path of the same suffix for the body to write; it then replaces `path`.

    Missing folders are made. If the body fails, `path` stays as it was. An OSError becomes an OutputError.
    """
    beside = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        with beside.open("rb+") as stream:
            os.fsync(stream.fileno())
        beside.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise output_error(error, path) from error
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def _sync_folder(folder: Path) -> None:
    """Flush the rename itself, on systems that can open a folder."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_bytes(path: Path, data: bytes | memoryview) -> None:
    """Write `data` to `path`; raises OutputError."""
    with replacing(path) as beside:
        beside.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` as UTF-8 with \\n line ends; raises OutputError."""
    write_bytes(path, text.encode())


def write_json(path: Path, value: Any) -> None:
    """Write `value` to `path` as indented JSON, see `plain`; raises OutputError."""
    write_text(path, json_text(value))


def json_text(value: Any) -> str:
    """`value` as indented JSON, see `plain`."""
    return json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def csv_text(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A header line and `rows` as CSV, floats to their last digit."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return stream.getvalue()


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a header line and `rows` to `path`, see `csv_text`; raises OutputError."""
    write_text(path, csv_text(columns, rows))


def append_lines(stream: IO[bytes], lines: bytes) -> None:
    """Add complete lines to the end of an unbuffered file; on a full disk, those that fit.

    Raises OSError.
    """
    end, written = stream.seek(0, os.SEEK_END), 0
    try:
        # An unbuffered file may take less than it is given.
        while written < len(lines):
            written += stream.write(lines[written:]) or 0
    except OSError:
        with suppress(OSError):
            stream.truncate(end + lines.rfind(b"\n", 0, written) + 1)
        raise


# Errors that a changed byte can raise, depending on its position in the archive.
_DAMAGED = (
    OSError, ValueError, EOFError, KeyError, IndexError, RuntimeError, OverflowError, MemoryError,
    SyntaxError, TypeError, struct.error, zipfile.BadZipFile, zlib.error, tokenize.TokenError,
)  # fmt: skip


# An archive unpacks to no more than this many times its size, or to no more than this many bytes at all.
# Computed numbers shrink to a half or a third; what shrinks far more was made to fill the memory.
_MOST_SHRUNK, _SMALL = 16, 1 << 26
_MOST_UNPACKED = 1 << 32


def read_npz(path: Path, most_bytes: int = _MOST_UNPACKED) -> dict[str, Any] | None:
    """Arrays by name of an NPZ file, or None where there is none that can be read completely.

    No code in the file is run. Memory for an array is allocated only after checking that the archive holds as
    many bytes as its header claims. The limits are `most_bytes` in all and a ratio to the archive's size.
    """
    import numpy as np

    try:
        # A pipe would be waited for.
        if not path.is_file():
            return None
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
            if unpacked > min(most_bytes, _most_unpacked(path.stat().st_size)):
                return None
            for member in archive.infolist():
                _check_header(archive, member)
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except _DAMAGED:
        return None


def _most_unpacked(packed: int) -> int:
    """Largest number of bytes that an archive of `packed` bytes may unpack to."""
    return max(_SMALL, _MOST_SHRUNK * packed)


def _check_header(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> None:
    """Raise ValueError unless a member is one array, of plain numbers or text, of exactly its size."""
    import numpy as np

    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        if version != (1, 0):
            raise ValueError("a header that is never written here")
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
        if dtype.hasobject or math.prod(shape) * dtype.itemsize != member.file_size - stream.tell():
            raise ValueError("the header claims more than the archive holds")


def write_npz(path: Path, arrays: Mapping[str, Any], packed: bool = True) -> None:
    """Write named `arrays` to `path`; equal arrays make equal bytes; raises OutputError.

    packed: compress them, unless so strongly that `read_npz` would refuse them. Not for files that a window
    reads: unpacking is slow.
    """
    import numpy as np

    # Packed in memory: on a full disk an archive fails again when it is deleted, with a traceback.
    archive = io.BytesIO()
    if packed:
        np.savez_compressed(archive, **arrays)
    if sum(np.asarray(array).nbytes for array in arrays.values()) > _most_unpacked(archive.tell()) // 2:
        # Long rows of equal numbers: `read_npz` would take it for one that was made to fill the memory.
        packed = False
    if not packed:
        archive = io.BytesIO()
        np.savez(archive, **arrays)
    write_bytes(path, archive.getbuffer())


def plain(value: Any) -> Any:
    """`value` as JSON types: arrays as lists, numpy numbers as numbers, paths as text, nan as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str | int) or value is None:
        return value
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no JSON form")
