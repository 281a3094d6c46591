"""A 64-bit little-endian ELF library: its dynamic symbols, needed libraries, and what its loader reads."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from typing import NamedTuple

_DYNAMIC = 6  # SHT_DYNAMIC
_DYNAMIC_SYMBOLS = 11  # SHT_DYNSYM
_NEEDED = 1  # DT_NEEDED
_LOAD = 1  # PT_LOAD
_HEAD = 64
"""Bytes of the header."""
_PAGE = 4096
_MAGIC = b"\x7fELF\x02\x01"


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


def libraries(content: bytes) -> list[str]:
    """Names of the libraries that the loader looks for; none where the content is no library."""
    return [library.name for library in needed(content)] if content.startswith(_MAGIC) else []


def dynamic(content: bytes) -> list[Section]:
    """The section that the loader reads: one in a library."""
    return [section for section in _sections(content) if section.kind == _DYNAMIC]


def struck(content: bytes, names: Collection[str]) -> bytes:
    """The library without these among those that the loader looks for."""
    (table,) = dynamic(content)
    gone = {library.at for library in needed(content) if library.name in names}
    places = range(table.offset, table.offset + table.size, table.entry)
    kept = b"".join(content[at : at + table.entry] for at in places if at not in gone)
    # The table ends with its first entry of zeros.
    return content[: table.offset] + kept.ljust(table.size, b"\0") + content[table.offset + table.size :]


def loaded(content: bytes) -> bytes:
    """The library without what no loader reads: debugging data, names of local symbols, list of sections.

    Its segments stay as they are, and the spaces between them are closed by whole pages. Content that is no
    ELF library, and a library that this makes no page shorter, come back as they are.
    """
    if not content.startswith(_MAGIC):
        return content
    (table,) = struct.unpack_from("<Q", content, 0x20)
    size, count = struct.unpack_from("<HH", content, 0x36)
    entries = [table + size * k for k in range(count)]
    segments = [struct.unpack_from("<IIQQQQQQ", content, at) for at in entries]
    kept = sorted(
        [(0, _HEAD), (table, table + size * count), *((s[2], s[2] + s[5]) for s in segments if s[5])]
    )
    made, moved = bytearray(), {}
    end = 0
    for start, stop in kept:
        if start > end:
            # The loader wants a segment's place in the file and in memory alike within a page.
            made += bytes((start - len(made)) % _PAGE)
            end = start
        moved[start] = len(made) - (end - start)
        made += content[end:stop]
        end = max(end, stop)
    if len(made) > len(content) - _PAGE:
        return content
    struct.pack_into("<QQ", made, 0x20, moved[table], 0)
    struct.pack_into("<HH", made, 0x3C, 0, 0)
    for at, (kind, _, place, _, _, held, _, align) in zip(entries, segments, strict=True):
        entry = at - table + moved[table]
        if held:
            struct.pack_into("<Q", made, entry + 8, moved[place])
        if kind == _LOAD:
            struct.pack_into("<Q", made, entry + 48, min(align, _PAGE))
    return bytes(made)


def _sections(content: bytes) -> list[Section]:
    (start,) = struct.unpack_from("<Q", content, 0x28)
    size, count = struct.unpack_from("<HH", content, 0x3A)
    read = [struct.unpack_from("<IIQQQQIIQQ", content, start + size * k) for k in range(count)]
    return [Section(kind, at, length, link, one) for _, kind, _, _, at, length, link, _, _, one in read]


def _text(content: bytes, at: int) -> str:
    return content[at : content.index(b"\0", at)].decode()
