"""What a device sends comes through a port: a pseudo terminal, which the command opens as any serial port."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import tty
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mu_addon.sensing.recording import read_recording

from .test_session import wait_for

ROOT = Path(__file__).parents[2]


def status(folder: Path) -> dict[str, Any]:
    """What a recording says of itself so far."""
    try:
        return dict(json.loads((folder / "status.json").read_text()))
    except (OSError, ValueError):
        return {}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
def test_a_coloured_device_through_a_terminal(tmp_path: Path) -> None:
    lines = [b"\x1b[2J\x1b[31mlight sensor 1.2\x1b[0m\r\n"]
    lines += [b"\x1b[32mlight\x1b[0m: %d\tdark: 3\r\n" % k for k in range(300)]
    data, out = b"".join(lines), tmp_path / "out"
    master, slave = os.openpty()
    tty.setraw(slave)
    run = [sys.executable, str(ROOT / "headless/run.py"), "record", "--port", os.ttyname(slave)]
    with subprocess.Popen([*run, "--out", str(out)], stdout=subprocess.PIPE, text=True) as process:
        wait_for(lambda: status(out).get("state") == "connected")
        for k in range(0, len(data), 512):
            os.write(master, data[k : k + 512])
            time.sleep(0.005)
        wait_for(lambda: status(out).get("bytes", 0) >= len(data))
        process.terminate()
        shown, _ = process.communicate(timeout=30)
    os.close(master)
    os.close(slave)
    assert process.returncode == 0, shown
    last = status(out)
    (recording,) = read_recording(out)
    np.testing.assert_array_equal(recording.columns["light"], np.arange(300))
    assert list(recording.columns)[3:] == ["light", "dark"]
    assert last["coloured"] == 300
    assert last["read_bytes"] + last["cut_bytes"] == last["bytes"] == len(data)
    assert "left out of 300 lines" in shown
    assert "\x1b" not in shown
