"""Every benchmark, one after the other, as one Markdown page: about an hour and a half on two cores.

    python benchmarks/all.py [--out page.md] [--only sweep breakdown ...]

A script that fails, or a code that is not installed, is named in its place; the others still run.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCRIPTS = {
    "peers": ["peers/run.py", "--order", "1", "2"],
    "compare": ["compare.py"],
    "accuracy": ["accuracy.py"],
    "breakdown": ["breakdown.py"],
    "scale": ["scale.py"],
    "sweep": ["sweep.py"],
    "solvers": ["solvers.py"],
    "convergence": ["convergence.py", "angle"],
    "verification": ["verification.py"],
    "cell": ["cell.py"],
    "specimen": ["specimen.py", "size"],
    "moduli": ["moduli.py"],
    "print": ["print.py"],
    "gpu": ["gpu.py"],
}


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--out", type=Path, help="also write the page to this file")
    options.add_argument("--only", nargs="+", choices=SCRIPTS, default=list(SCRIPTS))
    given = options.parse_args()
    page = []
    failed = False
    for name in given.only:
        start = time.perf_counter()
        command = [sys.executable, str(HERE / SCRIPTS[name][0]), *SCRIPTS[name][1:]]
        done = subprocess.run(command, cwd=HERE.parent, capture_output=True, text=True, check=False)
        took = time.perf_counter() - start
        words = done.stdout if done.returncode == 0 else f"{done.stdout}\nFAILED: {done.stderr[-2000:]}"
        failed |= done.returncode != 0
        page.append(f"## {name} ({took:.0f} s)\n\n{words.strip()}\n")
        print(page[-1], flush=True)
        if given.out:
            given.out.write_text("\n".join(page), encoding="utf-8")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
