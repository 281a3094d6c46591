"""A device at the other end of a pseudo terminal, in a process of its own.

python sender.py LINK RATE_HZ SECONDS [--channels N] [--cuts N] [--cut-s S]: makes a pty, links LINK to it,
and sends frames; with cuts, closes the pty and comes back on another one, numbering on as a device does that
keeps its power. Says on standard output how many frames it sent: {"sent": n, "last": number of the last,
"late_s": by how much the latest of them was late}.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import tty
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from mu_addon.sensing.framing import info_frame, sample_frame


def plug(link: Path) -> tuple[int, int]:
    master, slave = os.openpty()
    tty.setraw(slave)
    beside = link.with_name(".plugging")
    beside.symlink_to(os.ttyname(slave))
    beside.replace(link)
    # The far end is kept open, as a cable without a reader is no cut cable.
    return master, slave


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("link", type=Path)
    parser.add_argument("rate", type=float)
    parser.add_argument("seconds", type=float)
    parser.add_argument("--channels", type=int, default=4)
    parser.add_argument("--cuts", type=int, default=0)
    parser.add_argument("--cut-s", type=float, default=0.2)
    options = parser.parse_args()
    names = [f"light{k}" for k in range(options.channels)]
    info = info_frame({"channels": names, "unit": "V", "unit_per_count": 1e-4})
    total = round(options.rate * options.seconds)
    cuts = [round(total * (k + 1) / (options.cuts + 1)) for k in range(options.cuts)]
    master, slave = plug(options.link)
    # Until the reader is there nothing is sent: a pty holds only a page.
    time.sleep(0.5)
    start, sent, missed, late = time.perf_counter(), 0, 0, 0.0
    while sent < total:
        late = max(late, time.perf_counter() - start - sent / options.rate)
        due = min(total, int((time.perf_counter() - start) * options.rate) + 1)
        out = bytearray()
        for k in range(sent, due):
            if k % max(1, int(options.rate)) == 0:
                out += info
            out += sample_frame(
                k, round(1e6 * k / options.rate), [(k + c) % 60000 for c in range(options.channels)]
            )
        while out:
            del out[: os.write(master, out)]
        sent = due
        if cuts and sent >= cuts[0]:
            cuts.pop(0)
            # What the reader has not taken by now is lost with the cable.
            time.sleep(0.1)
            os.close(master)
            os.close(slave)
            options.link.unlink()
            time.sleep(options.cut_s)
            master, slave = plug(options.link)
            waited = time.perf_counter()
            time.sleep(0.6)
            away = int((time.perf_counter() - waited + options.cut_s + 0.1) * options.rate)
            missed += min(away, total - sent)
            sent = min(total, sent + away)
        time.sleep(0.002)
    time.sleep(0.5)
    print(json.dumps({"sent": total - missed, "last": total - 1, "late_s": late}), flush=True)
    os.close(master)
    options.link.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
