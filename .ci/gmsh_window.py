"""gmsh's library for Linux without its window: it loads where no library for windows is installed.

The published libgmsh.so asks the system for ten libraries of its own window (libGLU, Xft, Xcursor, ...),
which not every desktop has; one that is missing keeps all of gmsh from loading. Nothing here opens that
window. So the ten are struck from the libraries that the loader looks for, and what gmsh takes from them is
made weak: the loader leaves a weak name that nobody defines at zero. No code is changed: a byte for each of
277 names and the table of libraries are. A window that is asked for all the same ends the process.
"""

from __future__ import annotations

import hashlib
import re
import zipfile
from pathlib import Path

import elf

FILE = "gmsh-4.15.2.data/data/lib/libgmsh.so.4.15"
"""The library in gmsh's wheel."""
SHA256 = "6b69f0d13b4f47b3de0b55c53af7f537c8377770325fc0bf570921691b3a03e8"
"""Of the library that is made from the wheel pinned in wheels.csv."""
CHANGE = "asks for no library of its window: what it takes from them is weak"
"""What is said of it in the bill of materials."""
LIBRARIES = re.compile(r"lib(GL|X|fontconfig)")
"""What the names of libraries for windows begin with."""
NAMES = re.compile(r"_?X|Fc[A-Z]|glu?X?[A-Z]")
"""What the names that these libraries define begin with."""
_WEAK = 2 << 4  # STB_WEAK, in the upper half of st_info
_INFO = 4  # place of st_info in a symbol's entry


def library(wheel: Path) -> bytes:
    """The library without its window; raises RuntimeError where it is not the one pinned."""
    with zipfile.ZipFile(wheel) as package:
        content = without_window(package.read(FILE))
    digest = hashlib.sha256(content).hexdigest()
    if digest != SHA256:
        raise RuntimeError(
            f"{FILE} without its window has SHA-256 {digest}, pinned is {SHA256} (gmsh_window.py)"
        )
    return content


def without_window(content: bytes) -> bytes:
    """A library that asks for no library for windows, and that loads without what they define."""
    made = bytearray(content)
    for symbol in elf.symbols(content):
        if not symbol.defined and NAMES.match(symbol.name):
            made[symbol.at + _INFO] = _WEAK | (made[symbol.at + _INFO] & 0xF)
    names = {library.name for library in elf.needed(content) if LIBRARIES.match(library.name)}
    return elf.struck(bytes(made), names)
