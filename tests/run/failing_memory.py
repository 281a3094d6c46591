"""A memory whose n-th large block is refused: every place of a run where memory can end, one after the other.

Blocks are those of numpy's arrays, so also scipy's, in the thread that enters the layer. What a library sets
aside by its own means (Gmsh, CHOLMOD, Warp) is not among them: for those, set a limit on the whole process.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

# Places of PyDataMem_SetHandler and _GetHandler in the table of numpy's C interface, since numpy 1.22.
_SET_HANDLER, _GET_HANDLER = 304, 305
_MALLOC = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
_CALLOC = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
_REALLOC = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)


class _Handler(ctypes.Structure):
    """PyDataMem_Handler of numpy's C interface."""

    _fields_ = [
        ("name", ctypes.c_char * 127),
        ("version", ctypes.c_uint8),
        ("ctx", ctypes.c_void_p),
        ("malloc", _MALLOC),
        ("calloc", _CALLOC),
        ("realloc", _REALLOC),
        ("free", ctypes.c_void_p),
    ]


class FailingMemory:
    """The large blocks that were asked for, and which of them is refused.

    at: number of the block that is refused, from 1 on, or 0 for none; for_good: whether all after it are,
    too. least: what is large, in bytes. places: how many were asked for; where: who asked for the first
    that was refused.
    """

    def __init__(self, at: int, for_good: bool, least: int) -> None:
        self.at, self.for_good, self.least = at, for_good, least
        self.places = 0
        self.where = ""

    def refuses(self, size: int) -> bool:
        """Count a block; whether it is refused."""
        if size < self.least:
            return False
        self.places += 1
        if not self.at or not (self.places == self.at or (self.for_good and self.places > self.at)):
            return False
        self.where = self.where or _asker()
        return True


def _asker() -> str:
    """The nearest line of this program that asks for memory."""
    frame = sys._getframe(1)
    while frame.f_back is not None and "mu_addon" not in frame.f_code.co_filename.rpartition("tests")[2]:
        frame = frame.f_back
    return f"{frame.f_code.co_filename.rpartition('mu_addon')[2]}:{frame.f_lineno} {frame.f_code.co_name}"


def _function(place: int, *given: Any) -> Any:
    """A function of numpy's C interface that returns a Python object."""
    table = getattr(np, "_core", np.core)._multiarray_umath._ARRAY_API
    functions = ctypes.cast(_pointer(table, None), ctypes.POINTER(ctypes.c_void_p))
    return ctypes.PYFUNCTYPE(ctypes.py_object, *given)(functions[place])


def _pointer(capsule: object, name: bytes | None) -> int:
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return int(get(capsule, name))


_present: FailingMemory | None = None
_installed: list[object] = []


def _handler() -> object:
    """The capsule of an allocator that asks the present layer, if there is one, and else numpy's own.

    There is one for the whole process: an array keeps to the allocator that made it until it is gone.
    """
    if _installed:
        return _installed[0]
    first = _Handler.from_address(_pointer(_function(_GET_HANDLER)(), b"mem_handler"))
    # numpy's own let go of Python's lock themselves, so they are called with it.
    first_malloc, first_calloc, first_realloc = (
        ctypes.PYFUNCTYPE(function.restype, *function.argtypes)(ctypes.cast(function, ctypes.c_void_p).value)
        for function in (first.malloc, first.calloc, first.realloc)
    )

    @_MALLOC
    def malloc(ctx: int | None, size: int) -> int | None:
        return None if _present and _present.refuses(size) else first_malloc(ctx, size)

    @_CALLOC
    def calloc(ctx: int | None, count: int, size: int) -> int | None:
        return None if _present and _present.refuses(count * size) else first_calloc(ctx, count, size)

    @_REALLOC
    def realloc(ctx: int | None, block: int | None, size: int) -> int | None:
        return None if _present and _present.refuses(size) else first_realloc(ctx, block, size)

    handler = _Handler(b"failing memory", 1, first.ctx, malloc, calloc, realloc, first.free)
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    capsule = new(ctypes.addressof(handler), b"mem_handler", None)
    _installed.extend([capsule, handler])
    return capsule


@contextmanager
def short_of_memory(at: int = 0, for_good: bool = False, least: int = 1 << 16) -> Iterator[FailingMemory]:
    """While the body runs, the `at`-th large block that numpy asks for is refused; see FailingMemory."""
    global _present
    memory = FailingMemory(at, for_good, least)
    install = _function(_SET_HANDLER, ctypes.py_object)
    before = install(_handler())
    _present = memory
    try:
        yield memory
    finally:
        _present = None
        install(before)
