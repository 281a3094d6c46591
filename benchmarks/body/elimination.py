"""What a ranking says before it is done, and what it saves by leaving paths that cannot win.

    python -m benchmarks.body.elimination [mu-1.0x UNIT.toml ...] [--refine 0.35] [--workers 2]

Of each unit `place` runs in one folder with --quick, then in full, then with --all-paths: the last run solves
only what the second left out, so that all together cost as much as solving all at once. Seconds are of the
processor, of all processes, and by the clock. Columns of a path: J_hat in mm of the quick ranking, estimated
before any path is solved, its lower bound where the full ranking left it out, its exact value, and whether
the full ranking had the same digits. The mesh check is on; `tied` says which paths it does not tell apart.
"""

from __future__ import annotations

import csv
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.table import circumstances, options_of, print_head, print_row

RUN = Path(__file__).parents[2] / "headless" / "run.py"
PRESETS = ["mu-0.75x", "mu-1.0x", "mu-1.5x"]
SOLVED = "J_hat_mm", "J_cont_mm"
Rows = dict[str, dict[str, str]]


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("units", nargs="*", default=PRESETS)
    parser.add_argument("--refine", default="0.35")
    parser.add_argument("--workers", default="2")
    options = parser.parse_args()
    print(circumstances(), "\n")
    heads = "unit", "path", "quick mm", "estimated mm", "at least mm", "exact mm", "same digits", "tied"
    print_head(*heads)
    seconds = {}
    for unit in options.units:
        with tempfile.TemporaryDirectory() as home:
            given = ["--unit", unit] if unit.endswith(".toml") else ["--preset", unit]
            words = ["place", *given, "--out", str(Path(home, "out")), "--no-report", "--quiet"]
            words += ["--refine", options.refine, "--workers", options.workers]
            runs = [placed([*words, *more], Path(home, "out")) for more in (["--quick"], [], ["--all-paths"])]
        name = Path(unit.removesuffix(".toml")).name
        print_paths(name, *(rows for rows, *_ in runs), runs[1][1])
        seconds[name] = [spent for *_, spent in runs]
    print()
    spans = "quick ranking", "rest of the ranking", "paths that cannot win"
    print_head("unit", *(f"{span}, {kind} s" for span in spans for kind in ("processor", "clock")))
    for name, spent in seconds.items():
        print_row(name, *(f"{s:.0f}" for pair in spent for s in pair))


def print_paths(unit: str, quick: Rows, some: Rows, every: Rows, summary: dict) -> None:
    """A row for each path of a unit."""
    estimated = summary.get("J_hat_estimated_mm", {})
    for name, row in every.items():
        same = "" if not some[name]["J_hat_mm"] else all(some[name][c] == row[c] for c in SOLVED)
        print_row(
            unit,
            name,
            short(quick[name]["J_hat_mm"]) or f"at least {short(quick[name]['J_hat_at_least_mm'])}",
            short(estimated.get(name, "")),
            short(some[name]["J_hat_at_least_mm"]),
            short(row["J_hat_mm"]) or "none",
            {"": "", True: "yes", False: "NO"}[same],
            some[name]["tied_with_chosen"],
        )


def short(number: str | float) -> str:
    """A length in mm to a tenth of a micrometre, or nothing."""
    return "" if number == "" else f"{float(number):.4f}"


def placed(words: list[str], out: Path) -> tuple[Rows, dict, tuple[float, float]]:
    """Rows of deviation.csv by path, summary, and the command's seconds of the processor and by the clock."""
    begun, used = time.perf_counter(), _used_s()
    subprocess.run([sys.executable, str(RUN), *words], check=True, stdout=subprocess.DEVNULL)
    seconds = _used_s() - used, time.perf_counter() - begun
    with (out / "deviation.csv").open(newline="", encoding="utf-8") as stream:
        rows = {row["path"]: row for row in csv.DictReader(stream)}
    return rows, json.loads((out / "summary.json").read_text()), seconds


def _used_s() -> float:
    """Processor seconds of all ended child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
