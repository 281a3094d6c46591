"""The real sensor of a unit: one session a unit in a separate process, polled by a timer.

Sessions are kept here, in Python, and never in the .blend file; recordings and calibrations are files in the
unit's study folder. So undo, loading a file and a render leave the session alone. The process ends with
Blender, when its standard input closes.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...errors import InputError, MuError
from ...run.child import DONE, FAILED, RUNNING
from ...run.folder import write_run
from ...sensing.session import BACK
from ...sensing.watch import Watched
from ...studies.calibrate import Calibrate
from ..jobs import start_child
from ..jobs.start_child import JobKind
from ..shared import viewports
from ..shared.file_cache import FileCache
from ..shared.registration import at_end, handler, timer
from ..simulate import study_folder as studies
from . import twin
from .session import Session

NEEDED = ("serial", "scipy")
"""Modules that a sensor needs."""
INTERVAL_S = 1 / 60
TWIN_S = 1 / 30
"""Seconds between poses of the twin, each of which moves every vertex."""
SILENT_S = 3.0
"""Seconds without a new status after which a session is shown as not answering."""
HOLD_S = 1.2
"""Seconds for which each angle of a guided sweep is held: a little more than calibration reads."""
RECORDINGS, CALIBRATIONS, IN_USE = "recordings", "sensor", "calibration.toml"


_sessions: dict[str, Session] = {}
_calibrating: dict[str, Path] = {}
"""Folders of the running calibrations, by the key of the job."""
_calibrations: FileCache[tuple[Any, str]] = FileCache()
_found_ports: list[tuple[str, str]] = []
_rendering = False


def missing() -> list[str]:
    """Names of the modules that a sensor needs and this Blender does not have."""
    return start_child.missing(NEEDED)


def of(root: Any) -> Session | None:
    """The unit's latest session in this Blender, running or ended, or None."""
    return _sessions.get(root.mu_unit.uuid)


def others(root: Any) -> list[str]:
    """UUIDs of other units whose sensors are connected, perhaps of another file."""
    return [uuid for uuid, s in _sessions.items() if s.running and uuid != root.mu_unit.uuid]


def find_ports() -> list[tuple[str, str]]:
    """Look for serial ports: pairs of name and description; raises InputError without pyserial."""
    from ...sensing.sources import ports

    _found_ports[:] = [(p.identity or p.device, f"{p.description}, {p.device}") for p in ports()]
    return _found_ports


def known_ports() -> list[tuple[str, str]]:
    """Last result of `find_ports`."""
    return _found_ports


def connect(root: Any) -> Session:
    """Start a session for the unit, recording into its study folder; raises MuError."""
    settings, uuid = root.mu_sensor, root.mu_unit.uuid
    before = _sessions.get(uuid)
    if before is not None and before.running:
        raise InputError("this unit's sensor is connected already", str(before.watched.folder), "disconnect")
    folder = _unused(studies.assign_folder(root) / RECORDINGS)
    if settings.source == "replay":
        words = ["replay", bpy.path.abspath(settings.replay), "--speed", f"{settings.speed:g}"]
    else:
        words = ["record", "--baud", str(settings.baud)]
        if settings.source == "simulated":
            words.append("--simulate")
        elif settings.port:
            words += ["--port", settings.port]
    line = [*words, "--out", str(folder), "--controlled", "--json"]
    if before is not None:
        before.watched.close()
    child = start_child.start(line, folder, ends_with_parent=True)
    _sessions[uuid] = Session(child, Watched(folder))
    _poll.soon(INTERVAL_S)
    return _sessions[uuid]


def _unused(folder: Path) -> Path:
    """A new folder named by the time within `folder`."""
    name = time.strftime("%Y-%m-%d_%H-%M-%S")
    tried = [folder / name, *(folder / f"{name}-{k}" for k in range(2, 100))]
    return next(path for path in tried if not path.exists())


def disconnect(uuid: str) -> None:
    """Ask a session to end; its samples are on disk."""
    session = _sessions.get(uuid)
    if session is not None:
        session.child.send("stop")


def chosen(root: Any) -> tuple[str, str | float]:
    """Channel of the light, and that of the dark level or its volts: chosen by the user, or by name."""
    settings, session = root.mu_sensor, of(root)
    channels = session.channels if session else ()
    light = next((c for c in channels if c.startswith("light")), channels[0] if channels else "")
    if settings.dark:
        try:
            dark: str | float = float(settings.dark)
        except ValueError:
            dark = settings.dark
    else:
        dark = next((c for c in channels if c.startswith("dark")), 0.0)
    return settings.channel or light, dark


def calibration_file(root: Any) -> Path:
    """File of the applied calibration: the one the user chose, else the unit's."""
    chosen_file = root.mu_sensor.calibration
    if chosen_file:
        return Path(bpy.path.abspath(chosen_file))
    return studies.folder_of(root) / CALIBRATIONS / IN_USE


def calibration(root: Any) -> tuple[Any, str]:
    """The unit's calibration, or None and the reason; read again only when its file changes."""
    path = calibration_file(root)
    known = _calibrations.read([path], lambda: _read_calibration(path))
    return known or (None, f"There is no {path}" if root.mu_sensor.calibration else "")


def _read_calibration(path: Path) -> tuple[Any, str]:
    from ...sensing.calibration import read_calibration

    try:
        return read_calibration(path), ""
    except InputError as error:
        return None, str(error)


def latest_calibration(root: Any) -> Path:
    """Folder of the unit's latest calibration."""
    folder = studies.folder_of(root) / CALIBRATIONS
    return max(folder.glob("*/"), default=folder)


CALIBRATION = JobKind(
    "calibrate", lambda root: root.mu_unit.uuid, latest_calibration, "calibration", prefix="sensor_"
)


def calibrate(root: Any, data: Path) -> None:
    """Calibrate from a folder in a separate process, and then apply the result; raises MuError."""
    folder = _unused(studies.assign_folder(root) / CALIBRATIONS)
    light, dark = chosen(root)
    # The calibrating process counts its samples: more may arrive until then.
    inputs = Calibrate(data=(data,), channel=light, dark=str(dark) if dark else "").texts()
    CALIBRATION.start(root, folder, lambda folder: write_run(folder, Calibrate.layout(), inputs))
    _calibrating[CALIBRATION.key(root)] = folder
    _poll.soon(INTERVAL_S)


def zero(root: Any, angle_deg: float) -> None:
    """Shift the calibration so that the present voltage reads as that angle; raises MuError."""
    from ...sensing.calibration import write_calibration

    found, trouble = calibration(root)
    session = of(root)
    if found is None or session is None or session.reading is None or not session.fresh:
        raise InputError(trouble or "no calibrated signal is there", "zero", "connect and calibrate first")
    zeroed = found.zeroed(session.reading.light_V, angle_deg)
    words = f"zeroed at {angle_deg:g} degrees, {time.strftime('%Y-%m-%d %H:%M:%S')}"
    write_calibration(studies.assign_folder(root) / CALIBRATIONS / IN_USE, zeroed, words)
    root.mu_sensor.calibration = ""


def sweep_angles(settings: Any) -> list[float]:
    """Angles of a guided sweep, to and fro, each end once between two ways."""
    low, high, step = settings.sweep_from, settings.sweep_to, settings.sweep_step
    count = int(abs(high - low) / step + 1e-6)
    there = [low + step * k * (1 if high >= low else -1) for k in range(count + 1)]
    if abs(there[-1] - high) > 1e-3 * step:
        there.append(high)
    there = [round(angle, 3) for angle in there]
    return there + (there[-2::-1] + there[1:]) * (settings.sweep_times - 1) + there[-2::-1]


def hold(session: Session) -> None:
    """Mark the guided sweep's next angle as held from now on."""
    guide = session.guide
    if guide is not None and guide.held < len(guide.angles) and not guide.holding:
        session.child.send(f"mark angle {guide.angles[guide.held]:g}")
        guide.held += 1
        guide.until = time.monotonic() + HOLD_S


def back(session: Session) -> None:
    """Take back the guided sweep's last angle, also while it is held."""
    guide = session.guide
    if guide is not None and guide.held:
        session.child.send(f"mark {BACK}")
        guide.held, guide.until = guide.held - 1, 0.0
        del guide.light_V[guide.held :]


def poll() -> tuple[bool, bool]:
    """Update every session; return True if samples came, and True if panels have to be redrawn."""
    sampled = news = False
    roots = {o.mu_unit.uuid: o for o in bpy.data.objects if o.mu_unit.uuid}
    for uuid, session in _sessions.items():
        if not session.running:
            continue
        root = roots.get(uuid)
        found = None if root is None else calibration(root)[0]
        seconds = 10.0 if root is None else root.mu_sensor.seconds
        news |= session.update(found, seconds)
        sampled |= session.fresh
        guide = session.guide
        if guide is not None and guide.until and not guide.holding:
            guide.until = 0.0
            news = True
            if root is not None:
                session.read(found, *chosen(root))
                guide.light_V.append(session.reading.light_V if session.reading is not None else np.nan)
                if guide.finished and guide.odd is None:
                    news |= _finish(root, session)
        now = time.monotonic()
        if root is not None and now - session.read_at >= TWIN_S:
            session.read_at = now
            session.read(found, *chosen(root))
            if not _rendering:
                news |= twin.set_pose(root, session.reading, session.fresh)
    for key, folder in list(_calibrating.items()):
        news |= _apply_finished(key, folder)
    return sampled, news


def _finish(root: Any, session: Session) -> bool:
    """Calibrate from the recording after the last angle of a guided sweep."""
    session.guide = None
    try:
        calibrate(root, session.watched.folder)
    except MuError as error:
        session.trouble = str(error)
    return True


def _apply_finished(key: str, folder: Path) -> bool:
    """Apply a calibration that is finished."""
    child = start_child.child_of(key)
    if child is not None and child.state == RUNNING:
        return False
    del _calibrating[key]
    if child is not None and child.state == DONE:
        from ...sensing.calibration import read_calibration, write_calibration

        try:
            found = read_calibration(folder / IN_USE)
            write_calibration(folder.parent / IN_USE, found, f"made in {folder.name}, with its report")
        except MuError as error:
            child.error = {"what": error.what, "where": error.where, "what_to_do": error.remedy}
            child.state = FAILED
    return True


@timer(lasts=True)
def _poll() -> float | None:
    sampled, news = poll()
    if sampled or news:
        viewports.redraw_regions("WINDOW", *(["UI"] if news else []))
    busy = _calibrating or any(session.running for session in _sessions.values())
    return INTERVAL_S if busy else None


@handler("render_init")
def _render_began(*_: Any) -> None:
    # While a render reads the scene, it must not change.
    global _rendering
    _rendering = True


@handler("render_complete", "render_cancel")
def _render_ended(*_: Any) -> None:
    global _rendering
    _rendering = False


@at_end
def _end_all() -> None:
    """End every session."""
    for uuid in _sessions:
        disconnect(uuid)
    for session in _sessions.values():
        session.watched.close()
    _sessions.clear()
    _calibrating.clear()
