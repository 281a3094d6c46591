"""What benchmarks share: their options, when and on what they measured, and a Markdown table."""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def options_of(page: str | None) -> argparse.ArgumentParser:
    """A parser whose help is the benchmark's docstring."""
    return argparse.ArgumentParser(description=page, formatter_class=argparse.RawDescriptionHelpFormatter)


def print_row(*cells: object) -> None:
    """A row of a table, at once."""
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def print_head(*columns: object) -> None:
    """The first row of a table, and the line below it."""
    print_row(*columns)
    print("| --- " * len(columns) + "|", flush=True)


def circumstances() -> str:
    """Date, processor, cores, load and commit."""
    load = f"load {os.getloadavg()[0]:.1f} at the start" if hasattr(os, "getloadavg") else "load unknown"
    return f"{datetime.date.today()}; {_cpu()}, {os.cpu_count()} cores, {load}; commit {_commit()}"


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "CPU")


def _commit() -> str:
    def git(*arguments: str) -> str:
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    return (git("rev-parse", "--short", "HEAD") or "unknown") + (
        " with changes" if git("status", "--porcelain", "mu_addon") else ""
    )
