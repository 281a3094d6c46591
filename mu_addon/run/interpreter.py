"""The Python that runs a job in a separate process, started from inside Blender.

Blender has its own copies of libraries that the solver's wheels also contain (CHOLMOD, BLAS). In one process
a call may reach the other version's code, so nothing is solved in Blender's process.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import InputError

ROOT = Path(__file__).resolve().parents[2]
ENTRY = "MU_ENTRY"
"""Environment variable: Python file that runs the core's command line where its package has another name, as
in Blender; `jobs/child_main.py` sets it to itself."""
_LIBRARY_FOLDERS = ("site-packages", "dist-packages")


def interpreter(blender: str = "") -> list[str]:
    """Command that runs a Python file: this Python or, if it is part of Blender, Blender's.

    blender: path of Blender's program, if any. Raises InputError where there is neither.
    """
    python = Path(sys.executable)
    if python.is_file() and "python" in python.name.lower():
        # -P: the folder of the file is not searched for modules.
        return [str(python), "-P"]
    if blender:
        return [blender, "--background", "--factory-startup", "--python-exit-code", "70", "--python"]
    raise InputError(
        "there is no Python to run the job with",
        str(python),
        "use an official build of Blender, or run headless/run.py from a terminal",
    )


def worker_command(worker: Path, arguments: Sequence[str], blender: str = "") -> list[str]:
    """Command that runs a line of the core's command line by the Python file `worker`; raises InputError."""
    prefix = interpreter(blender)
    separator = ["--"] if prefix[-1] == "--python" else []
    return [*prefix, str(worker), *separator, *arguments]


def environment(more: Iterable[Path] = ()) -> dict[str, str]:
    """Environment of such a process: it finds the packages of this one, and those in `more`."""
    found = [Path(p) for p in sys.path if Path(p).name in _LIBRARY_FOLDERS]
    folders = dict.fromkeys(str(p) for p in [*more, *found])
    return {**os.environ, "PYTHONPATH": os.pathsep.join(folders), "PYTHONUNBUFFERED": "1"}


def core_command() -> list[str]:
    """Command prefix for a line of the core's command line. Raises InputError."""
    entry = os.environ.get(ENTRY)
    return worker_command(Path(entry), ()) if entry else [sys.executable, "-m", "mu_addon.cli"]


def core_path() -> str:
    """PYTHONPATH for `core_command`."""
    before = os.environ.get("PYTHONPATH", "")
    return before if os.environ.get(ENTRY) else os.pathsep.join(filter(None, [str(ROOT), before]))
