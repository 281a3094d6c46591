"""gmsh, loaded late, and models with fixed options."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import MeshingError
from ..run.supervisor import write_stack_at_crash
from .gmsh_libraries import SYSTEM_LIBRARIES, install_libraries, missing_libraries


class GmshUnavailable(MeshingError):
    """gmsh is not installed, or a system library it needs cannot be loaded."""


def load_gmsh() -> Any:
    """The gmsh module. Raises GmshUnavailable, naming the missing part, if it cannot be loaded."""
    try:
        import gmsh
    except ImportError as error:
        raise GmshUnavailable(f"gmsh is not installed: {error}", remedy="pip install gmsh") from error
    except OSError as error:
        raise GmshUnavailable(
            f"gmsh cannot load a system library: {error}",
            remedy=install_libraries(missing_libraries() or SYSTEM_LIBRARIES),
        ) from error
    # Where its wheel was unpacked without the library, gmsh imports all the same and only warns.
    if not hasattr(gmsh.lib, "gmshInitialize"):
        raise GmshUnavailable(
            "gmsh is installed without its library",
            remedy="install gmsh by pip in a separate environment",
        )
    return gmsh


_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
}


@contextmanager
def gmsh_model(gmsh: Any) -> Iterator[Any]:
    """Context of a new, silent gmsh model with fixed options; gmsh's state is restored afterwards."""
    ours = not gmsh.isInitialized()
    if ours:
        # Personal option files and signal handlers would change results and Ctrl-C.
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        write_stack_at_crash()
    before = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    current = gmsh.model.getCurrent()
    try:
        gmsh.model.add("mu")
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(current)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)
