"""A run's inputs read back from its folder: TOML with every key and type checked."""

from __future__ import annotations

import hashlib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, Union

import attrs

from ..errors import InputError, did_you_mean
from ..reading import parse_toml, read_text
from .folder import RUN

FORMAT = 1
# Far more than any file of inputs has.
_LONGEST = 1_000_000
Made = TypeVar("Made")


def digest(content: str | bytes) -> str:
    """SHA-256 of a file's content, in hexadecimal."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def read_toml(path: Path, what: str = "inputs", remedy: str = "choose another folder") -> dict[str, Any]:
    """The document of a TOML file; raises InputError."""
    return parse_toml(read_text(path, what, remedy, _LONGEST), str(path))


def read_inputs(path: Path, *words: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Content of a file of inputs, and its table `[run]` of keys that decide no result. Raises InputError.

    A file without `format`, as older versions wrote some, is of format 1. words: as those of `read_toml`.
    """
    document = read_toml(path, *words)
    found = document.pop("format", FORMAT)
    if found != FORMAT or isinstance(found, bool):
        raise InputError(
            f"{path.name} is of format {found!r}, and this version reads {FORMAT}",
            str(path),
            "use the newer version that wrote it",
        )
    run = document.pop(RUN, {})
    if not isinstance(run, dict):
        raise InputError(f"{RUN} is not a table", str(path), f"write it as [{RUN}]")
    return document, run


def structured(kind: type[Made], table: Any, where: str, **given: Any) -> Made:
    """An instance of an attrs class from a table of TOML, each value of the type of its field.

    given: values in addition to those of the table. Tables become classes, arrays become tuples, and integers
    become floats where the class has a float. Raises InputError that names the key.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"{table!r} is not a table", where, "write it as a table")
    hints = typing.get_type_hints(kind)
    names = [field.name for field in attrs.fields(kind) if field.init and field.name not in given]  # type: ignore[arg-type]
    for key in table:
        if key not in names:
            raise InputError(
                f"unknown key {key!r}{did_you_mean(key, names)}", where, f"known: {', '.join(names)}"
            )
    values = {key: _value(hints[key], value, f"{where}, {key}") for key, value in table.items()}
    try:
        return kind(**values, **given)
    except InputError as error:
        raise InputError(error.what, f"{where}, {error.where}", error.remedy) from error
    except (TypeError, ValueError) as error:
        raise InputError(f"a value is not offered: {error.args[0]}", where, "correct that key") from error


def _value(hint: Any, value: Any, where: str) -> Any:
    """A value of TOML converted to the type of a field."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (Union, types.UnionType):
        (hint,) = [option for option in inner if option is not type(None)]
        return _value(hint, value, where)
    if origin is tuple and isinstance(value, list):
        each = [inner[0]] * len(value) if inner[-1] is Ellipsis else list(inner)
        if len(each) == len(value):
            return tuple(
                _value(h, v, f"{where}[{i}]") for i, (h, v) in enumerate(zip(each, value, strict=True))
            )
    if origin is typing.Literal and value in inner:
        return value
    if attrs.has(hint):
        return structured(hint, value, where)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if hint in (float, int, str, bool) and type(value) is hint:
        return value
    if origin is tuple:
        hint = tuple
    words: dict[Any, str] = {
        tuple: "a list",
        float: "a number",
        int: "a whole number",
        str: "text in quotes",
        bool: "true or false",
    }
    raise InputError(
        f"{value!r} does not fit", where, f"give {words.get(hint, 'the value that a run writes there')}"
    )


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
