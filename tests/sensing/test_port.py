"""What a device sends comes through a port: a pseudo terminal, which the command opens as any serial port."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.sensing.recording import read_recording

from .mutations import NASTY
from .test_decoder import LINES_AS_SENT

ROOT = Path(__file__).parents[2]
needs_terminals = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")


def status(folder: Path) -> dict[str, Any]:
    """What a recording says of itself so far."""
    try:
        return dict(json.loads((folder / "status.json").read_text()))
    except (OSError, ValueError):
        return {}


def wait_for_port(folder: Path, until: float) -> None:
    """Return once a recording has opened its port."""
    while status(folder).get("state") != "connected" and time.monotonic() < until:
        time.sleep(0.02)


def recorded(data: bytes, folder: Path) -> tuple[dict[str, Any], str]:
    """The last status of `record` of bytes sent through a pseudo terminal, and what it showed."""
    master, slave = os.openpty()
    tty.setraw(slave)
    run = [sys.executable, str(ROOT / "headless/run.py"), "record", "--port", os.ttyname(slave)]
    with subprocess.Popen([*run, "--out", str(folder)], stdout=subprocess.PIPE, text=True) as process:
        until = time.monotonic() + 60
        wait_for_port(folder, until)
        for k in range(0, len(data), 512):
            os.write(master, data[k : k + 512])
            time.sleep(0.005)
        while status(folder).get("bytes", 0) < len(data) and time.monotonic() < until:
            time.sleep(0.02)
        process.terminate()
        shown, _ = process.communicate(timeout=30)
    os.close(master)
    os.close(slave)
    assert process.returncode == 0, shown
    return status(folder), shown


@needs_terminals
def test_a_coloured_device_through_a_terminal(tmp_path: Path) -> None:
    lines = [b"\x1b[2J\x1b[31mlight sensor 1.2\x1b[0m\r\n"]
    lines += [b"\x1b[32mlight\x1b[0m: %d\tdark: 3\r\n" % k for k in range(300)]
    last, shown = recorded(b"".join(lines), tmp_path / "out")
    (recording,) = read_recording(tmp_path / "out")
    np.testing.assert_array_equal(recording.columns["light"], np.arange(300))
    assert list(recording.columns)[3:] == ["light", "dark"]
    assert last["coloured"] == 300
    assert last["read_bytes"] + last["cut_bytes"] == last["bytes"] == sum(map(len, lines))
    assert "left out of 300 lines" in shown
    assert "\x1b" not in shown


@needs_terminals
def test_a_damaged_stream_through_a_terminal(tmp_path: Path) -> None:
    lines = [b"\n", *(b"seq:%d,light:%d\n" % (k % 256, k) for k in range(300))]
    for place, nasty in enumerate(NASTY):
        lines.insert(20 + 10 * place, nasty + b"\n")
    data = b"".join(lines)
    last, shown = recorded(data, tmp_path / "out")
    (recording,) = read_recording(tmp_path / "out")
    assert set(range(300)) <= set(recording.columns["light"])
    assert last["bytes"] == len(data)
    accounted = last["read_bytes"] + last["rejected_bytes"] + last["cut_bytes"] + last["overlong"]
    assert accounted == len(data)
    assert "unreadable" in shown


@needs_terminals
@pytest.mark.parametrize("line", LINES_AS_SENT)
def test_lines_as_boards_send_them_through_a_port(line: str, tmp_path: Path) -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    folder, sent = tmp_path / "out", f"{line}\r\n".encode() * 60

    def send() -> None:
        wait_for_port(folder, time.monotonic() + 60)
        os.write(master, sent)

    sender = threading.Thread(target=send)
    sender.start()
    ended = main(["record", "--port", os.ttyname(slave), "--seconds", "1", "--quiet", "--out", str(folder)])
    sender.join()
    os.close(master)
    os.close(slave)
    assert ended == 0
    (recording,) = read_recording(folder)
    assert list(recording.columns)[3:] == [*LINES_AS_SENT[line]]
    for name, value in LINES_AS_SENT[line].items():
        np.testing.assert_allclose(recording.columns[name], np.full(59, value), rtol=1e-6)
