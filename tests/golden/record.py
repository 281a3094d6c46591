"""Records what commands give and says what changed: `python tests/golden/record.py [NAME ...]`."""

import os
import sys
import tempfile
import time
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.golden import kept
from tests.golden.commands import COMMANDS, RTOL
from tests.golden.running import Workspace

RECORDED = Path(__file__).parent / "recorded"
NAMES = ["help", *COMMANDS, "panels"]


def changes(name, found):
    """Differences of what a command gives now from what is recorded."""
    path = RECORDED / f"{name}.txt"
    recorded = kept.read(path.read_text(encoding="utf-8")) if path.exists() else {}
    return list(kept.differences(recorded, found, COMMANDS[name].rtol if name in COMMANDS else RTOL))


def main(names):
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace(Path(folder).resolve())
        for name in names or NAMES:
            start, cpu = time.monotonic(), sum(os.times()[:4])
            try:
                found = workspace.run(name)
            except RuntimeError as failure:
                print(failure, flush=True)
                continue
            print(
                f"{name}: {time.monotonic() - start:.1f} s, processor {sum(os.times()[:4]) - cpu:.1f} s",
                flush=True,
            )
            for words in changes(name, found):
                print(f"  {words}", flush=True)
            (RECORDED / f"{name}.txt").write_text(kept.written(found), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
