"""Sessions over real pseudo terminals, the sender in another process: nothing is lost unseen."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.sensing.framing import info_frame, sample_frame
from mu_addon.sensing.reconnecting import Control
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.ring_buffer import Ring
from mu_addon.sensing.session import run_session
from mu_addon.sensing.sources import ConnectionLost, EndOfStream, Port, Replay, SerialLine, find

ROOT = Path(__file__).parents[2]
SENDER = Path(__file__).with_name("sender.py")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")


@contextmanager
def sending(link: Path, rate: float, seconds: float, *more: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, str(SENDER), str(link), str(rate), str(seconds), *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            wait_for(link.exists)
            yield process
        finally:
            process.kill()


def wait_for(true: Callable[[], Any], seconds: float = 1800.0) -> None:
    until = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.01)


def recorded(link: Path, folder: Path, sender: subprocess.Popen[str], **options: Any) -> dict[str, Any]:
    """Record until the sender is done; returns the last status with what the sender says of itself."""
    control = Control()
    words: dict[str, Any] = {}

    def wait() -> None:
        assert sender.stdout is not None
        words.update(json.loads(sender.stdout.readline()))
        time.sleep(1.0)  # for what is still on its way
        control.stop.set()

    threading.Thread(target=wait, daemon=True).start()
    status = run_session(SerialLine(str(link)), folder, about={}, control=control, seconds=3600, **options)
    return {**status, **words}


def table(folder: Path) -> dict[str, np.ndarray]:
    (recording,) = read_recording(folder)
    return recording.columns


def test_five_kilohertz_of_four_channels(tmp_path: Path) -> None:
    link = tmp_path / "port"
    with sending(link, 5000, 4) as sender:
        status = recorded(link, tmp_path / "out", sender)
    columns = table(tmp_path / "out")
    assert status["lost"] == status["crc_errors"] == status["repeated"] == status["reconnects"] == 0
    np.testing.assert_array_equal(columns["sequence"], np.arange(20_000))
    np.testing.assert_allclose(columns["light3_V"], 1e-4 * (np.arange(20_000) + 3), rtol=1e-12)
    np.testing.assert_allclose(columns["device_s"], np.arange(20_000) / 5000, atol=1e-6)
    # The mapped time keeps the device's rhythm, whatever the bursts it arrived in; a busy machine delays it.
    assert np.diff(columns["time_s"]).min() > 0
    assert np.ptp(columns["time_s"] - columns["device_s"]) < max(0.05, 2 * status["late_s"])


def test_who_looks_on_may_stall(tmp_path: Path) -> None:
    link, folder = tmp_path / "port", tmp_path / "out"
    seen: list[np.ndarray] = []

    def look() -> None:
        wait_for((folder / "live-0.bin").exists)
        ring = Ring.attach(folder / "live-0.bin")
        wait_for(lambda: ring.written > 100)
        seen.append(ring.latest(50))
        time.sleep(1.5)
        wait_for(lambda: ring.written > 2200)
        seen.append(ring.latest(100_000))

    with sending(link, 2000, 3) as sender:
        panel = threading.Thread(target=look)
        panel.start()
        status = recorded(link, folder, sender)
        panel.join()
    assert status["rows"] == 6000
    assert seen[0].shape == (50, 3 + 4)
    numbers = seen[1][:, 2]
    assert len(numbers) > 2000
    np.testing.assert_array_equal(np.diff(numbers), 1)
    assert not list(folder.glob("live-*"))


def test_the_cable_is_pulled(tmp_path: Path) -> None:
    link = tmp_path / "port"
    with sending(link, 1000, 8, "--cuts", "3", "--cut-s", "0.15") as sender:
        status = recorded(link, tmp_path / "out", sender)
    columns = table(tmp_path / "out")
    assert status["reconnects"] == 3
    assert (np.diff(columns["sequence"]) > 0).all()
    # Every sample was either recorded or counted as lost.
    assert status["samples"] + status["lost"] == status["last"] + 1
    assert status["lost"] >= 8000 - status["sent"]
    numbers = columns["sequence"].astype(int)
    np.testing.assert_allclose(columns["light0_V"], 1e-4 * numbers, rtol=1e-9)


def test_the_port_is_given_back_and_taken_again(tmp_path: Path) -> None:
    import serial

    link, folder = tmp_path / "port", tmp_path / "out"
    control, events = Control(), []
    status: dict[str, Any] = {}

    def run() -> None:
        line = SerialLine(str(link))
        status.update(
            run_session(
                line,
                folder,
                about={},
                control=control,
                on_event=lambda e, d: e != "status" and events.append(e),
            )
        )

    with sending(link, 500, 3600):
        session = threading.Thread(target=run)
        session.start()
        wait_for(lambda: "format" in events)
        with pytest.raises(OSError, match="lock"):
            serial.Serial(str(link), exclusive=True)
        control.pause.set()
        wait_for(lambda: "paused" in events)
        with serial.Serial(str(link), timeout=60, exclusive=True) as other:
            assert other.read(100)
        control.marks.put("looked elsewhere")
        control.pause.clear()
        wait_for(lambda: events.count("connected") == 2)
        time.sleep(0.5)
        control.stop.set()
        session.join()
    (recording,) = read_recording(folder)
    assert status["lost"] > 0
    assert [m["text"] for m in recording.messages if m.get("event") == "mark"] == ["looked elsewhere"]


def test_killed_while_recording(tmp_path: Path) -> None:
    link, folder = tmp_path / "port", tmp_path / "out"
    run = [sys.executable, str(ROOT / "headless/run.py"), "record", "--port", str(link), "--out", str(folder)]
    with sending(link, 2000, 3600), subprocess.Popen(run, stdout=subprocess.DEVNULL) as process:
        wait_for((folder / "recording-000.csv").exists)
        time.sleep(1.0)
        ring = Ring.attach(folder / "live-0.bin")
        shown = int(ring.latest(1)[0, 2])
        process.send_signal(signal.SIGKILL)
        process.wait()
    columns = table(folder)
    # What was shown had been written before; the file opens although its end may be cut.
    assert columns["sequence"][-1] >= shown
    np.testing.assert_array_equal(np.diff(columns["sequence"]), 1)


def test_ctrl_c_is_a_good_end(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    run = [sys.executable, str(ROOT / "headless/run.py"), "stream", "--simulate", "--out", str(folder)]
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as process:
        wait_for((folder / "recording-000.csv").exists)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=1800)
    assert process.returncode == 0
    assert "nothing lost" in out
    assert json.loads((folder / "summary.json").read_text())["status"] == "complete"


def test_a_recording_plays_again_to_the_digit(tmp_path: Path) -> None:
    with sending(tmp_path / "port", 1000, 1) as sender:
        recorded(tmp_path / "port", tmp_path / "a", sender)
    run_session(Replay(tmp_path / "a", speed=0), tmp_path / "b", about={}, keep_time=True)
    first, again = table(tmp_path / "a"), table(tmp_path / "b")
    for name in first.keys() - {"device_s"}:
        np.testing.assert_array_equal(first[name], again[name], err_msg=name)


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "index.ndjson").write_text("{}\n")
    with pytest.raises(InputError, match="contains a recording"):
        run_session(Replay(_small(tmp_path / "r")), tmp_path, about={})


def _small(folder: Path) -> Path:
    folder.mkdir()
    (folder / "index.ndjson").write_text('{"type": "recording"}\n{"type": "ev')
    (folder / "recording-000.csv").write_text(
        "time_s,device_s,sequence,light_V\n0.1,nan,0,1.5\n0.2,nan,1,1.6\n0.3,n"
    )
    return folder


def test_a_cut_line_is_left_out_and_a_bad_one_named(tmp_path: Path) -> None:
    folder = _small(tmp_path / "r")
    np.testing.assert_array_equal(table(folder)["light_V"], [1.5, 1.6])
    with (folder / "recording-000.csv").open("a") as stream:
        stream.write("\n0.4,nan,2,1.7\n")
    with pytest.raises(InputError, match="row 4 of"):
        read_recording(folder)
    with pytest.raises(InputError, match="the recording is invalid"):
        read_recording(tmp_path / "nowhere")


def test_ports_are_found_by_identity() -> None:
    a = Port("/dev/ttyACM0", "board", 0x2341, 0x43, "A1")
    b = Port("/dev/ttyACM1", "board", 0x2341, 0x43, "B2")
    c = Port("/dev/ttyS0", "n/a")
    assert a.identity == "usb:2341:0043:A1"
    assert c.identity is None
    assert find("usb:2341:0043:b2", [a, b, c]) is b
    assert find("/dev/ttyS0", [a, b, c]) is c
    assert find("usb:2341:0043", [b, c]) is b
    assert find("usb:2341:0044", [a, b, c]) is None
    with pytest.raises(InputError, match="2 devices fit"):
        find("usb:2341:0043", [a, b, c])


def test_a_device_is_followed_to_another_socket(tmp_path: Path) -> None:
    """A USB device that comes back under another name is the same one; its neighbour is not."""
    masters = [os.openpty() for _ in range(2)]
    names = [os.ttyname(slave) for _, slave in masters]
    present = [Port(names[0], "board", 0x2341, 0x43, "A1")]
    line = SerialLine(names[0], list_ports=lambda: present)
    assert names[0] in line.open()
    line.close()
    present[:] = [Port(names[0], "other", 0x2341, 0x43, "B2"), Port(names[1], "board", 0x2341, 0x43, "A1")]
    assert names[1] in line.open()
    line.close()
    present[:] = present[:1]
    with pytest.raises(ConnectionLost, match="not plugged in"):
        line.open()
    for pair in masters:
        for end in pair:
            os.close(end)


class _Scripted:
    """A source that does what it is told, then ends."""

    def __init__(self, *steps: bytes | Exception) -> None:
        self.steps = list(steps)

    def open(self) -> str:
        return "script"

    def read(self) -> bytes:
        if not self.steps:
            raise EndOfStream
        step = self.steps.pop(0)
        if isinstance(step, Exception):
            raise step
        return step

    def close(self) -> None:
        pass


def _frames(first: int, n: int) -> bytes:
    return b"".join(sample_frame(k, 1000 * k, (k,)) for k in range(first, first + n))


def test_half_a_frame_before_a_cut_is_not_joined_to_what_follows(tmp_path: Path) -> None:
    info = info_frame({"channels": ["light"], "unit_per_count": 1})
    half = sample_frame(10, 10_000, (10,))[:6]
    status = run_session(
        _Scripted(info + _frames(0, 10) + half, ConnectionLost("pulled"), _frames(12, 10)),
        tmp_path / "r",
        about={},
    )
    np.testing.assert_array_equal(table(tmp_path / "r")["sequence"], [*range(10), *range(12, 22)])
    assert status["lost"] == 2
    assert status["crc_errors"] == 0


def test_other_channels_begin_another_file(tmp_path: Path) -> None:
    first = info_frame({"channels": ["light"], "unit": "V", "unit_per_count": 1}) + _frames(0, 10)
    second = info_frame({"channels": ["a b"], "unit": "V", "unit_per_count": 1}) + _frames(10, 10)
    run_session(_Scripted(first, second), tmp_path / "r", about={})
    one, two = read_recording(tmp_path / "r")
    assert one.channels == ("light_V",)
    assert two.channels == ("a_b_V",)


def test_a_fault_of_the_reader_ends_the_session(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such thing"):
        run_session(_Scripted(InputError("no such thing")), tmp_path / "r", about={})


def test_a_ring_overwrites_its_oldest(tmp_path: Path) -> None:
    ring = Ring.create(tmp_path / "ring", 2, capacity=64)
    for k in range(10):
        ring.append(np.column_stack([np.arange(30 * k, 30 * (k + 1)), np.zeros(30)]))
    other = Ring.attach(tmp_path / "ring")
    assert other.written == 300
    np.testing.assert_array_equal(other.latest(1000)[:, 0], np.arange(300 - 32, 300))
    ring.append(np.zeros((200, 2)))
    assert other.written == 500
    (tmp_path / "not").write_bytes(b"nothing")
    with pytest.raises(InputError, match="does not contain live data"):
        Ring.attach(tmp_path / "not")


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="this system sets no room aside")
def test_the_live_view_has_its_room_on_the_disk_before_it_is_written_to(tmp_path: Path) -> None:
    """A map into a file with holes ends the process where the disk is full by then."""
    ring = Ring.create(tmp_path / "live.bin", columns=4)
    found = (tmp_path / "live.bin").stat()
    ring.close()
    assert 512 * found.st_blocks >= found.st_size > 2_000_000
