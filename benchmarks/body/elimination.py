"""What a ranking saves by leaving paths that cannot win, and that the best ones' digits do not change.

    python -m benchmarks.body.elimination [--preset mu-1.0x] [--chambers N] [--refine 0.35] [--protocol CSV]
                                          [--times K] [--mesh-check] [--workers 2]

`place` runs in a new folder, then with --all-paths in it: the second run solves only what the first left out,
so that both together are the cost of solving all, on the same work. Seconds are of the processor, of all
processes, and by the clock. Columns of a path: J_hat in mm estimated before any path is solved, its lower
bound where it was left out, and its exact value.
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

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import load_preset, to_toml

RUN = Path(__file__).parents[2] / "headless" / "run.py"
SOLVED = "J_hat_mm", "J_cont_mm", "rank", "mesh_uncertainty_mm"


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--preset", default="mu-1.0x")
    parser.add_argument("--chambers", type=int)
    parser.add_argument("--refine", default="0.35")
    parser.add_argument("--protocol")
    parser.add_argument("--times", default="13")
    parser.add_argument("--mesh-check", action="store_true")
    parser.add_argument("--workers", default="2")
    options = parser.parse_args()
    unit = load_preset(options.preset)
    with tempfile.TemporaryDirectory() as home:
        given = Path(home, "unit.toml")
        given.write_text(to_toml(unit.evolve(count=options.chambers or unit.chambers.count)))
        words = ["place", "--unit", str(given), "--out", str(Path(home, "out")), "--no-report", "--quiet"]
        words += ["--refine", options.refine, "--times", options.times, "--workers", options.workers]
        words += ["--protocol", options.protocol] if options.protocol else []
        words += [] if options.mesh_check else ["--no-mesh-check"]
        some, some_s = placed(words, Path(home, "out"))
        every, rest_s = placed([*words, "--all-paths"], Path(home, "out"))
        summary = json.loads(Path(home, "out", "summary.json").read_text())
    print_head("path", "estimated mm", "at least mm", "exact mm", "same digits")
    estimated = summary.get("J_hat_estimated_mm", {})
    for name, row in every.items():
        first, guess = some[name], estimated.get(name)
        same = all(first[c] == row[c] for c in SOLVED[:2]) if first["J_hat_mm"] else ""
        bound = first["J_hat_at_least_mm"]
        exact = f"{float(row['J_hat_mm']):.4f}" if row["J_hat_mm"] else "none"
        print_row(
            name,
            "" if guess is None else f"{guess:.3f}",
            f"{float(bound):.4f}" if bound else "",
            exact,
            "" if same == "" else "yes" if same else "NO",
        )
    print()
    print_head("", "processor s", "clock s")
    print_row("paths that can win", *(f"{s:.0f}" for s in some_s))
    print_row("the others", *(f"{s:.0f}" for s in rest_s))
    print_row("share of all", *(f"{a / (a + b):.2f}" for a, b in zip(some_s, rest_s, strict=True)))


def placed(words: list[str], out: Path) -> tuple[dict[str, dict[str, str]], tuple[float, float]]:
    """Rows of deviation.csv by path, and the seconds of the processor and by the clock, of a command."""
    begun, used = time.perf_counter(), _used_s()
    subprocess.run([sys.executable, str(RUN), *words], check=True)
    seconds = _used_s() - used, time.perf_counter() - begun
    with (out / "deviation.csv").open(newline="", encoding="utf-8") as stream:
        return {row["path"]: row for row in csv.DictReader(stream)}, seconds


def _used_s() -> float:
    """Processor seconds of all ended child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
