"""Files, TOML and JSON from anywhere, read so that any content ends in a clear error.

Every reader of the program takes its text, TOML and JSON from here: a pipe or a device does not hang it, and
endless brackets or digits do not exhaust it. Tables, keys and values of TOML are judged by `toml_reader`.
"""

from __future__ import annotations

import csv
import errno
import json
import math
import os
import re
import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .errors import InputError

# No file of text that is read here is longer, in bytes, and no table has more rows. What is made of a text
# takes up to some thirty times its length in memory, which these limits keep below 2 GB.
_LONGEST, MOST_ROWS = 1 << 26, 1_000_000
# No document is longer, in characters: far more than any that the program writes. What is made of TOML
# takes up to a hundred times its length in memory, of JSON a quarter of that.
_LONGEST_TOML, _LONGEST_JSON = 1 << 22, 1 << 24
# No table of this program lies deeper in others, and no whole number is larger (TOML's own are of 64 bits).
_DEEPEST, _LARGEST = 64, 1 << 63
# The parser takes time by the square of a dotted key's length.
_DOTTED = re.compile(r"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){65}""")

# A long field is not a fault of its own: what reads the table says what is wrong with it.
csv.field_size_limit(_LONGEST)


def file_bytes(path: str | Path, most: int = _LONGEST) -> bytes:
    """Content of a regular file; raises OSError, also for pipes and devices and beyond `most` bytes."""
    require_readable(path, most)
    with open(path, "rb", opener=_without_waiting) as stream:
        # Another file may have taken its place by now; the system's own are said to hold nothing.
        found = os.fstat(stream.fileno())
        size = found.st_size
        data = stream.read(min(size, most) + 1) if stat.S_ISREG(found.st_mode) else None
        if data is None:
            raise OSError(errno.EINVAL, "that is not a regular file", str(path))
        if len(data) > size:
            parts = [data]
            while sum(map(len, parts)) <= most and (more := stream.read(1 << 20)):
                parts.append(more)
            data = b"".join(parts)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it holds more than the {_size(most)} that are read", str(path))
    return data


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def require_readable(path: str | Path, most: int = _LONGEST) -> None:
    """Raise OSError for anything but a regular file, and for one of more than `most` bytes."""
    path = Path(path)
    try:
        found = path.stat()
    except ValueError as error:
        # A NUL byte in the name.
        raise OSError(errno.EINVAL, f"that is not a file name: {error}", repr(str(path))) from None
    if not stat.S_ISREG(found.st_mode):
        if stat.S_ISDIR(found.st_mode):
            raise IsADirectoryError(errno.EISDIR, "that is a folder", str(path))
        raise OSError(errno.EINVAL, "that is not a regular file", str(path))
    if found.st_size > most:
        words = f"its {_size(found.st_size)} are more than the {_size(most)} that are read"
        raise OSError(errno.EFBIG, words, str(path))


def file_text(path: str | Path, most: int = _LONGEST) -> str:
    """The text of a regular file of UTF-8, line ends as \\n; raises OSError and UnicodeDecodeError."""
    return file_bytes(path, most).decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")


def text_in(
    path: str | Path,
    what: str,
    remedy: str,
    most: int = _LONGEST,
    read: Callable[[Any, int], str] = file_text,
) -> str:
    """The text of a file that a user or a run names, as `read` gives it; raises InputError.

    what, remedy: of a file that cannot be read.
    """
    try:
        return read(path, most)
    except UnicodeDecodeError as error:
        raise InputError("the file is not UTF-8 text", str(path), f"save it as UTF-8, or {remedy}") from error
    except OSError as error:
        raise InputError(f"cannot read the {what}: {unreadable(error)}", str(path), remedy) from error


def _size(count: int) -> str:
    return f"{count / 1e6:.0f} MB" if count >= 1e7 else f"{count / 1e3:.0f} kB"


def require_rows(count: int, where: str) -> None:
    """Raise InputError for a table of `count` rows if that exceeds the limit."""
    if count > MOST_ROWS:
        raise InputError(
            f"the table has more than the {MOST_ROWS} rows that are read",
            where,
            "leave out rows, or divide it into several files",
        )


def _require_length(text: str | bytes, most: int, origin: str, remedy: str) -> None:
    """Raise InputError for a document that would exhaust the memory when parsed."""
    if len(text) > most:
        words = f"its {_size(len(text))} are more than the {_size(most)} that are read"
        raise InputError(words, origin, remedy)


def unreadable(error: OSError | UnicodeDecodeError) -> str:
    """Reason why a file could not be read as text, without its name."""
    return str(error.strerror or error) if isinstance(error, OSError) else "it is not UTF-8 text"


def parse_toml(text: str, origin: str, remedy: str = "correct that line") -> dict[str, Any]:
    """Tables and values of TOML text; raises InputError, with the line if known."""
    _require_length(text, _LONGEST_TOML, origin or "TOML text", "check that it is the right file")
    if _DOTTED.search(text):
        raise InputError(f"tables are nested more than {_DEEPEST} deep", origin or "TOML text", remedy)
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, line = _located(str(error), text)
        where = f"{origin}, line {line}" if line and origin else origin or f"line {line}" if line else origin
        raise InputError(f"this is not TOML: {what}", where or "TOML text", remedy) from error
    # Brackets that exhaust the parser's stack, whole numbers of thousands of digits.
    except (RecursionError, ValueError, OverflowError) as error:
        raise InputError(f"this is not TOML: {_short(error)}", origin or "TOML text", remedy) from error
    _require_sense(document, text, origin or "TOML text", remedy)
    return document


def parse_json(text: str | bytes, origin: str, remedy: str = "let the program write it again") -> Any:
    """The value of JSON text; raises InputError."""
    _require_length(text, _LONGEST_JSON, origin, remedy)
    try:
        value = json.loads(text)
    except (RecursionError, ValueError, OverflowError) as error:
        raise InputError(f"this is not JSON: {_short(error)}", origin, remedy) from error
    _require_sense(value, text, origin, remedy)
    return value


def is_number(value: Any) -> bool:
    """Return True if a value from a file is a number; `true` and `false` are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_finite(value: Any) -> bool:
    """Return True if a value from a file is a number, and neither infinite nor nan."""
    return is_number(value) and math.isfinite(value)


def _require_sense(value: Any, text: str | bytes, origin: str, remedy: str) -> None:
    """Raise InputError for whole numbers of more than 64 bits, and for endless nesting of tables."""

    def at(number: int) -> str:
        """The origin, with the number's line if it is written in decimal digits."""
        if number.bit_length() > 8192:
            # Python does not write longer ones out.
            return origin
        words = text if isinstance(text, str) else text.decode(errors="replace")
        before, found, _ = words.partition(str(number))
        return f"{origin}, line {before.count(chr(10)) + 1}" if found else origin

    level, depth = [value], 0
    while level:
        if depth > _DEEPEST:
            raise InputError(f"tables are nested more than {_DEEPEST} deep", origin, remedy)
        inner: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                inner += item.values()
            elif isinstance(item, list):
                inner += item
            elif isinstance(item, int) and not -_LARGEST <= item < _LARGEST:
                raise InputError("a whole number of more than 64 bits is out of bounds", at(item), remedy)
        level, depth = inner, depth + 1


def _short(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "brackets are nested too deep"
    # Python's message is about one of its settings.
    if "integer string conversion" in str(error):
        return "it holds a whole number of thousands of digits"
    return str(error)[:200]


def _located(message: str, text: str) -> tuple[str, int | None]:
    """The parser's complaint without its location, and its line."""
    match = re.search(r"\s*\(at (?:line (\d+), column \d+|end of document)\)", message)
    if not match:
        return message, None
    line = int(match[1]) if match[1] else max(1, len(text.splitlines()))
    return message[: match.start()], line
