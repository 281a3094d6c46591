"""When, on what and of which commit a figure was measured: one line for the head of a table."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from pathlib import Path


def _cpu():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "CPU")


def _commit():
    here = Path(__file__).parent

    def git(*arguments):
        return subprocess.run(["git", *arguments], cwd=here, capture_output=True, text=True, check=False)

    commit = git("rev-parse", "--short", "HEAD").stdout.strip() or "unknown"
    return commit + (" with changes" if git("status", "--porcelain", "../mu_addon").stdout else "")


def circumstances():
    """Date, processor, cores, load and commit."""
    load = f"load {os.getloadavg()[0]:.1f} at the start" if hasattr(os, "getloadavg") else "load unknown"
    return f"{datetime.date.today()}; {_cpu()}, {os.cpu_count()} cores, {load}; commit {_commit()}"
