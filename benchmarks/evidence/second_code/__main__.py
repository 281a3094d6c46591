"""python -m benchmarks.evidence.second_code --seed 7 --only clean,single --rounds 2 --workers 2 --rows FILE

Judges sets of measured data by a second code. A round has each case of each class once, all classes in
one shuffled order, so that a run that is stopped by the clock has judged a fair share of each. Every
finished set is a line of --rows at once; the same command goes on where the file ends. Another seed is
another battery.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from benchmarks.table import circumstances, options_of
from mu_addon.run.processes import end_with_parent, one_thread_each

from .battery import ROUNDS, row_of, shuffled
from .tables import report


def main() -> None:
    """Judge what the file does not hold yet, then print rates."""
    parser = options_of(__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the battery")
    parser.add_argument("--only", default=",".join(ROUNDS), help="classes, by commas")
    parser.add_argument("--rounds", type=int, default=1, help="each case of each class once a round")
    parser.add_argument("--sets", type=int, help="the first so many of the order alone")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no set after so many")
    parser.add_argument("--workers", type=int, default=1, help="processes of one thread")
    parser.add_argument("--rows", type=Path, required=True, help="one JSON line a set")
    args = parser.parse_args()
    until = time.time() + 60.0 * args.minutes
    rows = [json.loads(line) for line in args.rows.read_text().splitlines()] if args.rows.exists() else []
    known = {(r["battery"], r["part"], r["number"]) for r in rows}
    wanted = [
        (args.seed, part, number)
        for part, number in shuffled(args.only.split(","), args.rounds, args.seed)[: args.sets]
        if (args.seed, part, number) not in known
    ]
    with (
        one_thread_each(),
        ProcessPoolExecutor(args.workers, multiprocessing.get_context("spawn"), end_with_parent) as pool,
    ):
        futures = [pool.submit(row_of, *which, until) for which in wanted]
        for future in as_completed(futures):
            row = future.result()
            if row is not None:
                with args.rows.open("a") as stream:
                    stream.write(json.dumps(row, default=float) + "\n")
                rows.append(row)
    own = [r for r in rows if r["battery"] == args.seed]
    print(f"{circumstances()}; {len(own)} sets\n\n{report(own)}")


if __name__ == "__main__":
    main()
