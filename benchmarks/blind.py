"""Blind battery: `python -m benchmarks.blind --sets 10 --processes 2`; prints rates, confusions, power.

Each set is ordered from an injector in another process, judged from its folder alone, and then revealed.
"""

import argparse
import collections
import json
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from mu_addon.evidence.prediction.unit import TIMED
from tests.blind.injector import OUTSIDE
from tests.blind.judge import judged
from tests.evidence.analytic import STATIC

# Absorbed by modulus and zeros whatever their size, so that they have no detection limit.
REFUSED = {
    "pressure_gain": {"pressure_gain.gain": 0.08},
    "leak": {"leak.conductance_ratio": 0.1},
    "angle_offset": {"angle_offset.offset_deg": 2.0},
}
EFFECTS = [e.name for e in TIMED if e.name not in REFUSED] + list(STATIC)


def orders(sets, seed, parts, times, effects):
    found = []
    if "clean" in parts:
        found += [{"seed": seed + 100_000 + i} for i in range(5 * sets)]
    if "one" in parts:
        found += [
            {"seed": seed + 1000 * k + i, "effect": e, "times": t}
            for i in range(sets)
            for k, e in enumerate(effects)
            for t in times
        ]
    if "outside" in parts:
        found += [
            {"seed": seed + 200_000 + 1000 * k + i, "effect": e, "times": t}
            for i in range(sets)
            for k, e in enumerate(OUTSIDE)
            for t in times
            if t >= 4
        ]
    if "refused" in parts:
        found += [
            {"seed": seed + 300_000 + 1000 * k + i, "effect": e, "values": REFUSED[e]}
            for i in range(sets)
            for k, e in enumerate(REFUSED)
        ]
    return found


def rate(rows, outcomes):
    hit = sum(r["outcome"] in outcomes for r in rows)
    return f"{hit}/{len(rows)} ({100.0 * hit / max(len(rows), 1):.1f} %)"


def report(rows):
    impossible = sum(bool(r["impossible"]) for r in rows)
    rows = [r for r in rows if not r["impossible"]]
    print(f"{len(rows)} sets judged, {impossible} orders out of reach of their bounds")
    seconds = sorted(r["seconds"] for r in rows)
    if seconds:
        print(f"seconds a set: median {seconds[len(seconds) // 2]:.1f}, longest {seconds[-1]:.1f}")
    clean = [r for r in rows if not r["effect"]]
    if clean:
        kinds = collections.Counter(r["verdict"] for r in clean)
        print(f"clean: named {rate(clean, {'false_name'})}; verdicts {dict(kinds)}")
    refused = [r for r in rows if r["effect"] in REFUSED]
    if refused:
        right = sum(not r["names"] and r["effect"] in r["identifiability"] for r in refused)
        print(f"unidentifiable: refused, with the reason, {right}/{len(refused)}")
    inside = [r for r in rows if r["effect"] and r["effect"] not in (*OUTSIDE, *REFUSED)]
    for times in sorted({r["times"] for r in inside}):
        here = [r for r in inside if r["times"] == times]
        print(
            f"{times:g} times the limit: named {rate(here, {'exact'})}, best name true "
            f"{rate(here, {'exact', 'exact_with_rivals'})}, truth in the set "
            f"{rate(here, {'exact', 'exact_with_rivals', 'in_set'})}, "
            f"wrong {rate(here, {'wrong', 'partly'})}, "
            f"missed {rate(here, {'missed'})}"
        )
        for effect in dict.fromkeys(r["effect"] for r in here):
            own = [r for r in here if r["effect"] == effect]
            called = collections.Counter("+".join(r["names"]) or r["verdict"] for r in own)
            marked = collections.Counter(r["outcome"] for r in own)
            print(f"    {effect:28s} {dict(marked)}  called {dict(called)}")
    parameters = [
        p for r in inside if r["outcome"] in ("exact", "exact_with_rivals") for p in r["parameters"]
    ]
    if parameters:
        within = sum(bool(p[4]) for p in parameters)
        share = 100.0 * within / len(parameters)
        print(f"parameters within their bounds of 95 %: {within}/{len(parameters)} ({share:.1f} %)")
    outside = [r for r in rows if r["effect"] in OUTSIDE]
    for times in sorted({r["times"] for r in outside}):
        here = [r for r in outside if r["times"] == times]
        kinds = collections.Counter(r["verdict"] for r in here)
        print(f"outside the library at {times:g} times: {dict(kinds)}")
        for effect in dict.fromkeys(r["effect"] for r in here):
            own = [r for r in here if r["effect"] == effect]
            called = collections.Counter("+".join(r["names"]) or r["verdict"] for r in own)
            print(f"    {effect:28s} called {dict(called)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--parts", default="clean,one,outside,refused")
    parser.add_argument("--times", default="4")
    parser.add_argument("--effects", default=",".join(EFFECTS))
    parser.add_argument("--most", type=int, default=10, help="experiments of a set, at most")
    parser.add_argument("--rows", type=Path, help="file for one JSON line a set")
    args = parser.parse_args()
    times = [float(t) for t in args.times.split(",")]
    todo = [
        {**o, "most": args.most}
        for o in orders(args.sets, args.seed, args.parts.split(","), times, args.effects.split(","))
    ]
    rows = []
    with ProcessPoolExecutor(args.processes) as pool:
        for row in pool.map(judged, todo):
            rows.append(row)
            if args.rows:
                with args.rows.open("a") as stream:
                    stream.write(json.dumps(row, default=str) + "\n")
    report(rows)


if __name__ == "__main__":
    main()
