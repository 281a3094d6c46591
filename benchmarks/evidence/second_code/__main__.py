"""python -m benchmarks.evidence.second_code --seed 7 --only clean,single --sets 100 --rows FILE

Judges sets of measured data by a second code. Every finished set is a line of --rows at once; the same
command goes on where the file ends. Another seed is another battery.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from .coverage import covered
from .judging import judged
from .sets import CLASSES, order
from .tables import report


def main() -> None:
    """Judge what the file does not hold yet, then print rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the battery")
    parser.add_argument("--only", default=",".join((*CLASSES, "coverage")), help="classes, by commas")
    parser.add_argument("--sets", type=int, default=100, help="of each class")
    parser.add_argument("--first", type=int, default=0, help="number of the first set of each class")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so many")
    parser.add_argument("--rows", type=Path, required=True, help="one JSON line a set")
    args = parser.parse_args()
    until = time.time() + 60.0 * args.minutes
    rows = [json.loads(line) for line in args.rows.read_text().splitlines()] if args.rows.exists() else []
    known = {(r["battery"], r["part"], r["number"]) for r in rows}
    for number in range(args.first, args.first + args.sets):
        for part in args.only.split(","):
            if (args.seed, part, number) in known or time.time() > until:
                continue
            row = covered(number, args.seed) if part == "coverage" else judged(order(part, number, args.seed))
            row |= {"battery": args.seed, "number": number, "part": part}
            with args.rows.open("a") as stream:
                stream.write(json.dumps(row, default=float) + "\n")
            rows.append(row)
    print(report([r for r in rows if r["battery"] == args.seed]))


if __name__ == "__main__":
    main()
