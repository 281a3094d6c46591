"""One code, one process, a stated number of threads: started here, answered by `answer`."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

from benchmarks.table import ROOT

from .problem import Problem, Result

_ABSENT = 77
_THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "CCX_NPROC_EQUATION_SOLVER",
)


class Absent(Exception):
    """A code that is not installed here; the message says how to have it."""


def run(code, problem, folder: Path, threads=2):
    """The Result of one of the modules beside this one, in its own process; None, said aloud, if absent."""
    folder.mkdir(parents=True, exist_ok=True)
    given = folder / "problem.npz"
    problem.save(given)
    environment = {**os.environ, **dict.fromkeys(_THREAD_VARIABLES, str(threads))}
    paths = (str(ROOT), os.environ.get("PYTHONPATH", ""))
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    # FEniCSx comes with a Python of its own, and wants one process a rank.
    elsewhere = os.environ.get("MU_FENICSX") if code == "with_fenicsx" else None
    start = shlex.split(elsewhere) if elsewhere else [sys.executable]
    if elsewhere:
        environment.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    command = [*start, "-m", f"benchmarks.peers.{code}", str(given.resolve()), str(folder.resolve()), code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode == _ABSENT:
        print(f"*** NOT RUN: {code}: {done.stderr.strip()} ***", file=sys.stderr, flush=True)
        return None
    if done.returncode:
        raise RuntimeError(f"{code} failed on {problem.name}:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return Result.load(folder, code)


def answer(solve):
    """The other end of `run`: solve the problem that the command line names and store the Result."""
    given, folder, name = sys.argv[1:4]
    try:
        result = solve(Problem.load(given), Path(folder))
    except Absent as why:
        print(why, file=sys.stderr)
        sys.exit(_ABSENT)
    if result is not None:
        result.save(Path(folder), name)
