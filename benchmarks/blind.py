"""Blind battery on Dask: `python -m benchmarks.blind --minutes 30`; prints rates, draws confusions and power.

Each set is ordered from an injector in another process, judged from its folder alone, and then revealed.
Every finished set is a line of --rows at once; a rerun goes on where the file ends, and leaves out lines
that other code judged. Workers elsewhere (--scheduler) run in a checkout of the same code.
"""

import argparse
import collections
import hashlib
import itertools
import json
import secrets
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from benchmarks.circumstances import circumstances
from mu_addon.evidence.effect import SLIP
from mu_addon.evidence.prediction.unit_pressure import TIMED
from mu_addon.run.processes import one_thread_each
from tests.blind import unit_runs
from tests.blind.injector import OUTSIDE
from tests.blind.judge import CHANGES, IN_SET, TELLABLE, fingerprint, judged
from tests.blind.machines import BENCHES
from tests.evidence.analytic import STATIC

PARTS = (
    "clean",
    "one",
    "two",
    "outside",
    "unidentifiable",
    "mesh",
    "invariance",
    "gain",
    "coverage",
    "kinds",
)
# Absorbed by modulus and zeros whatever their size, so that they have no detection limit.
REFUSED = {
    "pressure_gain": {"pressure_gain.gain": 0.08},
    "leak": {"leak.conductance_ratio": 0.1},
    "angle_offset": {"angle_offset.offset_deg": 2.0},
}
EFFECTS = [e.name for e in TIMED if e.name not in REFUSED] + [*STATIC, SLIP]
TIMES = (1.0, 2.0, 4.0, 10.0)
# Alike in what they do to these data, and unlike.
NEAR = (
    ("line_lag", "viscoelasticity"),
    ("wall_thickness", "strain_stiffening"),
    ("clock_offset", "line_lag"),
)
FAR = (
    ("rate_independent_hysteresis", "gravity"),
    ("clogged_chamber", "viscoelasticity"),
    ("mullins_softening", "pressure_offset"),
    ("overcure", "line_lag"),
)
RIGHT = ("exact",)
# Memory of a worker, many times what a set takes.
MEMORY = "2GiB"


def orders(sets, seed, parts, times, most):
    """Orders, so interleaved that any beginning of the list is a fair share of all parts."""
    found = []

    def add(part, number, i, **order):
        found.append({"part": part, "seed": seed + 100_000 * number + i, "most": most, **order})

    simulated = ("viscoelasticity", "rate_independent_hysteresis", "pressure_offset", *unit_runs.SIZES)
    for i in range(sets):
        if "clean" in parts:
            for k in range(10):
                colour = ("one", "one", "two", "white")[k % 4]
                add("clean", 1, 10 * i + k, noise=colour)
        if "one" in parts:
            for t, size in enumerate(times):
                for k, e in enumerate(EFFECTS):
                    # Every second time a size comes up, an effect of both units is the simulated one's.
                    fem = (i + t) % 2 == 1 and e in simulated
                    unit = {"unit": "simulated", "most": min(most, 6)} if fem else {}
                    add("one", 10 + k, 10 * i + t, effect=e, times=size, **unit)
                for k, e in enumerate(e for e in simulated if e not in EFFECTS):
                    add("one", 30 + k, 10 * i + t, effect=e, times=size, unit="simulated", most=min(most, 6))
        if "two" in parts:
            for k, pair in enumerate((*NEAR, *FAR)):
                add("two", 40 + k, i, effect=list(pair), times=8.0)
        if "outside" in parts:
            for k, e in enumerate(OUTSIDE):
                for t, size in enumerate((4.0, 10.0)):
                    add("outside", 50 + k, 2 * i + t, effect=e, times=size)
        if "unidentifiable" in parts:
            for k, (e, values) in enumerate(REFUSED.items()):
                add("unidentifiable", 60 + k, i, effect=e, values=values)
            gain = REFUSED["pressure_gain"]
            add("unidentifiable", 64, i, effect="pressure_gain", values=gain, dead_load=True)
        if "mesh" in parts:
            add("mesh", 70, i, effect="mesh_error", unit="simulated", level=0.03 + 0.01 * (i % 5), most=6)
        if "invariance" in parts:
            for k, e in enumerate((None, "rate_independent_hysteresis", "overcure")):
                add("invariance", 80 + k, i, effect=e, times=5.0, changes=list(CHANGES), most=4)
        if "gain" in parts:
            e = ("viscoelasticity", "rate_independent_hysteresis", "overcure", "gravity", "clogged_chamber")
            add("gain", 90, i, effect=e[i % 5], times=6.0, held_out=True)
        if "coverage" in parts:
            for k, e in enumerate(EFFECTS):
                add("coverage", 100 + k, i, effect=e, times=10.0)
        if "kinds" in parts:
            for b, (kind, bench) in enumerate(BENCHES.items()):
                for k, colour in enumerate(("one", "two")):
                    add("kinds", 200 + 20 * b, 10 * i + k, unit=kind, noise=colour)
                for k, e in enumerate(bench.effects, 1):
                    for t, size in enumerate(times):
                        add("kinds", 200 + 20 * b + k, 10 * i + t, unit=kind, effect=e, times=size)
    return found


def key_of(order):
    return hashlib.sha256(json.dumps(order, sort_keys=True).encode()).hexdigest()[:16]


def known(path, code):
    """Rows of the file that this code judged, by the key of their order; half a line ends the file."""
    rows = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue
        if row.get("code") == code:
            rows[row["key"]] = row
    return rows


@contextmanager
def workers(scheduler, many):
    """A Dask client: of that scheduler, or of so many processes here with a thread each."""
    from dask.distributed import Client, LocalCluster

    if scheduler:
        with Client(scheduler) as client:
            yield client
        return
    with (
        one_thread_each(),
        LocalCluster(
            n_workers=many,
            threads_per_worker=1,
            memory_limit=MEMORY,
            host="127.0.0.1",
            dashboard_address=None,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def run(client, todo, path, until):
    """Judge orders until the list or the time ends; each row is in the file as soon as it is known."""
    from dask.distributed import as_completed

    waiting = iter(todo)
    at_once = 2 * max(len(client.nthreads()), 1)

    def submit(order):
        return client.submit(judged, order, key=f"set-{key_of(order)}", pure=False, retries=1)

    def more(many):
        return [submit(o) for o in itertools.islice(waiting, many)] if time.time() < until else []

    path.parent.mkdir(parents=True, exist_ok=True)
    orders_ = {f"set-{key_of(o)}": o for o in todo}
    queue = as_completed(more(at_once))
    done, failed = 0, 0
    for future in queue:
        order = orders_[future.key]
        if future.status == "error":
            failed += 1
            print(f"failed: {order}: {future.exception()}", file=sys.stderr, flush=True)
        else:
            row = {"key": key_of(order), "order": order, **future.result()}
            with path.open("a") as stream:
                stream.write(json.dumps(row, default=float) + "\n")
            done += 1
            if done % 20 == 0:
                print(f"{done} of {len(todo)}", file=sys.stderr, flush=True)
        for other in more(1):
            queue.add(other)
    return failed


def rate(rows, outcomes):
    return counted(sum(r["outcome"] in outcomes for r in rows), len(rows))


def counted(hit, n):
    """A share with its exact interval of 95 %."""
    from scipy.stats import binomtest

    if not n:
        return "none"
    low, high = binomtest(hit, n).proportion_ci(method="exact")
    return f"{hit}/{n}, {100 * hit / n:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def named(row):
    return "+".join(row["names"]) or row["verdict"]


def called(rows):
    return ", ".join(f"{n} {k}" for k, n in collections.Counter(named(r) for r in rows).most_common(4))


def tellable(rows):
    """Without sets that were not exact and whose data, free of noise, a rival fits so that any judge errs."""
    return [r for r in rows if r["outcome"] in RIGHT or not r["nearest"] or r["nearest"][0] >= TELLABLE]


def report(rows):
    """The battery in words and tables, as Markdown."""
    gone = sum(bool(r["impossible"]) for r in rows)
    rows = [r for r in rows if not r["impossible"]]
    by = collections.defaultdict(list)
    for r in rows:
        by[r["part"]].append(r)
    seconds = sorted(r["seconds"] for r in rows)
    lines = [f"{len(rows)} sets, {gone} more orders beyond the bounds of their effect; "]
    lines[0] += (
        f"median {seconds[len(seconds) // 2]:.0f} s, longest {seconds[-1]:.0f} s a set" if rows else ""
    )
    lines += ["", "| what | rate (95 %) |", "| --- | --- |"]

    def line(what, rate):
        if rate != "none":
            lines.append(f"| {what} | {rate} |")

    clean = by["clean"]
    line("clean: a cause named, or several to choose from", rate(clean, ("false", "false_set")))
    for colour in ("one", "two", "white"):
        own = [r for r in clean if r["order"].get("noise") == colour]
        line(f"clean, noise {colour}: verdict none", rate(own, ("clean",)))
    for times in sorted({r["times"] for r in by["one"]}):
        here = [r for r in by["one"] if r["times"] == times]
        line(f"one effect, {times:g} x its limit: exact", rate(here, RIGHT))
        if times >= 4:
            line(
                f"{times:g} x: exact, where no rival fits the data without noise", rate(tellable(here), RIGHT)
            )
        line(f"{times:g} x: truth in the set", rate(here, IN_SET))
        line(f"{times:g} x: wrong with confidence", rate(here, ("wrong",)))
        line(f"{times:g} x: wrong set", rate(here, ("wrong_set",)))
        line(f"{times:g} x: missed (none)", rate(here, ("none",)))
    kinds = by["kinds"]
    line(
        "other kinds, clean: a cause named",
        rate([r for r in kinds if not r["effect"]], ("false", "false_set")),
    )
    for times in sorted({r["times"] for r in kinds if r["effect"]}):
        here = [r for r in kinds if r["effect"] and r["times"] == times]
        line(f"other kinds, {times:g} x: exact", rate(here, RIGHT))
        if times >= 4:
            line(
                f"other kinds, {times:g} x: exact, where no rival fits without noise",
                rate(tellable(here), RIGHT),
            )
        line(f"other kinds, {times:g} x: truth in the set", rate(here, IN_SET))
        line(f"other kinds, {times:g} x: wrong with confidence", rate(here, ("wrong",)))
        line(f"other kinds, {times:g} x: missed (none)", rate(here, ("none",)))
    for what, pairs in (("near", NEAR), ("far", FAR)):
        own = [r for r in by["two"] if tuple(r["effect"]) in pairs]
        line(f"two effects, {what}: exact", rate(own, RIGHT))
        line(f"two effects, {what}: both in the set", rate(own, IN_SET))
        line(f"two effects, {what}: only a part named", rate(own, ("partly",)))
        line(f"two effects, {what}: wrong with confidence", rate(own, ("wrong",)))
    for times in sorted({r["times"] for r in by["outside"]}):
        own = [r for r in by["outside"] if r["times"] == times]
        line(f"outside the library, {times:g} x: unexplained", rate(own, ("unexplained",)))
        fair = [r for r in own if not r["nearest"] or r["nearest"][0] >= TELLABLE]
        line(
            f"outside, {times:g} x, where no effect fits the data without noise", rate(fair, ("unexplained",))
        )
        line(f"outside the library, {times:g} x: a confident name", rate(own, ("wrong",)))
    own = [r for r in by["unidentifiable"] if not r["order"].get("dead_load")]
    refused = [not r["names"] and r["effect"][0] in r["identifiability"] for r in own]
    line("unidentifiable: refused, and said why", counted(sum(refused), len(own)))
    own = [r for r in by["unidentifiable"] if r["order"].get("dead_load")]
    line("the same with a dead load: in the set", rate(own, IN_SET))
    own = by["mesh"]
    line("fine mesh judged by a coarse one: mesh_error named", rate(own, RIGHT))
    line("fine mesh judged by a coarse one: wrong with confidence", rate(own, ("wrong",)))
    for change in CHANGES:
        same = [s[1] for r in by["invariance"] for s in r["same"] if s[0] == change]
        line(f"the same verdict: {change}", counted(sum(same), len(same)))
    own = [r for r in by["gain"] if r["outcome"] in IN_SET and r["gain"]]
    better = [
        r["gain"]["rmse_after"]
        < min(r["gain"]["rmse_before"], r["gain"]["rmse_permuted"], r["gain"]["rmse_black_box"])
        for r in own
    ]
    line("held-out rate, orientation, scale: better than base and all nulls", counted(sum(better), len(own)))
    parameters = [
        p
        for r in (*by["one"], *by["coverage"], *kinds)
        if r["outcome"] in RIGHT and r["times"] >= 4
        for p in r["parameters"]
    ]
    line(
        "parameters of named effects within their 95 %",
        counted(sum(p[4] for p in parameters), len(parameters)),
    )
    lines += ["", "| effect | unit | exact | in the set | called |", "| --- | --- | --- | --- | --- |"]
    strong = [r for r in (*by["one"], *by["coverage"], *kinds) if r["effect"] and r["times"] >= 4]
    for name, unit in sorted({(r["effect"][0], r["unit"]) for r in strong}):
        own = [r for r in strong if r["effect"][0] == name and r["unit"] == unit]
        hits = [sum(r["outcome"] in o for r in own) for o in (RIGHT, IN_SET)]
        lines.append(f"| {name} | {unit} | {hits[0]}/{len(own)} | {hits[1]}/{len(own)} | {called(own)} |")
    for effect in OUTSIDE:
        own = [r for r in by["outside"] if r["effect"][0] == effect]
        if own:
            lines.append(f"| {effect} (outside) | written | | | {called(own)} |")
    return "\n".join(lines)


def unit_confusion(rows, path):
    """What was true against what was called of the unit, at four times the limit and more."""
    parts = ("clean", "one", "outside", "coverage", "mesh")
    known = [*dict.fromkeys(EFFECTS), *(s for s in unit_runs.SIZES if s not in EFFECTS)]
    confusion_picture(
        [r for r in rows if r["part"] in parts],
        path,
        ["clean", *known, *OUTSIDE],
        known,
        lambda r: r["effect"][0] if r["effect"] else "clean",
        "\nbelow the line: outside the library",
    )


def kinds_confusion(rows, path):
    """The same of the other kinds of experiment."""

    def truth(unit, effect):
        return f"{unit}: {effect}"

    truths = [truth(kind, e) for kind, bench in BENCHES.items() for e in ("clean", *bench.effects)]
    known = list(dict.fromkeys(e for bench in BENCHES.values() for e in bench.effects))
    confusion_picture(
        [r for r in rows if r["part"] == "kinds"],
        path,
        truths,
        known,
        lambda r: truth(r["unit"], r["effect"][0] if r["effect"] else "clean"),
    )


def confusion_picture(rows, path, truths, known, truth_of, more=""):
    """Shares of the sets of each truth that were called each known effect."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    rows = [r for r in rows if not r["impossible"] and (not r["effect"] or r["times"] >= 4)]
    if not rows:
        return
    answers = ["none", *known, "unexplained", "in a set of rivals"]
    counts = np.zeros((len(truths), len(answers)))
    for r in rows:
        if r["outcome"] in ("exact_with_rivals", "in_set"):
            j = len(answers) - 1
        else:
            names = [
                n for n in r["names"] if n != "mesh_error" or r["unit"] != "simulated" or len(r["names"]) == 1
            ]
            first = names[0] if names else r["verdict"]
            j = answers.index(first) if first in answers else answers.index("none")
        counts[truths.index(truth_of(r)), j] += 1
    total = counts.sum(axis=1, keepdims=True)
    shown = np.flatnonzero(total[:, 0])
    share = counts[shown] / total[shown]
    figure, axes = plt.subplots(figsize=(11, 2.5 + 0.27 * len(shown)), dpi=110)
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (i, j), v in np.ndenumerate(share):
        if v:
            axes.text(
                j, i, f"{100 * v:.0f}", ha="center", va="center", fontsize=8, color="w" if v > 0.6 else "k"
            )
    axes.set_xticks(range(len(answers)), [a.replace("_", " ") for a in answers], rotation=60, ha="right")
    axes.set_yticks(range(len(shown)), [f"{truths[i].replace('_', ' ')} ({int(total[i, 0])})" for i in shown])
    inside = sum(truths[i] not in OUTSIDE for i in shown)
    if inside < len(shown):
        axes.axhline(inside - 0.5, color="0.4", lw=1)
    axes.set_xlabel("called (best name; % of the sets of a row)")
    axes.set_ylabel(f"true, at 4 and 10 times its limit (sets){more}")
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)


def power_picture(rows, path):
    """Shares of sets by how many times its limit an effect is."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from scipy.stats import binomtest

    rows = [r for r in rows if r["part"] == "one" and not r["impossible"]]
    times = sorted({r["times"] for r in rows})
    figure, axes = plt.subplots(figsize=(7, 4.5), dpi=110)
    kinds = (
        ("something is wrong", lambda r: r["verdict"] != "none", "0.55", "o--"),
        ("truth in the set", lambda r: r["outcome"] in IN_SET, "tab:blue", "o-"),
        ("named exactly", lambda r: r["outcome"] in RIGHT, "tab:green", "o-"),
        ("wrong with confidence", lambda r: r["outcome"] == "wrong", "tab:red", "o-"),
    )
    for words, test, colour, style in kinds:
        shares, low, high = [], [], []
        for t in times:
            own = [r for r in rows if r["times"] == t]
            hit = sum(map(test, own))
            ends = binomtest(hit, len(own)).proportion_ci()
            shares.append(100 * hit / len(own))
            low.append(100 * ends.low)
            high.append(100 * ends.high)
        axes.plot(times, shares, style, color=colour, label=words)
        axes.fill_between(times, low, high, color=colour, alpha=0.15, lw=0)
    axes.set_xscale("log")
    axes.set_xticks(times, [f"{t:g}" for t in times])
    axes.minorticks_off()
    axes.set_xlabel("size of the effect over its detection limit")
    axes.set_ylabel("sets, % (band: 95 %)")
    axes.set_ylim(-2, 102)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="center right")
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=20, help="of each kind of set (clean: ten times as many)")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, by commas: " + ", ".join(PARTS))
    parser.add_argument("--times", default=",".join(f"{t:g}" for t in TIMES), help="sizes over their limits")
    parser.add_argument("--most", type=int, default=10, help="experiments of a set, at most")
    parser.add_argument("--fresh", action="store_true", help="draw new seeds; the file keeps what was drawn")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop ordering after so many")
    parser.add_argument("--workers", type=int, default=2, help="processes here")
    parser.add_argument("--scheduler", help="a Dask scheduler, tcp://host:port, instead of processes here")
    parser.add_argument("--rows", type=Path, default=Path("blind.ndjson"), help="one JSON line a set")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures")
    args = parser.parse_args()
    parts = args.only.split(",")
    if unknown := set(parts) - set(PARTS):
        parser.error(f"no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    code, began = fingerprint(), circumstances()
    rows = known(args.rows, code)
    seed = 0
    if args.fresh:
        drawn = {r["order"]["battery"] for r in rows.values() if "battery" in r["order"]}
        seed = drawn.pop() if drawn else secrets.randbits(40)
    times = [float(t) for t in args.times.split(",")]
    todo = orders(args.sets, seed, parts, times, args.most)
    if args.fresh:
        todo = [{**o, "battery": seed} for o in todo]
    todo = [o for o in todo if key_of(o) not in rows]
    failed = 0
    if todo and args.minutes > 0:
        with workers(args.scheduler, args.workers) as client:
            failed = run(client, todo, args.rows, time.time() + 60.0 * args.minutes)
    found = [r for r in known(args.rows, code).values() if r["part"] in parts]
    print(f"{began}; judged by {code}\n")
    if not found:
        return 1
    print(report(found))
    if args.pictures:
        args.pictures.mkdir(parents=True, exist_ok=True)
        unit_confusion(found, args.pictures / "evidence-confusion.png")
        kinds_confusion(found, args.pictures / "evidence-kinds.png")
        power_picture(found, args.pictures / "evidence-power.png")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
