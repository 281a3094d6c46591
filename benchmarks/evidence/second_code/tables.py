"""Rates of a battery with their intervals, and every wrong name, as Markdown."""

from __future__ import annotations

import collections
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .judging import INSTRUMENTS
from .lab import CLEAN

Row = dict[str, Any]
# Error over noise from which on a verdict `none` misleads.
GROSS = 5.0
# Outcomes that name nothing, and trust nothing either.
OPEN = ("unexplained", "unidentifiable", "refused")


def counted(rows: Sequence[Row], hit: Callable[[Row], bool]) -> str:
    """How many rows, their share, and its exact interval of 95 % (Clopper and Pearson)."""
    from scipy.stats import binomtest

    n, k = len(rows), sum(map(hit, rows))
    if not n:
        return "none"
    low, high = binomtest(k, n).proportion_ci(method="exact")
    return f"{k}/{n}, {100 * k / n:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def blames_physics(row: Row) -> bool:
    """Whether something of the unit, the specimen or its resin is named with confidence and wrong."""
    return (
        row["verdict"] == "named" and row["outcome"] != "exact" and not INSTRUMENTS.issuperset(row["names"])
    )


def _called_wrong(row: Row) -> bool:
    return row["verdict"] != "none"


def _outcomes(*which: str) -> Callable[[Row], bool]:
    return lambda row: row["outcome"] in which


def _of_a_laboratory(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Rates of mishaps: those that leave the model right, and those of tests, geometry and instruments."""
    clean = [r for r in rows if CLEAN.issuperset(r["faults"])]
    faulty = [r for r in rows if not CLEAN.issuperset(r["faults"])]
    return [
        ("lab, model right: any verdict but none", counted(clean, _called_wrong)),
        ("lab, mishap: right, in the set, or open", counted(faulty, _outcomes("exact", "in_set", *OPEN))),
        ("lab, mishap: right, or in the set", counted(faulty, _outcomes("exact", "in_set"))),
        ("lab, mishap: wrong with confidence", counted(faulty, _outcomes("wrong"))),
        ("lab, mishap: set without the truth", counted(faulty, _outcomes("wrong_set"))),
    ]


def report(rows: Iterable[Row]) -> str:
    """All rates of a battery's rows, then what was called what."""
    by: dict[str, list[Row]] = collections.defaultdict(list)
    for row in rows:
        by[row["part"]].append(row)
    lines = ["| what | rate (95 %) |", "| --- | --- |"]

    def line(what: str, found: str) -> None:
        if found != "none":
            lines.append(f"| {what} | {found} |")

    clean, single, two, outside = (by[p] for p in ("clean", "single", "two", "outside"))
    line("clean: named or several to choose from", counted(clean, _outcomes("wrong", "wrong_set")))
    line("clean: called wrong (any verdict but none)", counted(clean, _called_wrong))
    for noise in dict.fromkeys(r["noise"] for r in clean):
        line(
            f"clean, {noise}: any verdict but none",
            counted([r for r in clean if r["noise"] == noise], _called_wrong),
        )
    for kind in dict.fromkeys(r["kind"] for r in clean):
        line(
            f"clean, {kind}: any verdict but none",
            counted([r for r in clean if r["kind"] == kind], _called_wrong),
        )
    line("another law: mechanism named, or in the set", counted(single, _outcomes("exact", "in_set")))
    line("another law: mechanism named alone", counted(single, _outcomes("exact")))
    line("another law: wrong with confidence", counted(single, _outcomes("wrong")))
    line("outside: physics named with confidence", counted(outside, blames_physics))
    line("outside: anything named with confidence", counted(outside, _outcomes("wrong")))
    line("outside: named right, in the library since", counted(outside, _outcomes("exact", "in_set")))
    line("outside: unexplained", counted(outside, _outcomes("unexplained")))
    line("two effects: both named, or in the set", counted(two, _outcomes("exact", "in_set")))
    line("two effects: both named alone", counted(two, _outcomes("exact")))
    line("two effects: wrong with confidence", counted(two, _outcomes("wrong")))
    for words, found in _of_a_laboratory(by["lab"]):
        line(words, found)
    errors = [r for r in by["lab"] + single + two + outside if r.get("error_over_noise", 0.0) > GROSS]
    line(f"none, where the error is above {GROSS:g} times the noise", counted(errors, _outcomes("none")))
    for noise in ("white", "slow", "quantised", ""):
        own = [r for r in by["coverage"] if noise in ("", r["noise"])]
        each = [{"in": v} for r in own for v in r["inside"].values()]
        line(f"95 % intervals that hold the truth, {noise or 'all'}", counted(each, lambda r: r["in"]))
    line("coverage sets: effect in the set", counted(by["coverage"], _outcomes("exact", "in_set")))
    lines += ["", "| class | kind | hidden | called |", "| --- | --- | --- | --- |"]
    for part, own in by.items():
        groups = collections.defaultdict(list)
        for r in own:
            groups[r["kind"], " + ".join(r["faults"]) or "nothing"].append(r)
        for (kind, hidden), members in sorted(groups.items()):
            called = collections.Counter(_called(r) for r in members).most_common()
            lines.append(f"| {part} | {kind} | {hidden} | {', '.join(f'{n} {c}' for c, n in called)} |")
    return "\n".join(lines)


def _called(row: Row) -> str:
    if row["verdict"] == "ambiguous":
        return "set of " + "/".join(row["ambiguity"])
    return "+".join(row["names"]) or row["verdict"]
