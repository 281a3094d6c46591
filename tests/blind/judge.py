"""The judge's side: the verdict on a hidden bench's folder, held against what was hidden."""

import tempfile
from pathlib import Path

import attrs

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.simulator import Composite
from mu_addon.measured import read_folder
from tests.blind.injector import drawn_effects, hide
from tests.blind.machines import BENCHES
from tests.blind.truth import UNITS
from tests.evidence import stand_ins

CHANGES = ("later", "shuffled", "doubled marker", "every second sample", "no marker out of the plane")


def simulator_of(order, experiments):
    """The judge's simulator: the unit as it is known to designers, and a beam where one was loaded."""
    if order.get("unit") in BENCHES:
        return Composite(bench_simulators(experiments))
    unit = UNITS[order.get("unit", "written")]()
    bent = [e for e in experiments if e.kind == "unit_pressure"]
    kinds = sorted({(e.scale, e.orientation_deg) for e in bent})
    known = {"unit_pressure": UnitPressure(unit.responses(kinds), experiments)}
    if len(bent) < len(experiments):
        known["beam_deadweight"] = stand_ins.DeadLoad()
    return Composite(known)


def verdict_of(folder, order, change=None):
    """The engine's verdict on a folder; change: of what must not matter to it."""
    experiments = read_folder(folder).experiments
    if change:
        experiments = changed(experiments, change)
    return diagnose(experiments, simulator_of(order, experiments))


def changed(experiments, change):
    """The same experiments, told otherwise."""
    if change == "shuffled":
        # For effects that specimens do not remember; else the order is part of what was done to them.
        return tuple(experiments[::-1])
    found = []
    for e in experiments:
        columns, rows = dict(e.columns), e.rows
        if change == "later":
            columns["time_s"] = columns["time_s"] + 4321.0
        if change == "doubled marker":
            columns |= {f"marker4_{a}_mm": columns[f"marker1_{a}_mm"] for a in "yz"}
        if change == "no marker out of the plane":
            columns = {k: v for k, v in columns.items() if not k.endswith("_x_mm")}
        if change == "every second sample":
            columns, rows = {k: v[::2] for k, v in columns.items()}, rows[::2]
        found.append(attrs.evolve(e, columns=columns, rows=rows))
    return tuple(found)


def judged(order):
    """One order as a row of plain data; same: of each change that must not matter whether it did not."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "measured"
        hide(order, folder)
        verdict = verdict_of(folder, order)
        others = [(change, verdict_of(folder, order, change)) for change in order.get("changes", ())]
    again = [(change, v.kind, sorted(v.names), sorted(v.ambiguity)) for change, v in others]
    held = verdict.gain.held_out
    said = verdict.kind, sorted(verdict.names), sorted(verdict.ambiguity)
    return {
        "verdict": verdict.kind,
        "names": list(verdict.names),
        "ambiguity": sorted(verdict.ambiguity),
        "doubted": verdict.selection.doubted,
        "identifiability": sorted(verdict.identifiability),
        "chosen": list(verdict.selection.chosen.names),
        "gain": held.as_json() if held else None,
        "same": [(change, tuple(other) == said, *other) for change, *other in again],
        "outcome": outcome(set(drawn_effects(order)), verdict),
    }


IN_SET = ("exact", "exact_with_rivals", "in_set")


def outcome(truth, verdict):
    """What a verdict is worth beside the truth.

    clean, or false: a name, or several to choose from, for nothing. exact; exact_with_rivals: leads a set of
    rivals; in_set; partly: named, but not all; wrong: named with confidence, and not true; wrong_set: several
    to choose from, not the truth; else the verdict's own kind.
    """
    names, kind = set(verdict.names), verdict.kind
    more = names - truth
    if not truth:
        if kind in ("none", "unidentifiable", "unexplained"):
            return "clean" if kind == "none" else kind
        return ("false" if kind == "named" else "false_set") if more else "clean"
    if kind not in ("named", "ambiguous"):
        return kind
    if truth <= names and not more:
        return "exact" if kind == "named" else "exact_with_rivals"
    if kind == "named":
        return "wrong" if more else "partly"
    return "in_set" if truth <= verdict.ambiguity else "wrong_set"
