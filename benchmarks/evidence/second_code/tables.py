"""Rates of a battery with their intervals, and every wrong name, as Markdown."""

from __future__ import annotations

import collections
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from .judging import INSTRUMENTS
from .lab import CLEAN

Row = dict[str, Any]
# Error over noise from which on a verdict `none` misleads.
GROSS = 5.0
# Outcomes that name nothing, and trust nothing either.
OPEN = ("unexplained", "unidentifiable", "refused")
# Outcomes that name what is not there.
WRONG = ("wrong", "wrong_set")


def counted(rows: Sequence[Row], hit: Callable[[Row], bool]) -> str:
    """How many rows, their share, and its exact 95 % interval (Clopper and Pearson), as cells of a table."""
    from scipy.stats import binomtest

    n, k = len(rows), sum(map(hit, rows))
    if not n:
        return ""
    low, high = binomtest(k, n).proportion_ci(method="exact")
    return f"{k}/{n} | {100 * k / n:.1f} % | {100 * low:.1f} to {100 * high:.1f} %"


def blames_physics(row: Row) -> bool:
    """Whether something of the unit, the specimen or its resin is named with confidence and wrong."""
    return (
        row["verdict"] == "named" and row["outcome"] != "exact" and not INSTRUMENTS.issuperset(row["names"])
    )


def _called_wrong(row: Row) -> bool:
    return row["verdict"] != "none"


def _outcomes(*which: str) -> Callable[[Row], bool]:
    return lambda row: row["outcome"] in which


def _rates(by: Mapping[str, Sequence[Row]]) -> list[tuple[str, str, str]]:
    """What is counted, the cells of `counted`, and the goal."""
    clean, single, two, outside, lab = (by[p] for p in ("clean", "single", "two", "outside", "lab"))
    right = [r for r in lab if CLEAN.issuperset(r["faults"])]
    faulty = [r for r in lab if not CLEAN.issuperset(r["faults"])]
    errors = [r for r in [*faulty, *single, *two, *outside] if r.get("error_over_noise", 0.0) > GROSS]
    named = ("exact", "in_set")
    found = [
        ("clean: a cause named, or several to choose from", counted(clean, _outcomes(*WRONG)), "3 %"),
        ("clean: any verdict but none", counted(clean, _called_wrong), "3 %"),
        ("another law: the mechanism named, or in the set", counted(single, _outcomes(*named)), "90 %"),
        ("another law: wrong with confidence", counted(single, _outcomes("wrong")), ""),
        ("two effects: both named, or in the set", counted(two, _outcomes(*named)), "75 %"),
        ("outside: physics named with confidence, and wrong", counted(outside, blames_physics), "1 %"),
        ("outside: right, since the library has it now", counted(outside, _outcomes(*named)), ""),
        ("laboratory, model right: any verdict but none", counted(right, _called_wrong), "3 %"),
        ("laboratory, mishap: in the set, or open", counted(faulty, _outcomes(*named, *OPEN)), ""),
        ("laboratory, mishap: in the set", counted(faulty, _outcomes(*named)), ""),
        ("laboratory, mishap: wrong", counted(faulty, _outcomes(*WRONG)), "1 %"),
        (f"none on an error above {GROSS:g} times the noise", counted(errors, _outcomes("none")), "0"),
    ]
    each = [{"in": v} for r in by["coverage"] for v in r["inside"].values()]
    found.append(("95 % intervals that hold the truth", counted(each, lambda r: r["in"]), "93 to 97 %"))
    return [row for row in found if row[1]]


def _seconds(rows: Sequence[Row]) -> str:
    """Median and longest processor time of a verdict by kind, as a row of the table."""
    by: dict[str, list[float]] = collections.defaultdict(list)
    for r in rows:
        by[r["kind"].replace("_", " ")].append(r.get("seconds", 0.0))
    each = (f"{kind} {statistics.median(own):.1f}, {max(own):.0f}" for kind, own in sorted(by.items()))
    return f"| seconds, median and longest | {'; '.join(each)} |  |  |  |"


def report(rows: Iterable[Row]) -> str:
    """All rates of a battery's rows, and seconds by kind, then what was called what."""
    rows = list(rows)
    by: dict[str, list[Row]] = collections.defaultdict(list)
    for row in rows:
        by[row["part"]].append(row)
    lines = [
        "| sets of a second code | found | rate | 95 % interval | goal |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [f"| {what} | {cells} | {goal} |" for what, cells, goal in _rates(by)]
    lines.append(_seconds(rows))
    lines.append("")
    for part, own in by.items():
        groups = collections.defaultdict(list)
        for r in own:
            groups[r["kind"], " + ".join(r["faults"]) or "nothing"].append(r)
        for (kind, hidden), members in sorted(groups.items()):
            called = collections.Counter(_called(r) for r in members).most_common()
            lines.append(f"- {part}, {kind}, {hidden}: {', '.join(f'{n} {c}' for c, n in called)}")
    return "\n".join(lines)


def _called(row: Row) -> str:
    if row["verdict"] == "ambiguous":
        return "set of " + "/".join(row["ambiguity"])
    return "+".join(row["names"]) or row["verdict"]
