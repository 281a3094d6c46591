"""The judge's side: orders a hidden bench from another process, judges its folder, then has it revealed."""

import hashlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mu_addon.evidence.verdict import diagnose
from mu_addon.measured import read_folder
from tests.evidence import analytic

ROOT = Path(__file__).parents[2]


def hidden(order, judge):
    """Verdict of `judge(folder)` on an ordered bench, and the answer, whose commitment is checked."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "measured"
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.blind.injector", str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
        commitment = json.loads(process.stdout.readline())["commitment"]
        verdict = judge(folder)
        sealed, _ = process.communicate("reveal\n")
    sealed = sealed.strip()
    assert hashlib.sha256(sealed.encode()).hexdigest() == commitment
    return verdict, json.loads(sealed)


def verdict_of(folder):
    """The engine's verdict on a folder, with the analytic unit as its simulator."""
    experiments = read_folder(folder).experiments
    return diagnose(experiments, analytic.simulator(experiments))


def judged(order):
    """One order as a row of plain data."""
    start = time.perf_counter()
    verdict, answer = hidden(order, verdict_of)
    effect, chosen = answer["effect"], verdict.selection.chosen
    truth = {effect} if isinstance(effect, str) else set(effect or [])
    inside = []
    for key, value in answer["values"].items():
        if key in verdict.intervals and key.split(".")[0] in truth:
            low, high = verdict.intervals[key]
            inside.append((key, value, chosen.values[key], (low, high), low <= value <= high))
    return {
        **{k: answer.get(k) for k in ("effect", "times", "count", "dt", "rho", "impossible")},
        "seed": order["seed"],
        "verdict": verdict.kind,
        "names": list(verdict.names),
        "ambiguity": sorted(verdict.ambiguity),
        "left": list(verdict.selection.left),
        "doubted": verdict.selection.doubted,
        "identifiability": sorted(verdict.identifiability),
        "chosen": list(chosen.names),
        "p_best": verdict.selection.p_best,
        "parameters": inside,
        "seconds": time.perf_counter() - start,
        "outcome": outcome(truth, verdict),
    }


def outcome(truth, verdict):
    """exact, in_set, partly, missed, wrong (named and the truth is not among what it may be), or clean."""
    names = set(verdict.names)
    if not truth:
        return "false_name" if names else "clean"
    if names == truth and verdict.kind == "named":
        return "exact"
    if truth <= verdict.ambiguity:
        return "exact_with_rivals" if names == truth else "in_set"
    if not names:
        return "missed"
    return "partly" if names < truth else "wrong"
