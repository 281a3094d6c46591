"""A run that works in a folder until it is stopped or told to end: `locked_worker.py FOLDER`."""

import json
import signal
import sys
import time
from pathlib import Path

from mu_addon.run.lock import FolderLock


def emit(**message):
    print(json.dumps(message), flush=True)


def stopped(*_):
    emit(type="error", what="stopped by the process that started it", where="", what_to_do="", status=143)
    sys.exit(143)


signal.signal(signal.SIGTERM, stopped)
folder = Path(sys.argv[1])
lock = FolderLock(folder)
emit(type="progress", stage="Model A", state="run", fraction=0.25, seconds=1.0)
while not (folder / "end").exists():
    time.sleep(0.02)
if (folder / "end").read_text() == "well":
    emit(type="result", summary={})
