"""Faults done to a study, to its process, its disk and its files, and the digits that it finds after them.

    python -m benchmarks.faults                 # all, 50 kills
    python -m benchmarks.faults --kills 5 disk  # some of them
    python -m benchmarks.faults --every 4 calls # a quarter of the calls that can fail
    python -m benchmarks.faults --every 4 --first 2 blocks # the second quarter of blocks of memory
    python -m benchmarks.faults --seed 7 kills  # at other moments
    python -m benchmarks.faults --small kills   # to three chambers at two pressures

The study is the main job on a coarse mesh. Whatever is done to it, the same command must then find the same
deviations, to the last digit, as a run that nothing happened to.
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
import pytest

from benchmarks.table import ROOT, circumstances, options_of, print_head
from mu_addon.errors import MuError, OutputError
from mu_addon.run.context import run_to_end
from mu_addon.run.execution import Execution
from mu_addon.run.folder import keep_inputs
from mu_addon.run.progress import Progress
from mu_addon.studies.starting import begin_study
from tests.headless.test_resume import JOB as COARSE
from tests.run.failing_files import failing
from tests.run.failing_memory import short_of_memory
from tests.studies.fault_injection import PARTIAL, PLACEMENT, inject_each, placement

JOBS = {
    False: COARSE,
    # Two states of three chambers, for a busy machine.
    True: PLACEMENT,
}
JOB = [JOBS[False]]
SEED = [20]
"""Of what is drawn: moments, places, bytes."""


def new(folder):
    keep_inputs(folder, JOB[0].texts())
    return folder


def start(folder, **options):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *options.pop("path", [])])}
    command = [
        sys.executable,
        str(ROOT / "headless" / "run.py"),
        "resume",
        str(folder),
        "--no-report",
        "--json",
    ]
    return subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env=environment, **options,
    )  # fmt: skip


def finish(folder, **options):
    """Exit status of a run to its end, and its last message."""
    process = start(folder, **options)
    output, _ = process.communicate()
    lines = output.splitlines()
    return process.returncode, json.loads(lines[-1]) if lines else {}


def digits(folder):
    """Every array that the study found, by name."""
    with np.load(folder / "delta.npz") as stored:
        return {name: stored[name].tobytes() for name in stored.files}


def mended(folder, reference):
    """Whether the same command goes on to the same digits."""
    status, _ = finish(folder)
    return "same digits" if status == 0 and digits(folder) == reference else f"FAILED (exit {status})"


def kills(work, reference, count):
    """SIGKILL at moments spread evenly over a run, again and again until each run is through.

    Each run is a fork of this process, which has imported all there is to import: that alone would otherwise
    take most of the time, and most of the kills.
    """
    rng = np.random.default_rng(SEED)
    begun = time.monotonic()
    assert os.waitstatus_to_exitcode(os.waitpid(forked(new(work / "timed")), 0)[1]) == 0
    seconds = time.monotonic() - begun
    folder, number, done, stages, sound = new(work / "kill0"), 0, 0, Counter(), 0
    while done < count:
        child, end = forked(folder), time.monotonic() + rng.uniform(0, seconds)
        ended = 0
        while not ended and time.monotonic() < end:
            time.sleep(0.005)
            ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            sound += same(folder, reference, os.waitstatus_to_exitcode(status))
            number += 1
            folder = new(work / f"kill{number}")
        else:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            done += 1
            stages[stage_of(folder)] += 1
    status, _ = finish(folder)
    sound += same(folder, reference, status)
    where = ", ".join(f"{name} {n}" for name, n in stages.most_common())
    yield (
        f"kill -9 at {count} random moments ({where})",
        f"{sound} of the {number + 1} studies that they hit came to an end with the same digits",
    )


def crashes(work, reference, count):
    """The process that does a command's work is ended by a signal, as by a library that crashes.

    At moments spread evenly over a run, each run hit once, then run again to its end.
    """
    rng = np.random.default_rng([*SEED, 1])
    begun = time.monotonic()
    assert finish(new(work / "whole"))[0] == 0
    seconds = time.monotonic() - begun
    signals = signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL
    wrong, stages, ended_before = [], Counter(), 0
    for number in range(count):
        folder, kind = new(work / f"crash{number}"), signals[number % len(signals)]
        process = start(folder)
        # Python alone takes some tenths of a second to start.
        time.sleep(rng.uniform(0.5, seconds))
        worker = worker_of(process.pid)
        if worker is not None:
            os.kill(worker, kind)
        output, _ = process.communicate()
        message = json.loads(output.splitlines()[-1])
        if process.returncode == 0:
            ended_before += 1
        else:
            stages[stage_of(folder)] += 1
            clear = message["type"] == "error" and kind.name in message["what"] and message["what_to_do"]
            if process.returncode != 71 or not clear:
                wrong.append(f"{kind.name}: exit {process.returncode}, {message}")
            if "running" in state_of(folder):
                wrong.append(f"{kind.name}: summary.json says {state_of(folder)}")
        status, _ = finish(folder)
        if not same(folder, reference, status):
            wrong.append(f"{kind.name} in {stage_of(folder)}: exit {status} afterwards, or other digits")
        shutil.rmtree(folder)
    where = ", ".join(f"{name} {n}" for name, n in stages.most_common())
    yield (
        f"SIGSEGV, SIGABRT, SIGKILL by turns to the process that works, {count - ended_before} runs "
        f"({where})",
        "; ".join(wrong)
        or "each time exit 71 with stage and what to do, no summary that says running; then same digits",
    )


def worker_of(pid):
    """Number of the process that a command's own process watches, or None."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return None
    return int(children[0]) if children else None


def state_of(folder):
    try:
        return json.loads((folder / "summary.json").read_text())["status"]
    except (OSError, ValueError):
        return "nothing"


def forked(folder):
    """Process number of a run of the folder's study, a fork of this process."""
    child = os.fork()
    if child:
        return child
    status = 70
    try:
        with run_to_end(Progress()) as context:
            job = attrs.evolve(JOB[0], workers=1)
            begin_study(job, folder, context)
            Execution(job, folder, context).run()
        status = context.status
    finally:
        os._exit(status)


def same(folder, reference, status):
    return status == 0 and digits(folder) == reference


def stage_of(folder):
    try:
        messages = [json.loads(line) for line in (folder / "log.ndjson").read_text().splitlines()]
    except (OSError, ValueError):
        return "start"
    running = [m["stage"] for m in messages if m["type"] == "progress" and m["state"] in ("start", "run")]
    return running[-1] if running else "start"


def wait_for(process, folder, pattern):
    """Until the study has written a file of that pattern."""
    while process.poll() is None and not list(folder.glob(pattern)):
        time.sleep(0.01)


def disk(work, reference):
    """A disk of its own, filled or made read-only while the study runs on it."""
    mount = work / "disk"
    mount.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=60M", "none", mount], capture_output=True)
    if made.returncode:
        yield "a full disk", "not tried: no right to mount one"
        yield "a disk made read-only", "not tried: no right to mount one"
        return
    try:
        (mount / "filler").write_bytes(b"x" * 40_000_000)
        status, message = finish(new(mount / "study"))
        yield "20 MB free before it starts", f'exit {status} at once, "{message["what"]}"'
        (mount / "filler").unlink()
        subprocess.run(["mount", "-o", "remount,ro", mount], check=True)
        status, message = finish(mount / "study")
        subprocess.run(["mount", "-o", "remount,rw", mount], check=True)
        yield "the disk is read-only before it starts", f'exit {status}, "{message["what"]}"'
        for pattern, what in (
            ("cache/meshed-*", "after the mesh"),
            ("cache/candidates-*", "among the candidates"),
        ):
            folder = new(mount / what.split()[-1])
            process = start(folder)
            wait_for(process, folder, pattern)
            fill(mount / "filler")
            message = json.loads(process.communicate()[0].splitlines()[-1])
            half = [p.name for p in folder.rglob("*.part*")]
            (mount / "filler").unlink()
            outcome = f'exit {process.returncode}, "{message["what"]}"; {len(half)} half files'
            yield f"the disk is full {what}", f"{outcome}; then {mended(folder, reference)}"
            shutil.rmtree(folder)
        folder = new(mount / "again")
        process = start(folder)
        wait_for(process, folder, "cache/states-*")
        # Busy while a file is open for writing: tried until it is not.
        while subprocess.run(["mount", "-o", "remount,ro", mount], capture_output=True).returncode:
            time.sleep(0.005)
            if process.poll() is not None:
                break
        message = json.loads(process.communicate()[0].splitlines()[-1])
        subprocess.run(["mount", "-o", "remount,rw", mount], check=True)
        yield (
            "the disk is made read-only while it runs",
            f'exit {process.returncode}, "{message["what"]}"; then {mended(folder, reference)}',
        )
    finally:
        subprocess.run(["umount", mount], check=False)


def full_disks(work, reference, count):
    """A disk that is full from a random moment of the run on, with some room left or none."""
    rng = np.random.default_rng([*SEED, 2])
    mount = work / "filling"
    mount.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=60M", "none", mount], capture_output=True
    ).returncode:
        yield "full disks", "not tried: no right to mount one"
        return
    wrong, met, finished = [], Counter(), 0
    try:
        begun = time.monotonic()
        assert finish(new(mount / "timed"))[0] == 0
        seconds = time.monotonic() - begun
        shutil.rmtree(mount / "timed")
        for number in range(count):
            folder, left = new(mount / f"study{number}"), int(rng.choice([0, 4096, 200_000, 2_000_000]))
            process = start(folder)
            time.sleep(rng.uniform(0.5, seconds))
            fill(mount / "filler", left)
            output, _ = process.communicate()
            message = json.loads(output.splitlines()[-1])
            if process.returncode == 0:
                finished += 1
            elif process.returncode != 5 or not message.get("what_to_do"):
                wrong.append(f"exit {process.returncode}, {message}")
            else:
                met[message["what"].removeprefix("cannot write ").split(":")[0]] += 1
            half = [p.name for p in folder.rglob("*.part*")]
            if half or state_of(folder) == "running":
                wrong.append(f"{half} half, summary.json says {state_of(folder)}")
            (mount / "filler").unlink()
            if (outcome := mended(folder, reference)) != "same digits":
                wrong.append(outcome)
            shutil.rmtree(folder)
    finally:
        subprocess.run(["umount", mount], check=False)
    where = ", ".join(f"{name} {n}" for name, n in met.most_common())
    yield (
        f"a disk full from a random moment on, {count} times; {finished} had room for all they still wrote",
        "; ".join(wrong) or f"exit 5 at {where}; no half file; then same digits",
    )


def fill(path, left=0):
    """Take all room of a disk but the `left` last bytes."""
    with path.open("wb", buffering=0) as stream:
        try:
            while True:
                stream.write(b"x" * 65536)
        except OSError:
            pass
        stream.truncate(max(path.stat().st_size - left, 0))


def calls(work, reference, every, first):
    """Each call that changes a file of a `place` of three chambers fails, by turns once and for good."""
    yield place_with(work / "calls", "calls that change a file", failing, OutputError.status, every, first)


def blocks(work, reference, every, first):
    """Each block of 64 kB and more that numpy asks for in that `place` is refused, likewise."""
    yield place_with(
        work / "blocks",
        "blocks of memory of 64 kB and more",
        lambda _, at, for_good: short_of_memory(at, for_good),
        MuError.status,
        every,
        first,
    )


def place_with(work, what, layer, expected, every, first):
    """A whole `place` with a fault at each place of it; what has been computed comes from memory."""
    work.mkdir()
    met = []

    def counted(*where):
        met.append(where)
        return layer(*where)

    with pytest.MonkeyPatch.context() as patch:
        wrong = inject_each(placement(patch), work, counted, expected, PARTIAL, every, first)
    return (
        f"{len(met) - 1} times one of the {what} of a whole `place` fails",
        "; ".join(wrong) or f"exit 0 or {expected} with what to do, no half file; then same digits",
    )


FAULTS = {
    "calls": calls,
    "blocks": blocks,
    "kills": kills,
    "crashes": crashes,
    "disk": disk,
    "full_disks": full_disks,
}


def main():
    parser = options_of(__doc__)
    parser.add_argument("faults", nargs="*", choices=[*FAULTS, []], help=", ".join(FAULTS))
    parser.add_argument("--small", action="store_true", help="the study has three chambers and two pressures")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--crashes", type=int, default=12)
    parser.add_argument("--disks", type=int, default=10)
    parser.add_argument("--seed", type=int, default=SEED[0])
    parser.add_argument(
        "--every", type=int, default=1, help="of the calls and blocks that can fail only each N-th fails"
    )
    parser.add_argument("--first", type=int, default=1, help="the first call or block that fails")
    parser.add_argument("--reference", type=Path, help="a folder of this study, finished, to compare with")
    given = parser.parse_args()
    SEED[0], JOB[0] = given.seed, JOBS[given.small]
    places = given.every, given.first
    counts = {"kills": (given.kills,), "crashes": (given.crashes,), "full_disks": (given.disks,)}
    counts |= {"calls": places, "blocks": places}
    print(circumstances(), f"Seed {given.seed}.")
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        if given.reference is None:
            before = time.monotonic()
            status, message = finish(new(work / "reference"))
            assert status == 0, message
            print(f"A run that nothing happens to takes {time.monotonic() - before:.0f} s.\n")
        else:
            shutil.copytree(given.reference, work / "reference")
        reference = digits(work / "reference")
        print_head("fault", "what came of it")
        for fault in given.faults or FAULTS:
            for what, outcome in FAULTS[fault](work, reference, *counts.get(fault, ())):
                print(f"| {what} | {outcome} |", flush=True)


if __name__ == "__main__":
    main()
