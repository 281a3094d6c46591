"""Sources of bytes: a serial port, a recording played again, or a simulated sensor."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import attrs
import numpy as np

from ..errors import InputError
from .framing import info_frame, sample_frame
from .recording import Recording, read_recording
from .settings import BAUD

_WAIT_S = 0.02


class ConnectionLost(Exception):
    """The line is interrupted; it may come back."""


class EndOfStream(Exception):
    """The source has ended: no more bytes will come."""


class Source(Protocol):
    """A line that is opened, read until it raises Gone or Ended, closed, and perhaps opened again."""

    def open(self) -> str:
        """Open the line and describe it; raises ConnectionLost if it is absent now, else InputError."""

    def read(self) -> bytes:
        """The bytes that have come, after at most a few hundredths of a second; raises Gone and Ended."""

    def close(self) -> None:
        """Close the line, so that others can open it."""


@attrs.frozen
class Port:
    """A serial port, and the USB device behind it where there is one."""

    device: str
    description: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None

    @property
    def identity(self) -> str | None:
        """usb:VID:PID or usb:VID:PID:SERIAL, the same at every socket; None where it is no USB device."""
        if self.vid is None or self.pid is None:
            return None
        serial = f":{self.serial_number}" if self.serial_number else ""
        return f"usb:{self.vid:04x}:{self.pid:04x}{serial}"


def ports() -> list[Port]:
    """The serial ports of this computer, USB devices first; raises InputError without pyserial."""
    _serial()
    from serial.tools.list_ports import comports

    found = [Port(p.device, p.description or "", p.vid, p.pid, p.serial_number) for p in comports()]
    return sorted(found, key=lambda port: (port.identity is None, port.device))


def find(name: str, present: list[Port]) -> Port | None:
    """The port that a name means: a device, or usb:VID:PID[:SERIAL]; None if it is not there.

    A name without a serial number that fits several devices raises InputError.
    """
    if not name.startswith("usb:"):
        return next((port for port in present if port.device == name), None)
    wanted = name.lower().split(":")
    fitting = [
        port
        for port in present
        if port.identity is not None and port.identity.lower().split(":")[: len(wanted)] == wanted
    ]
    if len(fitting) > 1:
        names = ", ".join(f"{port.identity} at {port.device}" for port in fitting)
        raise InputError(f"{len(fitting)} devices fit {name}", names, "name one with its serial number")
    return fitting[0] if fitting else None


class SerialLine:
    """A serial port by pyserial; a USB device is found again in any socket.

    name: of the device file, or usb:VID:PID[:SERIAL]; baud: bits a second.
    """

    def __init__(
        self, name: str, baud: int = BAUD.default, list_ports: Callable[[], list[Port]] = ports
    ) -> None:
        self.name, self.baud = name, baud
        self._list_ports = list_ports
        self._line: Any = None

    def open(self) -> str:
        """Open the port for exclusive use and describe it.

        Raises Gone where it is absent or cannot be opened, InputError where several devices fit or pyserial
        is missing.
        """
        serial = _serial()
        port = find(self.name, self._list_ports())
        if port is None and self.name.startswith("usb:"):
            raise ConnectionLost(f"{self.name} is not plugged in")
        device = self.name if port is None else port.device
        try:
            self._line = serial.Serial(device, self.baud, timeout=_WAIT_S, exclusive=True)
        except (OSError, ValueError) as error:
            raise ConnectionLost(str(error)) from None
        if port is not None and port.identity is not None:
            # From now on this device is meant, not its socket.
            self.name = port.identity
        return device if port is None else f"{device} ({port.description})"

    def read(self) -> bytes:
        """The bytes that have come, after a wait of 0.02 s at most; raises Gone where the port fails."""
        try:
            data = self._line.read(1)
            waiting = self._line.in_waiting
            return bytes(data + self._line.read(waiting)) if waiting else bytes(data)
        # TypeError: pyserial's, when another thread closes the port under it.
        except (OSError, TypeError) as error:
            raise ConnectionLost(str(error)) from None

    def close(self) -> None:
        """Close the port."""
        if self._line is not None:
            try:
                self._line.close()
            except OSError:
                pass
            self._line = None


class Replay:
    """A recording as the CSV lines of a device, `speed` times as fast, or at once if 0.

    Raises InputError where the recording cannot be read or contains no samples.
    """

    def __init__(self, folder: Path, speed: float = 1.0) -> None:
        self.folder, self.speed = Path(folder), speed
        recordings = read_recording(self.folder)
        if not recordings:
            raise InputError("the recording contains no samples", str(folder), "choose another recording")
        self._lines = _lines(recordings)
        self._ahead: tuple[float, bytes] | None = None
        self._start = 0.0

    def open(self) -> str:
        """Start the replay's clock and describe the source."""
        self._start = time.perf_counter()
        return f"recording {self.folder.name}"

    def read(self) -> bytes:
        """The lines due by now, 2000 at most; raises Ended after the last one."""
        until = (time.perf_counter() - self._start) * self.speed if self.speed > 0 else np.inf
        out: list[bytes] = []
        while len(out) < 2000:
            if self._ahead is None:
                self._ahead = next(self._lines, None)
            if self._ahead is None:
                if out:
                    break
                raise EndOfStream
            if self._ahead[0] > until:
                break
            out.append(self._ahead[1])
            self._ahead = None
        if not out:
            time.sleep(_WAIT_S)
        return b"".join(out)

    def close(self) -> None:
        """Do nothing: no file is kept open."""


def _lines(recordings: list[Recording]) -> Iterator[tuple[float, bytes]]:
    """Seconds from the start, and the line of each sample; a header before each file."""
    # The decoder does not trust the first line of all.
    yield 0.0, b"\n"
    first = next(iter(recordings)).columns["time_s"][0]
    for recording in recordings:
        names = recording.channels
        yield 0.0, ("sequence,time_s," + ",".join(names) + "\n").encode()
        time_s, sequence = (recording.columns[name].tolist() for name in ("time_s", "sequence"))
        values = np.column_stack([recording.columns[name] for name in names]).tolist()
        for t, number, row in zip(time_s, sequence, values, strict=True):
            yield t - first, f"{number:.0f},{t!r},{','.join(map(repr, row))}\n".encode()


class Simulated:
    """A simulated sensor that sends its channels' voltages as binary frames.

    volts: of time in s, a voltage in V for each channel; rate_hz: samples a second; noise_V: standard
    deviation of white noise in V; full_scale_V: voltage in V of the largest count, 65535; seed: of the noise.
    """

    def __init__(
        self,
        volts: Callable[[float], tuple[float, ...]],
        channels: tuple[str, ...] = ("light",),
        rate_hz: float = 100.0,
        noise_V: float = 0.0,
        full_scale_V: float = 3.3,
        seed: int = 0,
    ) -> None:
        self.volts, self.channels, self.rate_hz = volts, channels, rate_hz
        self._per_count = full_scale_V / 65535
        self._noise, self._random = noise_V, np.random.default_rng(seed)
        self._sent, self._start = 0, 0.0

    def open(self) -> str:
        """Start the sensor's clock, going on where it stopped, and describe the source."""
        self._start = time.perf_counter() - self._sent / self.rate_hz
        return "simulated sensor"

    def read(self) -> bytes:
        """The frames due by now, after a wait of 0.02 s, with an INFO about once a second."""
        time.sleep(_WAIT_S)
        due = int((time.perf_counter() - self._start) * self.rate_hz)
        out = []
        for k in range(self._sent, due):
            if k % max(1, round(self.rate_hz)) == 0:
                info = {"channels": self.channels, "unit": "V", "unit_per_count": self._per_count}
                out.append(info_frame({**info, "firmware": "simulated"}))
            t = k / self.rate_hz
            noisy = np.array(self.volts(t)) + self._noise * self._random.normal(size=len(self.channels))
            counts = np.clip(np.round(noisy / self._per_count), 0, 65535).astype(int)
            out.append(sample_frame(k, round(1e6 * t), counts.tolist()))
        self._sent = max(self._sent, due)
        return b"".join(out)

    def close(self) -> None:
        """Do nothing: there is no line."""


def _serial() -> Any:
    try:
        import serial
    except ImportError:
        raise InputError("pyserial is not installed", "serial port", "pip install pyserial") from None
    return serial
