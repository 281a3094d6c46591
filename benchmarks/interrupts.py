"""Ctrl-C at random moments of every long command, and what their folders go on to.

    python -m benchmarks.interrupts                            # all of them, 12 times each
    python -m benchmarks.interrupts --times 30 --seed 7 sweep
    python -m benchmarks.interrupts --kill place                   # kill -9 instead

The moments are spread over the run, one in each of its equal parts. Half of the signals go to the whole
process group, as a terminal sends them, half to the command alone; every third comes twice, and every fourth
within the first second. The command must end within MOST_S in words with status 130 (or with 0, where it was
done), leave no process, a summary that says partial and a report that says why it stopped, and, given again,
make the same files as a run that nothing happened to. After kill -9, of which nobody can tell, the folder
does so, too.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import attrs
import numpy as np

from benchmarks.table import ROOT, circumstances, options_of, print_head
from mu_addon.design.parameters import load_preset, to_toml

SWEEP = """
format = 1
preset = "mu-1.0x"
stages = "simulate"
method = "sobol"
points = 4
seed = 1
memory_MB = 1500
minutes = 10
minimize = ["mass_g"]

[simulate]
times = 3
mesh = { refine = 0.2 }
self_contact = false

[vary]
"chambers.wall_mm" = { low = 0.9, high = 1.2 }
"material.membrane_modulus_kPa" = { low = 1500.0, high = 4000.0, log = true }
"""
DESIGN = """
format = 1
preset = "mu-1.0x"
evaluations = 6
refine = 0.4

[[target]]
kind = "angle"
pressure_kPa = 20
low = 10

[[target]]
kind = "mass"
objective = "minimise"

[[freedom]]
parameter = "chambers.wall_mm"
low = 0.8
high = 1.4

[[freedom]]
parameter = "material.membrane_modulus_kPa"
low = 1500
high = 4000
"""
# The printed body of three chambers at one pressure: the least that has every stage.
PLACE = ["--unit", "unit.toml", "--protocol", "protocol.csv", "--refine", "0.4"]
PLACE += ["--times", "2", "--stations", "5", "--no-mesh-check"]
PROTOCOL = "time_s,pressure_kPa\n0,0\n1,1\n"
CHAIN = """
format = 1
protocol = "chain.csv"
tip_mass_g = 20.0
times = 3

[joint]
pressure_step_kPa = 30.0

[mesh]
refine = 0.25

[[unit]]
preset = "mu-1.0x"
pressure_kPa = [0.0, 30.0]

[[unit]]
preset = "mu-1.0x"
pressure_kPa = [0.0, 30.0]
"""
CHAIN_PROTOCOL = "time_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n1,30,10\n"
GRIP = ["--coarse", "--cube", "25", "--refine", "0.25"]
MOST_S = 5.0
COMMANDS = {
    "sweep": ["sweep", "sweep.toml"],
    "optimize": ["optimize", "design.toml"],
    "optimize, two workers": ["optimize", "design.toml", "--workers", "2"],
    "place": ["place", *PLACE],
    "simulate": ["simulate", "--unit", "unit.toml", "--refine", "0.4", "--times", "3"],
    "homogenize": ["homogenize", "--preset", "mu-1.0x", "--cells", "2", "--refine", "0.5"],
    "grip": ["grip", "--preset", "gripper", *GRIP],
    "chain": ["chain", "chain.toml"],
    "diagnose": ["diagnose", str(ROOT / "assets/examples/paper-moduli")],
    "fit-material": ["fit-material", str(ROOT / "tests/data/treloar")],
}
# What a run took is another thing than what it found.
TOOK = ("seconds", "memory_MB", "worker")


def start(work, words, out):
    line = [sys.executable, str(ROOT / "headless" / "run.py"), *words, "--out", str(out)]
    return subprocess.Popen(
        line,
        cwd=work,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        process_group=0,
    )


def found(folder):
    """Text of each table, and arrays of the deviations, by name."""
    files = {}
    for path in sorted(folder.glob("*.csv")):
        rows = [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]
        kept = [n for n, name in enumerate(rows[0]) if name not in TOOK]
        files[path.name] = [[row[n] for n in kept if n < len(row)] for row in rows]
    for path in sorted(folder.glob("*.toml")):
        files[path.name] = path.read_text()
    if (folder / "delta.npz").exists():
        with np.load(folder / "delta.npz") as arrays:
            files |= {name: arrays[name].tolist() for name in arrays.files}
    return files


def left_behind(folder):
    """Processes whose command line names a folder."""
    here = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if str(folder).encode() in path.read_bytes():
                here.append(int(path.parent.name))
        except OSError:
            continue
    return here


def left_wrong(folder):
    """What is wrong with what a run left that Ctrl-C stopped."""
    summary, report = folder / "summary.json", folder / "report.html"
    if not summary.exists():
        # Stopped before its folder was its own.
        return []
    status = json.loads(summary.read_text())["status"]
    wrong = [] if status == "partial" else [f"says {status}"]
    if not report.exists():
        return [*wrong, "no report"]
    return (
        wrong if "stopped by Ctrl-C" in report.read_text() else [*wrong, "a report that says nothing of it"]
    )


def three_chambers():
    unit = load_preset("mu-1.0x")
    return to_toml(attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3)))


def interrupted(work, words, out, moment, rng, number, kind):
    """Status and words of a run that a signal meets, seconds until it ended, and what is wrong."""
    process = start(work, words, out)
    time.sleep(moment)
    send = os.killpg if number % 2 else os.kill
    sent = time.monotonic()
    for again in range(2 if number % 3 == 0 else 1):
        time.sleep(again * rng.uniform(0.05, 1.0))
        try:
            send(process.pid, kind)
        except ProcessLookupError:
            break
    output, _ = process.communicate(timeout=600)
    took = time.monotonic() - sent
    wrong = []
    if process.returncode not in (0, 130 if kind == signal.SIGINT else -kind):
        wrong.append(f"status {process.returncode}")
    if process.returncode == 130 and "stopped by Ctrl-C" not in output:
        wrong.append("no words")
    if "Traceback" in output or "Exception" in output:
        wrong.append("a stack")
    if kind == signal.SIGINT and took > MOST_S:
        wrong.append(f"ended after {took:.1f} s")
    if kind == signal.SIGINT and process.returncode == 130:
        wrong += left_wrong(out)
    time.sleep(0.5)
    if left_behind(out):
        wrong.append("processes are left")
    return process.returncode, output, took, wrong


def one(work, name, times, seed, kind):
    """A row of the table for one command, then what went wrong with all that the command wrote."""
    words, rng = COMMANDS[name], np.random.default_rng([seed, *name.encode()])
    begun = time.monotonic()
    process = start(work, words, work / "reference")
    output, _ = process.communicate()
    seconds = time.monotonic() - begun
    assert process.returncode == 0, output
    reference = found(work / "reference")
    ends, slowest, faults = Counter(), 0.0, []
    for number in range(times):
        out = work / f"hit{number}"
        # pytetwild has no seed: each run has the reference's mesh.
        for mesh in (work / "reference" / "cache").glob("tetwild-*.npz"):
            (out / "cache").mkdir(parents=True, exist_ok=True)
            shutil.copy(mesh, out / "cache")
        moment = rng.uniform(0.1, 1.0) if number % 4 == 0 else seconds * (number + rng.uniform()) / times
        status, output, took, wrong = interrupted(work, words, out, moment, rng, number, kind)
        ends[status] += 1
        slowest = max(slowest, took)
        again = start(work, words, out)
        more, _ = again.communicate()
        if again.returncode != 0:
            wrong.append(f"then status {again.returncode}")
        elif found(out) != reference:
            wrong.append("then other results")
        if wrong:
            faults.append(f"{number} at {moment:.1f} s: {', '.join(wrong)}\n{output}\n{more}")
    statuses = ", ".join(f"{n} times {status}" for status, n in sorted(ends.items()))
    print(f"| {name} | {seconds:.0f} s | {statuses} | {slowest:.1f} s | {len(faults)} |", flush=True)
    return faults


def main():
    parser = options_of(__doc__)
    parser.add_argument("commands", nargs="*", choices=[*COMMANDS, []], help=", ".join(COMMANDS))
    parser.add_argument("--times", type=int, default=12)
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--kill", action="store_true", help="kill -9 instead of Ctrl-C")
    given = parser.parse_args()
    print(circumstances(), f"Seed {given.seed}.\n")
    print_head("command", "takes", "ended with status", "at most after", "wrong")
    faults = []
    for name in given.commands or COMMANDS:
        with tempfile.TemporaryDirectory() as folder:
            work = Path(folder)
            (work / "sweep.toml").write_text(SWEEP)
            (work / "design.toml").write_text(DESIGN)
            (work / "unit.toml").write_text(three_chambers())
            (work / "protocol.csv").write_text(PROTOCOL)
            (work / "chain.toml").write_text(CHAIN)
            (work / "chain.csv").write_text(CHAIN_PROTOCOL)
            kind = signal.SIGKILL if given.kill else signal.SIGINT
            faults += [f"{name} {fault}" for fault in one(work, name, given.times, given.seed, kind)]
    for fault in faults:
        print(f"\n{fault}")


if __name__ == "__main__":
    main()
