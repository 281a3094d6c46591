"""The sensor's line under load: minutes at 5 kHz and four channels, a stalled panel, a cable pulled 20 times.

python -m benchmarks.stream [--minutes 10] [--rate 5000] [--cuts 20]

The sender is another process at the other end of a pseudo terminal; `record` is the command as users run it.
Says what was lost, how old a sample is when it can be seen, the recorder's share of a core, and its memory.
What was sent before the port was open is no loss.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from benchmarks.table import options_of
from mu_addon.errors import InputError
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.ring_buffer import Ring

ROOT = Path(__file__).parents[1]
SENDER = ROOT / "tests/sensing/sender.py"


def usage(pid: int) -> tuple[float, float]:
    """Seconds of processor time and resident MB of a process (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    ticks = int(fields[11]) + int(fields[12])
    pages = int(fields[21])
    return ticks / os.sysconf("SC_CLK_TCK"), pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def run(seconds: float, rate: float, cuts: int, stall_s: float) -> dict[str, object]:
    """One recording; returns what was seen of it."""
    with tempfile.TemporaryDirectory() as folder:
        link, out = Path(folder) / "port", Path(folder) / "out"
        sender = subprocess.Popen(
            [sys.executable, str(SENDER), str(link), str(rate), str(seconds), "--cuts", str(cuts)],
            stdout=subprocess.PIPE,
            text=True,
        )
        while not link.exists():
            time.sleep(0.01)
        recorder = subprocess.Popen(
            [sys.executable, str(ROOT / "headless/run.py"), "record", "--port", str(link), "--out", str(out)],
            stdout=subprocess.DEVNULL,
        )
        ages: list[float] = []
        memory: list[float] = []
        done = threading.Event()

        def look() -> None:
            """Sixty times a second, as a panel does, but for one long stall."""
            stalled, ring, name = False, None, ""
            started = time.monotonic()
            while not done.is_set():
                time.sleep(1 / 60)
                try:
                    status = json.loads((out / "status.json").read_text())
                    if status["live"] and status["live"] != name:
                        name = status["live"]
                        ring = Ring.attach(out / name)
                except (OSError, ValueError, InputError):
                    continue
                if ring is None or status["state"] != "connected":
                    continue
                if not stalled and time.monotonic() - started > seconds / 3:
                    stalled = True
                    time.sleep(stall_s)
                rows = ring.latest(500)
                if len(rows):
                    newest = status["written"] - status["duration_s"] + rows[-1, 0]
                    ages.append(time.time() - newest)

        watcher = threading.Thread(target=look, daemon=True)
        watcher.start()
        assert sender.stdout is not None
        reading = threading.Thread(target=lambda: words.update(json.loads(sender.stdout.readline())))
        words: dict[str, int] = {}
        reading.start()
        busy = 0.0
        began = time.monotonic()
        while reading.is_alive():
            reading.join(timeout=1.0)
            busy, resident = usage(recorder.pid)
            memory.append(resident)
        took = time.monotonic() - began
        time.sleep(0.5)
        done.set()
        recorder.terminate()
        recorder.wait()
        status = json.loads((out / "status.json").read_text())
        columns = read_recording(out)[-1].columns
        numbers = columns["sequence"]
        expected = 1e-4 * ((numbers[:, None] + np.arange(4)) % 60000)
        values = np.column_stack([columns[f"light{k}_V"] for k in range(4)])
        return {
            "sent": words["sent"],
            "recorded": len(numbers),
            "lost_by_number": status["lost"],
            "unaccounted": int(words["last"] + 1 - numbers[0]) - len(numbers) - status["lost"],
            "reordered": int((np.diff(numbers) <= 0).sum()),
            "wrong_values": int((np.abs(values - expected) > 1e-9).any(axis=1).sum()),
            "crc_errors": status["crc_errors"],
            "reconnects": status["reconnects"],
            "exit_status": recorder.returncode,
            "core_share": round(busy / took, 4),
            "memory_MB": [round(memory[min(5, len(memory) - 1)], 1), round(memory[-1], 1)],
            "age_ms": [round(1000 * float(np.quantile(ages, q)), 1) for q in (0.5, 0.99, 1.0)],
            "load": os.getloadavg()[0],
        }


def main() -> None:
    """Print one JSON line a run."""
    parser = options_of(__doc__)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--rate", type=float, default=5000)
    parser.add_argument("--cuts", type=int, default=20)
    options = parser.parse_args()
    steady = run(60 * options.minutes, options.rate, 0, min(30.0, 10 * options.minutes))
    print(json.dumps({"run": "steady", **steady}), flush=True)
    cut = run(max(40.0, 6 * options.minutes), options.rate / 5, options.cuts, 1.0)
    print(json.dumps({"run": "cable pulled", **cut}), flush=True)


if __name__ == "__main__":
    main()
