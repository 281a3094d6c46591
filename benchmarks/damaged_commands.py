"""Damaged files given to whole commands: each is computed with, or refused in words; nothing else may happen.

    python -m benchmarks.damaged_commands                        # 200 files of each kind, 5 by real processes
    python -m benchmarks.damaged_commands --files 50 --seed 7 chain graph

A file costs some milliseconds: each command runs in a fork of this process, which has loaded what commands
need, and is ended after some seconds of the processor's, still at work. What a real process does is tried
with a few.

Of a finished `place` of three chambers (kinds cache and JSON) one file is damaged, and it is resumed to its
end, which must find the same files. Solid and rays come from this process's memory there, by what they are
computed from: they are computed in every run and no file holds them.
"""

from __future__ import annotations

import io
import json
import os
import pickle
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.table import ROOT, circumstances, options_of, print_head
from mu_addon import design, studies
from mu_addon.cli import main as command_line
from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.design.surface import stl_bytes
from mu_addon.simulate_and_place import light
from tests.design.printing import parts
from tests.run.test_mutated_files import CORPUS, INDEX, RECORDING, mutated
from tests.run.test_reading import MODEL
from tests.studies.fault_injection import PLACEMENT, ran, results, started

ASSETS, DATA = ROOT / "assets", ROOT / "tests" / "data"
COARSE = ["--refine", "0.35", "--times", "3", "--no-report"]
SECONDS = [2.0]
"""Of the processor that a command may take: refusals take less."""
HUNG_S = 120.0
WELL = {0, 1, 2, 3, 4, 5, 6}
"""Exit statuses that say what happened; 70 and 71 are faults of the program."""
LAB_FILE = b"Time (s),Force (N),Extension (mm)\n" + b"".join(
    b"%.1f,%.3f,%.3f\n" % (0.1 * k, 0.05 * k, 0.02 * k) for k in range(40)
)


def folder_of(work, name, **files):
    """A folder with files of those names and contents."""
    folder = work / name
    folder.mkdir(exist_ok=True)
    for file, content in files.items():
        (folder / file).write_bytes(content)
    return folder


def one_file(name, content, *words):
    """A kind of which one file is damaged, named by the command's words as FILE."""

    def make(work, random_):
        path = work / name
        path.write_bytes(mutated(random_, content))
        return [str(path) if word == "FILE" else word for word in words]

    return make


def tree(work, random_):
    choice = random_.choice([CORPUS["node tree"][1](work), *(p.read_bytes() for p in GRAPHS)])
    return one_file("tree.toml", choice, "graph", "FILE", "--no-report")(work, random_)


def folder_with_one_damaged(source, *words, only=lambda path: True):
    """A kind of which one file of a folder is damaged, the folder named by the command's words as FOLDER."""

    def make(work, random_):
        folder = work / "folder"
        shutil.copytree(source, folder)
        path = random_.choice(sorted(p for p in folder.rglob("*") if p.is_file() and only(p)))
        path.write_bytes(mutated(random_, path.read_bytes()))
        return [str(folder) if word == "FOLDER" else word for word in words]

    return make


def chain(work, random_):
    folder = work / "chain"
    shutil.copytree(ASSETS / "examples" / "trunk", folder)
    path = random_.choice(sorted(folder.iterdir()))
    path.write_bytes(mutated(random_, path.read_bytes()))
    return ["chain", str(folder / "chain.toml"), "--no-report"]


def replay(work, random_):
    content = {"index.ndjson": INDEX, "recording-000.csv": RECORDING}
    name = random_.choice(sorted(content))
    content[name] = mutated(random_, content[name])
    return ["replay", str(folder_of(work, "recording", **content)), "--speed", "1000"]


GRAPHS = sorted((ASSETS / "graphs").glob("*.toml"))
SOLID = parts.small_solid()
UNIT = to_toml(load_preset("mu-1.0x")).encode()
FINGER = ASSETS / "examples" / "stronger-finger" / "design.toml"
SIMULATE = ["simulate", "--preset", "mu-1.0x", *COARSE]


RESUMED = {
    "cache": lambda path: path.suffix == ".npz",
    "JSON": lambda path: path.suffix in (".json", ".ndjson"),
}


def kinds(study, placed):
    """Makes the words of a command with one damaged file, by kind.

    study, placed: folders of a finished `simulate`, whose inputs are damaged, and of a finished `place`.
    """
    again = "resume", "FOLDER", "--no-report", "--workers", "1"
    resumed = {name: folder_with_one_damaged(placed, *again, only=only) for name, only in RESUMED.items()}
    resumed["study"] = folder_with_one_damaged(
        study, *again, only=lambda path: path.suffix == ".toml" or path.name == "protocol.csv"
    )
    stl = stl_bytes(SOLID.vertices, SOLID.triangles)
    small = CORPUS["STL"][1](study)
    return resumed | {
        "unit": one_file("unit.toml", UNIT, "design", "--unit", "FILE", "--no-report"),
        "protocol": one_file(
            "p.csv", (ASSETS / "protocols" / "grasp.csv").read_bytes(), *SIMULATE, "--protocol", "FILE"
        ),
        "model": one_file("model.toml", MODEL.encode(), *SIMULATE, "--model", "FILE"),
        "design": one_file("design.toml", FINGER.read_bytes(), "optimize", "FILE", "--no-report"),
        "graph": tree,
        "chain": chain,
        "experiments": folder_with_one_damaged(DATA / "measured", "diagnose", "FOLDER", "--no-report"),
        "STL": one_file("part.stl", stl, "check", "--stl", "FILE", "--no-report"),
        "small STL": one_file("part.stl", small, "check", "--stl", "FILE", "--repair", "--no-report"),
        "lab CSV": one_file("lab.csv", LAB_FILE, "import", "FILE"),
        "recording": replay,
    }


def remembered(module, name):
    """Have a module's function answer from memory what it was asked before, by what it is given."""
    function, kept = getattr(module, name), {}

    def call(*given, **named):
        # Those who are told how far it is are no part of what is computed.
        asked = [value for value in (*given, *sorted(named.items())) if not holds_a_function(value)]
        asked = pickle.dumps(asked)
        if asked not in kept:
            kept[asked] = function(*given, **named)
        return kept[asked]

    setattr(module, name, call)


def holds_a_function(value):
    return callable(value) or (isinstance(value, tuple) and any(map(callable, value)))


def placed_in(folder):
    """A finished `place` in a folder, computed by this process; what it finds by file."""
    for module, name in ((design, "build_solid"), (light, "fit_law"), (light, "traced_signal")):
        remembered(module, name)
    status, messages = ran(started(PLACEMENT), folder)
    assert status == 0, messages[-1]
    return held(folder)


def held(folder):
    """What a folder's files hold, by name: of an archive its arrays, for not every bit of it is of these."""
    found = results(folder)
    for name in [name for name in found if name.endswith(".npz")]:
        with np.load(io.BytesIO(found[name])) as arrays:
            found[name] = {part: (values.dtype, values.tobytes()) for part, values in arrays.items()}
    return found


def forked(words, told):
    """Exit status, or minus a signal, of a command line in a fork, and its memory; told: what it says."""
    child = os.fork()
    if not child:
        out = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        null = os.open(os.devnull, os.O_RDONLY)
        for descriptor, to in ((null, 0), (out, 1), (out, 2)):
            os.dup2(descriptor, to)
        signal.setitimer(signal.ITIMER_PROF, SECONDS[0])
        status = 99
        try:
            status = command_line.main(words)
        except SystemExit as ended:
            status = ended.code
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    end = time.monotonic() + HUNG_S
    while time.monotonic() < end:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), usage.ru_maxrss / 1e3
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None, 0.0


def process(words, told):
    """The same of a real process."""

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (20, 40))

    with open(told, "wb") as out:
        line = [sys.executable, str(ROOT / "headless" / "run.py"), *words]
        done = subprocess.run(
            line, stdin=subprocess.DEVNULL, stdout=out, stderr=out, preexec_fn=limit, check=False
        )
    # The processor's time of the one that works is at its end.
    return (-signal.SIGPROF if done.returncode == 71 and b"SIGXCPU" in told.read_bytes() else
            done.returncode), 0.0  # fmt: skip


def wrong_with(status, words):
    """What is wrong with how a command ended, or nothing."""
    if status is None:
        return "hung"
    if "Traceback" in words:
        return "a stack"
    if status == -signal.SIGPROF:
        return ""
    if status not in WELL:
        return f"status {status}"
    if status and "what to do" not in words:
        return "no word of what to do"
    return ""


def attack(work, make, count, seed, run, reference=None):
    """Ends by kind, the most memory in MB, and what went wrong, with the command's words and files.

    reference: what a folder that was damaged and computed must hold, by file.
    """
    ends, most, faults = Counter(), 0.0, []
    for number in range(count):
        place = work / "here"
        place.mkdir()
        words = make(place, random.Random(f"{seed} {number}"))
        if words[0] != "resume":
            words += ["--out", str(place / "out")]
        status, memory = run(words, place / "told.txt")
        said = (place / "told.txt").read_bytes().decode("utf-8", "replace")
        ends["at work" if status == -signal.SIGPROF else "computed" if status == 0 else "refused"] += 1
        most = max(most, memory)
        fault = wrong_with(status, said)
        if not fault and status == 0 and reference is not None:
            found = held(place / "folder")
            other = [name for name in sorted({*found, *reference}) if found.get(name) != reference.get(name)]
            fault = f"other results: {', '.join(other)}" if other else ""
        if fault:
            faults.append(f"{number}: {fault}\n{said[-2000:]}")
            shutil.copytree(place, work / f"fault-{len(faults)}", dirs_exist_ok=True)
        shutil.rmtree(place)
    return ends, most, faults


def same_angles(study, work, count, seed):
    """How many studies of so many, entries of whose cache were damaged, found other angles, or none."""
    reference, wrong = (study / "motion.csv").read_bytes(), 0
    for number in range(count):
        random_, folder = random.Random(f"angles {seed} {number}"), work / "again"
        shutil.copytree(study, folder)
        for path in sorted(folder.glob("cache/*.npz")):
            path.write_bytes(mutated(random_, path.read_bytes()))
        (folder / "motion.csv").unlink()
        line = [sys.executable, str(ROOT / "headless" / "run.py"), "resume", str(folder), "--no-report"]
        status = subprocess.run(line, capture_output=True, check=False).returncode
        wrong += status != 0 or (folder / "motion.csv").read_bytes() != reference
        shutil.rmtree(folder)
    return wrong


def main():
    parser = options_of(__doc__)
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--files", type=int, default=200)
    parser.add_argument("--processes", type=int, default=5)
    parser.add_argument("--seed", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=SECONDS[0], help="of the processor's, for a file")
    parser.add_argument("--keep", type=Path, help="folder for the files of what goes wrong")
    given = parser.parse_args()
    SECONDS[0] = given.seconds
    for name in studies.STUDIES:
        studies.study(name)
    print(circumstances(), f"Seed {given.seed}.\n")
    print_head("kind", "computed", "refused", "at work", "in processes", "MB at most", "wrong")
    every = []
    with tempfile.TemporaryDirectory() as name:
        work = given.keep or Path(name)
        study = Path(name) / "reference"
        assert command_line.main([*SIMULATE, "--out", str(study)]) == 0
        assert json.loads((study / "summary.json").read_text())["status"] == "complete"
        assert np.isfinite(np.loadtxt(study / "motion.csv", delimiter=",", comments="#", skiprows=1)).all()
        placed = Path(name) / "placed"
        reference = placed_in(placed)
        found = kinds(study, placed)
        for kind in given.kinds or found:
            place = work / kind.replace(" ", "-")
            place.mkdir(parents=True, exist_ok=True)
            same = reference if kind in RESUMED else None
            ends, most, faults = attack(place, found[kind], given.files, f"{kind} {given.seed}", forked, same)
            more, _, others = attack(
                place, found[kind], given.processes, f"{kind} {given.seed} process", process, same
            )
            every += [f"{kind} {fault}" for fault in [*faults, *others]]
            shares = " | ".join(str(ends[end]) for end in ("computed", "refused", "at work"))
            real = ", ".join(f"{n} {end}" for end, n in more.items())
            print(f"| {kind} | {shares} | {real} | {most:.0f} | {len(faults) + len(others)} |", flush=True)
        wrong = same_angles(study, Path(name), given.processes, given.seed)
        print(f"\n{given.processes} studies with all entries of their cache damaged: {wrong} not the same.")
    for fault in every:
        print(f"\n{fault}")


if __name__ == "__main__":
    main()
