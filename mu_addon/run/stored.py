"""Results of stages as named arrays and back, by the types that their classes declare; never pickle."""

from __future__ import annotations

import hashlib
import types
import typing
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import Any, Union

import attrs
import numpy as np

from ..arrays import Array

Arrays = dict[str, Array]

# Ends the name of the array that holds a tuple's length or a table's names.
_COUNT, _NAMES = "#", "@"
_PLAIN = (bool, int, float, str)


def packed(value: Any, name: str = "value") -> Arrays:
    """Arrays by name of a value: numbers, texts, bytes, arrays, tuples, tables, attrs classes; None is none.

    Raises TypeError for anything else.
    """
    if value is None:
        return {}
    if isinstance(value, (np.ndarray, np.generic, *_PLAIN)):
        return {name: np.asarray(value)}
    if isinstance(value, bytes):
        return {name: np.frombuffer(value, np.uint8)}
    if isinstance(value, tuple | list):
        items = {str(i): item for i, item in enumerate(value)}
        return {name + _COUNT: np.asarray(len(value)), **_each(items, name)}
    if isinstance(value, Mapping):
        return {name + _NAMES: np.asarray(list(value), str), **_each(value, name)}
    if attrs.has(type(value)):
        fields = {f.name: getattr(value, f.name) for f in attrs.fields(type(value)) if f.init}
        return {name + _COUNT: np.asarray(len(fields)), **_each(fields, name)}
    raise TypeError(f"{name}: a {type(value).__name__} is not stored")


def _each(items: Mapping[str, Any], name: str) -> Arrays:
    found: Arrays = {}
    for key, item in items.items():
        found |= packed(item, f"{name}.{key}")
    return found


def unpacked(kind: Any, arrays: Mapping[str, Array], name: str = "value") -> Any:
    """The value of a type that `packed` made arrays of; raises ValueError where they are not of that type."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (Union, types.UnionType):
        if not any(
            key == name or key.startswith((f"{name}.", name + _COUNT, name + _NAMES)) for key in arrays
        ):
            return None
        for option in inner:
            if option is not type(None):
                with suppress(ValueError):
                    return unpacked(option, arrays, name)
        raise ValueError(f"{name} is none of {inner}")
    if origin is tuple or kind is tuple:
        count = int(_array(arrays, name + _COUNT))
        each = [inner[0]] * count if inner[-1] is Ellipsis else list(inner)
        if len(each) != count:
            raise ValueError(f"{name} has {count} values, not {len(each)}")
        return tuple(unpacked(hint, arrays, f"{name}.{i}") for i, hint in enumerate(each))
    if origin in (dict, Mapping):
        names = [str(key) for key in _array(arrays, name + _NAMES)]
        return {key: unpacked(inner[1], arrays, f"{name}.{key}") for key in names}
    if origin is typing.Literal:
        found = _array(arrays, name).item()
        if found not in inner:
            raise ValueError(f"{name} = {found!r} is none of {inner}")
        return found
    if kind is bytes:
        found = _array(arrays, name)
        if found.dtype != np.uint8:
            raise ValueError(f"{name} is no bytes")
        return found.tobytes()
    if origin is np.ndarray or kind is np.ndarray:
        return _array(arrays, name)
    if kind in _PLAIN:
        found = _array(arrays, name)
        if found.shape or type(found.item()) is not kind:
            raise ValueError(f"{name} is no {kind.__name__}")
        return found.item()
    if attrs.has(kind):
        hints = _hints(kind)
        names = [f.name for f in attrs.fields(kind) if f.init]
        if int(_array(arrays, name + _COUNT)) != len(names):
            raise ValueError(f"{name} is another {kind.__name__}")
        return kind(**{key.lstrip("_"): unpacked(hints[key], arrays, f"{name}.{key}") for key in names})
    raise ValueError(f"{name}: {kind} is not stored")


def _array(arrays: Mapping[str, Array], name: str) -> Array:
    if name not in arrays:
        raise ValueError(f"there is no {name}")
    return arrays[name]


@cache
def _hints(kind: type) -> dict[str, Any]:
    return typing.get_type_hints(kind)


def content(value: Any) -> str:
    """Hash of what a value holds, equal in every process; of an object with `hash()`, that.

    Raises TypeError for an object whose content is unknown.
    """
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, value: Any) -> None:
    """Add a value to a digest, each part after its kind and size, so that none runs into the next."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (*_PLAIN, bytes)):
        digest.update(f"{type(value).__name__} {value!r};".encode())
    elif isinstance(value, np.ndarray):
        digest.update(f"array {value.shape} {value.dtype.str};".encode())
        # Its memory as it is: a copy of a large array would double it.
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, tuple | list | frozenset):
        digest.update(f"{len(value)} items;".encode())
        for item in sorted(value) if isinstance(value, frozenset) else value:
            _feed(digest, item)
    elif isinstance(value, Mapping):
        digest.update(f"{len(value)} keys;".encode())
        for key, item in value.items():
            _feed(digest, key)
            _feed(digest, item)
    elif callable(getattr(value, "hash", None)) and not isinstance(value, type):
        digest.update(f"{type(value).__name__} {value.hash()};".encode())
    elif attrs.has(type(value)):
        digest.update(f"{type(value).__name__};".encode())
        for field in attrs.fields(type(value)):
            if field.init:
                digest.update(f"{field.name} ".encode())
                _feed(digest, getattr(value, field.name))
    elif isinstance(value, type):
        digest.update(f"{value.__module__}.{value.__qualname__};".encode())
    elif isinstance(value, types.FunctionType) and value.__closure__ is None:
        code = value.__code__
        constants = [c for c in code.co_consts if isinstance(c, _PLAIN)]
        digest.update(f"{value.__qualname__} {code.co_names} {constants}".encode() + code.co_code)
    else:
        raise TypeError(f"the content of a {type(value).__name__} is unknown: give it `hash()`")
