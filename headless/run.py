"""The command line of mu_addon, in plain Python or inside Blender.

python headless/run.py place --preset mu-1.0x --out out
blender -b -P headless/run.py -- place --preset mu-1.0x --out out
"""

from __future__ import annotations

import os
import signal
import sys


def stop_at_once(number: int, frame: object) -> None:
    """Ctrl-C before a run has begun or after its end: nothing is to be kept, and no stack to be shown."""
    # No exception: numpy makes another one of it where it comes in the middle of its import.
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os.write(2, b"error: stopped by Ctrl-C\n")
    os._exit(130)


# Before the other imports, which take some tenths of a second. Blender has a handler of its own.
if __name__ == "__main__" and "bpy" not in sys.modules:
    signal.signal(signal.SIGINT, stop_at_once)

import subprocess  # noqa: E402
from pathlib import Path  # noqa: E402

# Before anything loads BLAS: its threads spin while they wait for each other on the many small systems here.
# A verdict on a beam took 7.8 s with two and 2.5 s with one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parent.parent
CHILD_MAIN = ROOT / "mu_addon" / "blender" / "jobs" / "child_main.py"
NEED_BLENDER = ("track",)
"""Commands that use Blender itself, its movie clip tracker, and solve nothing."""


def arguments() -> list[str]:
    """What follows `--` when Blender runs this file, everything otherwise."""
    if "bpy" in sys.modules and "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    # Blender without arguments for us would hand over its own.
    return [] if "bpy" in sys.modules and not sys.argv[0].endswith("run.py") else sys.argv[1:]


def extension_packages() -> list[Path]:
    """Folders where Blender unpacks the wheels of installed extensions, whether these are enabled or not."""
    import bpy

    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    root = Path(bpy.utils.user_resource("EXTENSIONS"), ".local")
    folders = root / "lib" / version / "site-packages", root / "Lib" / "site-packages"
    return [folder for folder in folders if folder.is_dir()]


def in_own_process(line: list[str]) -> int:
    """Run a command line in a process without Blender; returns its exit status.

    A process that Blender has loaded its libraries into cannot solve, see `mu_addon.run.interpreter`. Ctrl-C
    reaches the child as it reaches this process, SIGTERM is passed on, and the child ends when this process
    is killed.
    """
    import bpy

    from mu_addon.errors import InputError
    from mu_addon.run.interpreter import environment, worker_command

    try:
        command = worker_command(CHILD_MAIN, line, bpy.app.binary_path)
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return error.status
    # Commands that take words from standard input need the user's own.
    reads = "--controlled" in line
    settings = {**environment(extension_packages()), **({} if reads else {"MU_ENDS_WITH_INPUT": "1"})}
    child = subprocess.Popen(command, env=settings, stdin=None if reads else subprocess.PIPE)
    signal.signal(signal.SIGTERM, lambda number, frame: child.terminate())
    while True:
        try:
            return child.wait()
        except KeyboardInterrupt:
            continue


def main(line: list[str]) -> int:
    """Run a command line, watched, or, inside Blender, without Blender; returns its exit status."""
    if "bpy" in sys.modules:
        if not line or line[0] not in NEED_BLENDER:
            return in_own_process(line)
        sys.path += [str(folder) for folder in extension_packages()]
    from mu_addon.cli.watched import run_watched

    return run_watched(line, lambda: work(line))


def work(line: list[str]) -> int:
    """Run a command line in this process; returns its exit status, with words where a package is missing."""
    try:
        from mu_addon.cli.main import main as run

        # Its parser asks for packages, too.
        return run(line)
    except ModuleNotFoundError as error:
        sys.stderr.write(
            f"error: the package {error.name} is not installed\n  where: {sys.executable}\n"
            f"  what to do: {sys.executable} -m pip install -e {ROOT}\n"
        )
        return 1


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    exit_status = main(arguments())
    if "bpy" not in sys.modules:
        # All has been said; what libraries do at their end is not to be cut short.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(exit_status)
