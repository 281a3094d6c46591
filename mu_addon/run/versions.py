"""Versions of this program and the packages it computes with, for reports and comparisons."""

from __future__ import annotations

import platform
from importlib import metadata

PACKAGES = ("numpy", "scipy", "warp-lang", "cvxopt", "pymetis", "manifold3d", "gmsh", "pytetwild", "meshio")


def package_versions() -> dict[str, str]:
    """Versions of the program, of Python and of every package that decides a figure."""
    versions = {"mu_addon": _version("mu_addon"), "Python": platform.python_version()}
    return versions | {name: _version(name) for name in PACKAGES}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed as a package"
