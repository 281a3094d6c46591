"""The process that simulates: `python worker.py place --unit unit.toml --out folder --json`, without bpy.

It makes the package it lies in importable as `mu_addon`, whatever Blender calls it. The processes that it
starts run these lines, too, and find the package the same way.
"""

import ctypes.util
import importlib
import importlib.util
import json
import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2]
WITHOUT_SOLVER = ("record", "replay", "calibrate", "check", "export", "specimens")
"""Commands for the sensor on the bench and for the printer: they start at once, also without the solver."""


def _provide_package():
    if "mu_addon" in sys.modules:
        return
    spec = importlib.util.spec_from_file_location(
        "mu_addon", PACKAGE / "__init__.py", submodule_search_locations=[str(PACKAGE)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["mu_addon"] = module
    spec.loader.exec_module(module)


def _provide_gmsh():
    """Tell gmsh where its library is: Blender unpacks wheels without moving their data into place."""
    find = ctypes.util.find_library

    def found(name):
        if name == "gmsh":
            for folder in map(Path, sys.path):
                for pattern in ("libgmsh*", "gmsh*.dll"):
                    for library in folder.glob(f"gmsh-*.data/data/[lLb]i[bn]/{pattern}"):
                        return str(library)
        return find(name)

    ctypes.util.find_library = found


_provide_package()
_provide_gmsh()


def _trouble():
    """Why nothing can be simulated here, as the words of an error message, or None."""
    try:
        import scipy  # noqa: F401
        import warp  # noqa: F401
    except (ImportError, OSError, RuntimeError) as error:
        return {
            "type": "error",
            "what": f"the solver cannot load: {error}",
            "where": f"Python {sys.version.split()[0]}, {sys.executable}",
            "what_to_do": "install the extension built for this Blender and system; design and export work "
            "without",
            "status": 1,
        }
    return None


def main(arguments):
    """Exit status of one command line of the core; `check` alone only tells whether the solver loads."""
    solves = len(arguments) < 2 or arguments[0] not in WITHOUT_SOLVER
    trouble = _trouble() if solves else None
    if trouble is not None:
        sys.stdout.write(json.dumps(trouble) + "\n")
        return 1
    if arguments == ["check"]:
        sys.stdout.write(json.dumps({"type": "result"}) + "\n")
        return 0
    # By name: the package is the one provided above, and not one that happens to be on the path.
    return importlib.import_module("mu_addon.cli.main").main(arguments)


if __name__ == "__main__":
    # Blender hands over its own arguments, too.
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    sys.exit(main(own))
