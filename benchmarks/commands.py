"""Every documented command once: exit status, seconds, memory, and what its progress said beside what came.

    python -m benchmarks.commands                       # all of them
    python -m benchmarks.commands homogenize grip       # some
    python -m benchmarks.commands --plans               # motions and rankings of ten kinds
    python -m benchmarks.commands --logs FOLDER sweep   # keeps each line that a command wrote, with its time

A command whose full run takes over two minutes runs coarse, as its row shows. "Told" is the time that the
command gave at its start beside other work, "first" the factor between that and what it took, "silent" the
longest time without a line on the terminal. "Left" is the largest
factor between a time left that a line told and the time that was left, of lines in the run's second half more
than LEAST_S before the end. A share done that fell, and a time left that grew without a reason told, count as
faults.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from benchmarks.interrupts import CHAIN, CHAIN_PROTOCOL, DESIGN, SWEEP
from benchmarks.table import ROOT, circumstances, options_of
from mu_addon.design.parameters import load_preset, to_toml

LEAST_S = 10.0
QUICK = "--refine 0.4 --times 3"
UNIT = "--preset mu-0.75x"
ROWS = (
    "presets",
    f"design {UNIT} --path alpha4",
    f"check {UNIT} --path alpha4",
    f"export {UNIT} --path alpha4",
    "specimens",
    f"simulate {UNIT} {QUICK}",
    f"place {UNIT} {QUICK} --stations 11",
    "resume FOLDER",
    f"homogenize {UNIT} --friction none --refine 0.5",
    "fit-material tests/data/treloar",
    "import tension.csv --set kind=coupon --set mode=uniaxial --set section_mm=12.5x3 --set length_mm=40",
    "diagnose assets/examples/paper-moduli",
    "design-experiments assets/examples/paper-moduli",
    "optimize design.toml",
    "sweep sweep.toml",
    "graph assets/graphs/unit.toml",
    "grip --preset gripper --coarse --cube 25 --refine 0.25",
    "chain chain.toml",
    "ports",
    "stream --simulate --seconds 20",
    "record --simulate --seconds 5",
    "replay RECORDING",
    "calibrate SWEEPS --channel light_V --dark dark_V --angles assets/examples/bench/angles.csv",
)
PLANS = (
    "place --preset mu-1.0x --quick",
    "place --preset mu-1.0x --refine 0.5",
    "place --unit four.toml --refine 0.35",
    "place --unit five.toml --refine 0.5 --no-self-contact",
    "place --preset mu-1.5x --refine 0.35 --no-mesh-check",
    "simulate --preset mu-1.0x",
    "simulate --preset mu-0.75x --refine 0.5",
    "simulate --unit three.toml --refine 0.5 --no-self-contact",
    "simulate --unit four.toml --under-pressure",
    "simulate --unit five.toml --refine 0.35 --times 25",
)
_UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}
_SHARE = re.compile(r"^ *(\d+) %  ")
_LEFT = re.compile(r"(?:, |  )((?:[\d.]+ (?:h|min|s) ?)+) left")
_TOLD = re.compile(r"^about ([^,]*?) (?:beside other work|on two cores)")


class Line(NamedTuple):
    """A line of a command's words, and when it came, in s after its start."""

    at: float
    text: str


class Ran(NamedTuple):
    """What a command took and wrote."""

    status: int
    seconds: float
    processor_s: float
    memory_MB: float
    lines: list[Line]


def seconds_of(words: str) -> float:
    """Seconds of a time as the terminal spells it: "3 min 05 s"."""
    return sum(float(n) * _UNITS[unit] for n, unit in re.findall(r"([\d.]+) (h|min|s)\b", words))


def ran(words: list[str], folder: Path) -> Ran:
    """Run a command in a folder; its lines are read as they come."""
    line = [sys.executable, str(ROOT / "headless" / "run.py"), *words]
    begun, lines = time.monotonic(), []
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        line, cwd=folder, stdin=subprocess.DEVNULL, stdout=pipe, stderr=subprocess.STDOUT, text=True
    )

    def read() -> None:
        for text in process.stdout or ():
            lines.append(Line(time.monotonic() - begun, text.rstrip()))

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    _, ended, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(ended)
    reader.join(5.0)
    took = time.monotonic() - begun
    return Ran(process.returncode, took, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3, lines)


def judged(found: Ran) -> tuple[str, str, float, str, list[str]]:
    """Time told at the start, its factor, longest silence in s, largest factor of a time left, and faults."""
    told = next((m[1] for line in found.lines if (m := _TOLD.match(line.text))), "")
    ratio = seconds_of(told) / found.seconds
    first = f"{max(ratio, 1.0 / ratio):.1f}" if told else ""
    at = [0.0, *(line.at for line in found.lines), found.seconds]
    silent = max(b - a for a, b in pairwise(at))
    factor, share, before, faults = 1.0, -1, None, []
    for line in found.lines:
        if m := _SHARE.match(line.text):
            if int(m[1]) < share:
                faults.append(f"{share} % before {line.text}")
            share = int(m[1])
        if m := _LEFT.search(line.text):
            left, true = seconds_of(m[1]), found.seconds - line.at
            if true > LEAST_S and line.at > 0.5 * found.seconds:
                factor = max(factor, left / true, true / max(left, 1.0))
            grew = before is not None and left > 1.02 * (before[1] - (line.at - before[0])) + 2.0
            if grew and "(" not in line.text[m.end() :]:
                faults.append(f"grew: {line.text}")
            before = line.at, left
    return told, first, silent, f"{factor:.1f}" if before else "", faults


def prepare(work: Path) -> None:
    """Write the files that the commands read into a folder."""
    for name in ("assets", "tests"):
        (work / name).symlink_to(ROOT / name)
    (work / "sweep.toml").write_text(SWEEP)
    (work / "design.toml").write_text(
        DESIGN.replace("evaluations = 6", "evaluations = 4").replace("0.4", "0.3")
    )
    (work / "chain.toml").write_text(CHAIN)
    (work / "chain.csv").write_text(CHAIN_PROTOCOL)
    for name, count in (("three", 3), ("four", 4), ("five", 5)):
        (work / f"{name}.toml").write_text(to_toml(load_preset("mu-1.0x").evolve(count=count)))
    rows = "".join(f"{0.1 * n:.1f},{0.05 * n:.3f},{0.02 * n:.3f}\n" for n in range(200))
    (work / "tension.csv").write_text("Time (s),Force (N),Displacement (mm)\n" + rows)


def main() -> None:
    """Run the commands and print their table."""
    parser = options_of(__doc__)
    parser.add_argument("commands", nargs="*", help="names of commands (default: all)")
    parser.add_argument("--plans", action="store_true", help="motions and rankings whose plans are compared")
    parser.add_argument("--logs", type=Path, help="folder for the words of each command")
    given = parser.parse_args()
    print(circumstances(), "\n")
    ran_as = "exit | seconds | of the processor | memory [MB]"
    print(f"| command | {ran_as} | told | first | silent [s] | left | faults |")
    print("| --- |" + " ---: |" * 9, flush=True)
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        prepare(work)
        last = {"FOLDER": "", "RECORDING": "", "SWEEPS": ""}
        for number, row in enumerate(PLANS if given.plans else ROWS):
            name = row.split()[0]
            words = [last.get(word, word) for word in shlex.split(row)]
            if given.commands and name not in given.commands:
                continue
            out = f"out{number}"
            if name not in ("presets", "ports", "resume"):
                words += ["--out", out]
            found = ran(words, work)
            told, first, silent, factor, faults = judged(found)
            took = f"{found.seconds:.1f} | {found.processor_s:.1f} | {found.memory_MB:.0f}"
            cells = f"{found.status} | {took} | {told} | {first} | {silent:.1f}"
            print(f"| `{row}` | {cells} | {factor} | {len(faults)} |", flush=True)
            if given.logs:
                given.logs.mkdir(parents=True, exist_ok=True)
                text = "".join(f"{line.at:8.1f} {line.text}\n" for line in found.lines)
                (given.logs / f"{number:02d}-{name}.txt").write_text(text)
            if found.status:
                wrong.append(f"{row}\n" + "\n".join(line.text for line in found.lines[-12:]))
            wrong += [f"{row}: {fault}" for fault in faults]
            if name == "place":
                last["FOLDER"] = out
            elif name == "stream":
                last["RECORDING"] = last["SWEEPS"] = out
    for one in wrong:
        print(f"\n{one}")


if __name__ == "__main__":
    main()
