"""Entry point of a child process, without bpy: `python child_main.py resume FOLDER --json`.

It makes its package importable as `mu_addon`, under any name in Blender. Processes that it starts run these
lines, too, and find the package likewise.
"""

import ctypes.util
import importlib
import importlib.util
import json
import os
import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2]
WITHOUT_SOLVER = (
    "presets", "design", "export", "specimens", "ports", "stream", "record", "replay", "calibrate",
    "prepare",
)  # fmt: skip
"""Commands for design, the printer and the sensor on the bench, which need no solver."""


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
    """Let gmsh find its library: Blender unpacks wheels without installing their data."""
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
# Each study of a parameter study is a separate process that also starts here.
os.environ["MU_ENTRY"] = str(Path(__file__).resolve())


def _trouble(solves):
    """Error message if a command cannot run here, or None. solves: True if it needs the solver."""
    try:
        import attrs  # noqa: F401

        if solves:
            import scipy  # noqa: F401
            import warp  # noqa: F401
    except (ImportError, OSError, RuntimeError) as error:
        missing = getattr(error, "name", None)
        return {
            "type": "error",
            "what": f"the package {missing} is not installed"
            if missing
            else f"the solver cannot load: {error}",
            "where": f"Python {sys.version.split()[0]}, {sys.executable}",
            "what_to_do": "install the extension built for this Blender and system (blender --command "
            "extension install-file -r user_default -e mu_addon-VERSION-SYSTEM-PYTHON.zip)"
            + ("; design and export work without the solver" if solves else ""),
            "status": 1,
        }
    return None


def _command(arguments):
    """Name of the command, for `resume` that of the folder's run if it needs no solver."""
    if arguments[0] != "resume":
        return arguments[0]
    runs = (name for name in WITHOUT_SOLVER if Path(arguments[1], f"{name}.toml").is_file())
    return next(runs, arguments[0])


def main(arguments):
    """Run one command line of the core in a watched process; return its exit status."""
    ends_with_input = bool(os.environ.get("MU_ENDS_WITH_INPUT"))
    watched = importlib.import_module("mu_addon.cli.watched")
    return watched.run_watched(arguments, lambda: run(arguments), ends_with_input)


def run(arguments):
    """Run one command line of the core; return its exit status. `check` only tests the solver."""
    helps = not arguments or "-h" in arguments or "--help" in arguments
    solves = not helps and (len(arguments) < 2 or _command(arguments) not in WITHOUT_SOLVER)
    trouble = _trouble(solves)
    if trouble is not None:
        if "--json" in arguments or arguments == ["check"]:
            sys.stdout.write(json.dumps(trouble) + "\n")
        else:
            sys.stderr.write(
                f"error: {trouble['what']}\n  where: {trouble['where']}\n"
                f"  what to do: {trouble['what_to_do']}\n"
            )
        return 1
    if arguments == ["check"]:
        sys.stdout.write(json.dumps({"type": "result"}) + "\n")
        return 0
    importlib.import_module("mu_addon.run.processes").limit_memory(int(os.environ.get("MU_MEMORY_MB", "0")))
    # By name: the package is the one provided above, and not one that happens to be on the path.
    return importlib.import_module("mu_addon.cli.main").main(arguments)


if __name__ == "__main__":
    # Blender passes on its own arguments, too.
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    sys.exit(main(own))
