"""One session with a sensor: read, record, then show; reconnects after a loss, releases ports on request.

A thread only reads the port, so that neither the disk nor a display can delay it.
"""

from __future__ import annotations

import json
import os
import queue
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import OutputError
from ..files import plain
from .decoder import Decoder
from .reconnecting import Clock, Control, Failure, Piece, read_on
from .recording import Recorder, columns_of
from .ring_buffer import Ring
from .samples import Samples
from .sources import Source

EventHandler = Callable[[str, dict[str, Any]], None]
# Values (n, c) in the channels' units -> further columns (n, d), shown beside them and not recorded.
Derive = Callable[[tuple[str, ...], Array], tuple[tuple[str, ...], Array]]

STATUS = "status.json"
SWEEP = "sweep"
"""Mark of the start of a guided sweep: earlier marks in a recording no longer count."""
BACK = "back"
"""Mark that takes back the last angle of a guided sweep."""
LOSSES = {
    "lost": "lost",
    "crc_errors": "wrong CRC",
    "malformed": "unreadable",
    "rejected_bytes": "bytes unreadable",
    "repeated": "repeated",
    "misnumbered": "numbered wrong",
    "incomplete": "incomplete",
    "overlong": "bytes without a line end",
    "restarts": "restarts",
    "reconnects": "reconnects",
}
"""Counters of losses in a session's status, with their names."""
_STATUS_S = 0.2


def run_session(
    source: Source,
    folder: Path,
    *,
    about: Mapping[str, Any],
    control: Control | None = None,
    seconds: float | None = None,
    derive: Derive | None = None,
    keep_time: bool = False,
    on_event: EventHandler = lambda event, details: None,
) -> dict[str, Any]:
    """Record a source into `folder` until it ends, `seconds` have passed, or `control` asks it to stop.

    status.json is written five times a second and names the file of the latest samples (a Ring: time_s,
    device_s, sequence, channels, columns of `derive`). about: entries for the recording's index. on_event:
    called with events, and with "status" at each write. keep_time: record the source's clock as time, as for
    a replayed recording. Returns the last status. Raises InputError and OutputError.
    """
    control = control or Control()
    clock = Clock()
    pieces: queue.SimpleQueue[Piece] = queue.SimpleQueue()
    recorder = Recorder(folder, {**about, "started": time.strftime("%Y-%m-%dT%H:%M:%S%z")})
    view = _View(folder, recorder, clock.start, derive, keep_time, on_event)
    reader = threading.Thread(target=read_on, args=(source, pieces, control, clock), daemon=True)
    reader.start()
    try:
        running = True
        while running:
            running = _take(pieces, view) and not control.stop.is_set()
            while not control.marks.empty():
                view.event("mark", clock.now(), text=control.marks.get())
            if seconds is not None and clock.now() - clock.start >= seconds:
                running = False
            view.tick(clock.now())
        control.stop.set()
        reader.join(timeout=5.0)
        while not pieces.empty():
            _take(pieces, view)
        view.take(view.decoder.finish(clock.now()), clock.now())
        status = view.end(clock.now())
        recorder.close()
        return status
    finally:
        control.stop.set()
        # A failure to write now was reported when it first occurred.
        with suppress(OutputError):
            recorder.close()
        view.close()


def _take(pieces: queue.SimpleQueue[Piece], view: _View) -> bool:
    """Decode, record and show new bytes, waiting a little; False at the end."""
    try:
        piece = pieces.get(timeout=0.05)
    except queue.Empty:
        return True
    while True:
        if isinstance(piece, Failure):
            raise piece.error
        if piece.event:
            if piece.event in ("disconnected", "paused"):
                view.decoder.interrupted()
            view.event(piece.event, piece.at, detail=piece.detail)
            if piece.event == "ended":
                return False
        if piece.data:
            view.take(view.decoder.feed(piece.data, piece.at), piece.at)
        try:
            piece = pieces.get_nowait()
        except queue.Empty:
            return True


class _View:
    """View of a session: the recorder first, then ring and status."""

    def __init__(
        self,
        folder: Path,
        recorder: Recorder,
        start: float,
        derive: Derive | None,
        keep_time: bool,
        on_event: EventHandler,
    ) -> None:
        self.decoder = Decoder()
        self.folder, self.recorder, self.start = folder, recorder, start
        self.derive, self.keep_time, self.on_event = derive, keep_time, on_event
        self.state, self.port = "searching", ""
        self.reconnects = -1
        self._ring: Ring | None = None
        self._ring_name, self._rings = "", 0
        self._columns: tuple[str, ...] = ()
        self._latest: Array = np.empty(0)
        self._format: str | None = None
        self._complaint: tuple[str, str] | None = None
        self._last_status_s = -np.inf
        self._rate: list[tuple[float, int]] = []

    def take(self, groups: list[Samples], at: float) -> None:
        """Record the samples in bytes that came at host time `at`, and keep unreadable ones."""
        if self.decoder.format != self._format:
            self._format = self.decoder.format
            self.event("format", at, detail=self._format)
        for samples in groups:
            if self.keep_time:
                kept = np.where(np.isfinite(samples.device_s), self.start + samples.device_s, samples.host_s)
                samples = attrs.evolve(samples, host_s=kept)
            self.recorder.write(samples, self.start)
            self._show(samples)
        if self.decoder.rejects:
            self.recorder.reject(self.decoder.rejects, at - self.start)
            self.decoder.rejects.clear()
        complaint = self.decoder.complaint
        if complaint is not None and complaint != self._complaint:
            what, remedy = complaint
            self.event("unreadable", at, detail=what, what_to_do=remedy)
        self._complaint = complaint

    def _show(self, samples: Samples) -> None:
        names = columns_of(samples)
        table = [samples.host_s - self.start, samples.device_s, samples.sequence, *samples.values.T]
        if self.derive is not None:
            more, values = self.derive(names[3:], samples.values)
            names, table = (*names, *more), [*table, *values.T]
        if names != self._columns or self._ring is None:
            self._columns = names
            self._ring_name = f"live-{self._rings}.bin"
            self._rings += 1
            self._ring = Ring.create(self.folder / self._ring_name, len(names))
        rows = np.column_stack(table)
        self._ring.append(rows)
        self._latest = rows[-1]

    def event(self, name: str, at: float, **details: Any) -> None:
        if name == "connected":
            self.reconnects += 1
            self.state, self.port = "connected", str(details.get("detail", ""))
        elif name in ("disconnected", "paused", "waiting", "ended"):
            self.state = name
        self.recorder.event(name, at - self.start, **details)
        self.on_event(name, details)
        self._last_status_s = -np.inf

    def tick(self, now: float) -> None:
        """Write the index once a second, status five times; called often."""
        self.recorder.tick(now - self.start, attrs.asdict(self.decoder.counters))
        if now - self._last_status_s >= _STATUS_S:
            self._last_status_s = now
            self._rate = [*self._rate, (now, self.decoder.counters.samples)][-10:]
            status = self.status(now)
            self._write_status(status)
            self.on_event("status", status)

    def status(self, now: float) -> dict[str, Any]:
        rate = 0.0
        if len(self._rate) > 1:
            (t0, n0), (t1, n1) = self._rate[0], self._rate[-1]
            rate = (n1 - n0) / (t1 - t0) if t1 > t0 else 0.0
        return {
            "state": self.state,
            "port": self.port,
            "format": self._format,
            "columns": self._columns,
            "live": self._ring_name,
            "latest": self._latest,
            "rate_hz": round(rate, 2),
            "duration_s": round(now - self.start, 3),
            "written": time.time(),
            "pid": os.getpid(),
            "reconnects": max(0, self.reconnects),
            "rows": self.recorder.rows,
            "complaint": list(self.decoder.complaint or ()),
            **attrs.asdict(self.decoder.counters),
        }

    def end(self, now: float) -> dict[str, Any]:
        """Write the last status, with everything on disk."""
        self.state = "ended"
        self.recorder.tick(np.inf, attrs.asdict(self.decoder.counters))
        status = {**self.status(now), "live": "", "complaint": list(self.decoder.why_no_sample or ())}
        self._write_status(status)
        return status

    def close(self) -> None:
        """Remove the live view."""
        if self._ring is not None:
            self._ring.close()
            self._ring = None
        for path in self.folder.glob("live-*.bin"):
            # Windows keeps a file that somebody looks into.
            with suppress(OSError):
                path.unlink(missing_ok=True)

    def _write_status(self, status: Mapping[str, Any]) -> None:
        # Not flushed to the disk: it is for those who look on, and gone with the session.
        beside = self.folder / f".{STATUS}.part"
        try:
            beside.write_text(json.dumps(plain(status)))
            beside.replace(self.folder / STATUS)
        except OSError:
            # A reader on Windows may hold it open for a moment; the next one comes soon.
            with suppress(OSError):
                beside.unlink(missing_ok=True)
