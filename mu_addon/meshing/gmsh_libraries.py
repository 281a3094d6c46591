"""System libraries that gmsh's published wheel needs, and the remedy where one is missing.

The extension's own gmsh needs only libgomp of these.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from ..reading import file_bytes

SYSTEM_LIBRARIES = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXcursor.so.1": "libxcursor1",
    "libXfixes.so.3": "libxfixes3",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libXrender.so.1": "libxrender1",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
}
"""Libraries that gmsh's wheel for Linux expects from the system, and Debian's packages of them."""


_CACHE = Path("/etc/ld.so.cache")
"""Linux's cache of the libraries that it finds."""


def missing_libraries() -> list[str]:
    """Names in SYSTEM_LIBRARIES that this system lacks; empty if that is unknown."""
    try:
        known = file_bytes(_CACHE)
    except OSError:
        return []
    folders = [Path(folder) for folder in os.environ.get("LD_LIBRARY_PATH", "").split(":") if folder]
    return [
        name
        for name in SYSTEM_LIBRARIES
        if name.encode() + b"\0" not in known and not any((folder / name).is_file() for folder in folders)
    ]


def install_libraries(names: Iterable[str]) -> str:
    """Remedy for system libraries that gmsh lacks."""
    return f"on Debian and Ubuntu: apt install {' '.join(SYSTEM_LIBRARIES[name] for name in names)}"
