"""The judge's side: the verdict on a hidden bench's folder, held against what was hidden."""

import tempfile
from pathlib import Path

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from mu_addon.measured import read_folder
from tests.blind.injector import drawn_effects, hide, judged_unit
from tests.blind.machines import BENCHES
from tests.blind.truth import UNITS


def judged(order):
    """One order as a row of plain data: what was said, and what that is worth."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "measured"
        hide(order, folder)
        experiments = read_folder(folder).experiments
        unit = order.get("unit", "written")
        known = (
            Composite(bench_simulators(experiments))
            if unit in BENCHES
            else judged_unit(UNITS[unit](), experiments)
        )
        verdict = diagnose(experiments, known)
    return {
        "verdict": verdict.kind,
        "names": list(verdict.names),
        "doubted": verdict.selection.doubted,
        "chosen": list(verdict.selection.chosen.names),
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
