"""What a 64-bit little-endian ELF library asks for and gives: its dynamic symbols and needed libraries."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

_DYNAMIC = 6  # SHT_DYNAMIC
_DYNAMIC_SYMBOLS = 11  # SHT_DYNSYM
_NEEDED = 1  # DT_NEEDED


class Section(NamedTuple):
    """A section: its kind, place, size, the section of its names, and the size of one entry."""

    kind: int
    offset: int
    size: int
    link: int
    entry: int


class Symbol(NamedTuple):
    """A dynamic symbol: its name, where its entry lies in the file, whether the library defines it."""

    name: str
    at: int
    defined: bool


class Needed(NamedTuple):
    """A library that is loaded with this one: its file name, and where the entry lies in the file."""

    name: str
    at: int


def symbols(content: bytes) -> Iterator[Symbol]:
    """Dynamic symbols that have a name."""
    listed = _sections(content)
    for section in listed:
        if section.kind != _DYNAMIC_SYMBOLS:
            continue
        for at in range(section.offset, section.offset + section.size, section.entry):
            name, _, _, place, _, _ = struct.unpack_from("<IBBHQQ", content, at)
            if name:
                yield Symbol(_text(content, listed[section.link].offset + name), at, bool(place))


def exported(content: bytes) -> set[str]:
    """Names that a library defines for others."""
    return {symbol.name for symbol in symbols(content) if symbol.defined}


def needed(content: bytes) -> Iterator[Needed]:
    """Libraries that the loader looks for."""
    (section,), listed = dynamic(content), _sections(content)
    for at in range(section.offset, section.offset + section.size, section.entry):
        tag, value = struct.unpack_from("<QQ", content, at)
        if tag == _NEEDED:
            yield Needed(_text(content, listed[section.link].offset + value), at)


def dynamic(content: bytes) -> list[Section]:
    """The section that the loader reads: one in a library."""
    return [section for section in _sections(content) if section.kind == _DYNAMIC]


def _sections(content: bytes) -> list[Section]:
    (start,) = struct.unpack_from("<Q", content, 0x28)
    size, count = struct.unpack_from("<HH", content, 0x3A)
    read = [struct.unpack_from("<IIQQQQIIQQ", content, start + size * k) for k in range(count)]
    return [Section(kind, at, length, link, one) for _, kind, _, _, at, length, link, _, _, one in read]


def _text(content: bytes, at: int) -> str:
    return content[at : content.index(b"\0", at)].decode()
