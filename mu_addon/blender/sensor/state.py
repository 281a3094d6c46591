"""The real sensor beside its unit: one session a unit in a process of its own, looked into by a timer.

What runs is kept here, in Python, and never in the .blend file; recordings and calibrations are files in the
unit's study folder. So undo, loading a file and a render leave the session alone. The process ends with
Blender, whose end it notices at its standard input.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import importlib.util
import time
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ...errors import InputError, MuError
from ...run.child import DONE, FAILED, RUNNING, Child
from ...sensing.recording import FIXED
from ...usecases.sensor.traces import Traces
from ...usecases.sensor.watch import Watched
from ..shared import handlers
from ..simulate import state as simulation
from ..simulate import study_folder as studies
from ..unit.properties import BESIDE_BLEND_FILE
from . import twin

INTERVAL_S = 1 / 60
TWIN_S = 1 / 30
"""Seconds between poses of the twin, each of which moves every vertex."""
BINS = 600
"""Steps of time across the plot."""
MEAN_S = 0.1
"""The twin and the figures follow the mean of that long: noise goes, a bend of 2 Hz stays."""
SILENT_S = 3.0
"""A session that has not said anything for so long is told of as not answering."""
HOLD_S = 1.2
"""How long each angle of a guided sweep is held: a little more than what calibration reads."""
RECORDINGS, CALIBRATIONS, IN_USE = "recordings", "sensor", "calibration.toml"
ANGLES = ("angle_deg", "angle_low_deg", "angle_high_deg")


def _ports(group, context, typed):
    return [pair for pair in _found_ports if typed.lower() in " ".join(pair).lower()]


def _channels(group, context, typed):
    session = of(group.id_data)
    return [name for name in (session.channels if session else ()) if typed.lower() in name.lower()]


def _again(group, context):
    session = of(group.id_data)
    if session is not None:
        session.traces = None


class MU_PG_sensor(bpy.types.PropertyGroup):
    """How a unit's sensor is connected, calibrated and shown."""

    source: EnumProperty(
        name="From",
        description="Where the samples come from",
        items=[
            ("port", "Serial Port", "The sensor at a port of this computer"),
            ("simulated", "Simulated", "A sensor that is not there, bending by 45 degrees every 8 s"),
            ("replay", "Recording", "A recording as if it came from the sensor"),
        ],
    )
    port: StringProperty(
        name="Port",
        description="A port's device, or usb:VID:PID[:SERIAL], which finds it in any socket. Empty: the only "
        "USB port",
        search=_ports,
        search_options={"SUGGESTION"},
    )
    baud: IntProperty(name="Baud", description="Bits a second", default=115200, min=300)
    replay: StringProperty(
        name="Recording",
        description="Folder of the recording to play",
        subtype="DIR_PATH",
        options=BESIDE_BLEND_FILE,
    )
    speed: FloatProperty(
        name="Speed", description="Times as fast as it was", default=1.0, min=0.01, max=100.0
    )
    channel: StringProperty(
        name="Light",
        description="Channel of the light. Empty: the first whose name begins with light, or the first",
        search=_channels,
        search_options={"SUGGESTION"},
    )
    dark: StringProperty(
        name="Dark",
        description="Channel of the dark level, or volts. Empty: the first whose name begins with dark, or 0",
        search=_channels,
        search_options={"SUGGESTION"},
    )
    calibration: StringProperty(
        name="Calibration",
        description="A calibration.toml. Empty: the one that was made for this unit",
        subtype="FILE_PATH",
        options=BESIDE_BLEND_FILE,
    )
    data: StringProperty(
        name="Sweeps",
        description="Folder of a recording with angles marked, or of measured data",
        subtype="DIR_PATH",
        options=BESIDE_BLEND_FILE,
    )
    plot: BoolProperty(name="Plot", description="Draw the signal in the viewport", default=True)
    seconds: FloatProperty(
        name="Seconds",
        description="How much of the past the plot shows",
        default=10.0,
        min=1.0,
        max=600.0,
        update=_again,
    )
    hidden: StringProperty(options={"HIDDEN"})
    sweep_from: FloatProperty(name="From (deg)", description="Where a sweep begins and ends", default=0.0)
    sweep_to: FloatProperty(name="To (deg)", description="Where a sweep turns", default=45.0)
    sweep_step: FloatProperty(
        name="Step (deg)", description="From one angle held to the next", default=15.0, min=0.5
    )
    sweep_times: IntProperty(
        name="Times", description="How often to and fro: two show how well it repeats", default=2, min=2
    )
    known_deg: FloatProperty(name="Angle (deg)", description="The angle at which the unit is held now")


@attrs.define(eq=False)
class Reading:
    """What the sensor says now: means of the last moment, in V and degrees.

    light_V: without its dark level; possible: whether the calibration can give such a voltage.
    """

    light_V: float
    angle_deg: float = np.nan
    low_deg: float = np.nan
    high_deg: float = np.nan
    possible: bool = True


@attrs.define(eq=False)
class Guide:
    """A guided sweep: angles to hold in their order, how many were, and until when the present one is."""

    angles: list[float]
    held: int = 0
    until: float = 0.0

    @property
    def holding(self) -> bool:
        """Whether an angle is being held now."""
        return time.monotonic() < self.until

    @property
    def finished(self) -> bool:
        """Whether every angle was held."""
        return self.held == len(self.angles) and not self.holding


@attrs.define(eq=False)
class Session:
    """A unit's session, running or ended, and what of it is shown."""

    child: Child
    watched: Watched
    traces: Traces | None = None
    """Channels and angles over the last seconds; None until the channels are known, or to begin anew."""
    frozen: Traces | None = None
    """What the plot shows while it stands still."""
    ranges: dict[str, tuple[float, float]] = attrs.field(factory=dict)
    reading: Reading | None = None
    guide: Guide | None = None
    trouble: str = ""
    """Why the calibration cannot read this stream."""
    _shown: tuple[Any, ...] = ()
    read_at: float = 0.0

    @property
    def running(self) -> bool:
        """Whether its process is."""
        return self.child.state == RUNNING

    @property
    def state(self) -> str:
        """connected, searching, waiting, disconnected, paused or ended, as it said last."""
        return str(self.watched.status.get("state", "starting"))

    @property
    def fresh(self) -> bool:
        """Whether samples are coming."""
        return self.running and self.watched.starved_s < 1.0

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of what the sensor measures."""
        return self.watched.columns[len(FIXED) :]

    def look(self, calibration: Any, seconds: float) -> bool:
        """Take in what has come; returns whether it said how it goes. Never waits."""
        was_running = self.running
        self.child.poll()
        said = self.watched.look() or was_running != self.running
        if self.channels and (self.traces is None or self._shown != (self.channels, calibration)):
            self._shown = self.channels, calibration
            self.traces = Traces(len(self.channels) + len(ANGLES), seconds, BINS)
            self.ranges.clear()
            self.watched.rewind()
        rows = self.watched.fresh()
        if len(rows) and self.traces is not None:
            values = rows[:, len(FIXED) :]
            self.traces.add(rows[:, 0], np.column_stack([values, self._angles(values, calibration)]))
        return said

    def _angles(self, values: Any, calibration: Any) -> Any:
        """Angle and its band (n, 3) in degrees, nan without a calibration that reads these channels."""
        self.trouble = ""
        if calibration is not None:
            try:
                return np.column_stack(calibration.angle_of(_light(calibration, self.channels, values))[:3])
            except InputError as error:
                self.trouble = str(error)
        return np.full((len(values), len(ANGLES)), np.nan)

    def read(self, calibration: Any, channel: str, dark: str | float) -> None:
        """Take the mean of the last moment as the reading, with a calibration's angle where there is one."""
        rate = float(self.watched.status.get("rate_hz") or 0.0)
        rows = self.watched.latest(max(1, int(MEAN_S * rate)))
        self.reading = None
        if not len(rows) or channel not in self.channels:
            return
        mean = rows[:, len(FIXED) :].mean(axis=0, keepdims=True)
        if calibration is None or self.trouble:
            level = mean[0, self.channels.index(dark)] if dark in self.channels else dark
            self.reading = Reading(float(mean[0, self.channels.index(channel)]) - float(level))
            return
        light = _light(calibration, self.channels, mean)
        angle, low, high, possible = (float(part[0]) for part in calibration.angle_of(light))
        self.reading = Reading(float(light[0]), angle, low, high, bool(possible))


def _light(calibration: Any, channels: tuple[str, ...], values: Any) -> Any:
    # Where it is used: it brings scipy, which a Blender without the wheels lacks.
    from ...sensing.calibration import light_of

    return light_of(calibration, channels, values)


_sessions: dict[str, Session] = {}
_calibrating: dict[str, Path] = {}
"""Folders of the calibrations that run, by unit."""
_read: dict[Path, tuple[int, Any, str]] = {}
_found_ports: list[tuple[str, str]] = []
_rendering = False


def missing() -> list[str]:
    """Names of the modules that a sensor needs and this Blender does not find."""
    return [name for name in ("serial", "scipy") if importlib.util.find_spec(name) is None]


def of(root: Any) -> Session | None:
    """The unit's latest session in this Blender, running or ended, or None."""
    return _sessions.get(root.mu_unit.uuid)


def others(root: Any) -> list[str]:
    """UUIDs of other units whose sensors are connected, perhaps of another file."""
    return [uuid for uuid, s in _sessions.items() if s.running and uuid != root.mu_unit.uuid]


def find_ports() -> list[tuple[str, str]]:
    """Look for serial ports: pairs of name and words; raises InputError without pyserial."""
    from ...sensing.sources import ports

    _found_ports[:] = [(p.identity or p.device, f"{p.description}, {p.device}") for p in ports()]
    return _found_ports


def known_ports() -> list[tuple[str, str]]:
    """What `find_ports` found last."""
    return _found_ports


def connect(root: Any) -> Session:
    """Start a session for the unit, recording into its study folder; raises MuError."""
    settings, uuid = root.mu_sensor, root.mu_unit.uuid
    before = _sessions.get(uuid)
    if before is not None and before.running:
        raise InputError("this unit's sensor is connected already", str(before.watched.folder), "disconnect")
    folder = _unused(studies.settle(root) / RECORDINGS)
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
    environment = simulation.environment()
    child = Child(simulation.of_worker(line), folder / "blender", environment, ends_with_parent=True)
    _sessions[uuid] = Session(child, Watched(folder))
    _tick()
    return _sessions[uuid]


def _unused(folder: Path) -> Path:
    """A folder of this second within `folder` that is not there yet."""
    name = time.strftime("%Y-%m-%d_%H-%M-%S")
    tried = [folder / name, *(folder / f"{name}-{k}" for k in range(2, 100))]
    return next(path for path in tried if not path.exists())


def disconnect(uuid: str) -> None:
    """Have a session end; what it has is on disk."""
    session = _sessions.get(uuid)
    if session is not None:
        session.child.tell("stop")


def chosen(root: Any) -> tuple[str, str | float]:
    """Channel of the light, and that of the dark level or its volts: as the user says, or by their names."""
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
    """The calibration that is applied: the file the user chose, else the unit's own."""
    chosen_file = root.mu_sensor.calibration
    if chosen_file:
        return Path(bpy.path.abspath(chosen_file))
    return studies.folder_of(root) / CALIBRATIONS / IN_USE


def calibration(root: Any) -> tuple[Any, str]:
    """The unit's calibration or None, and why there is none; read again only when its file changes."""
    path = calibration_file(root)
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        return None, f"There is no {path}" if root.mu_sensor.calibration else ""
    kept = _read.get(path)
    if kept is None or kept[0] != changed:
        from ...sensing.calibration import read_calibration

        try:
            kept = changed, read_calibration(path), ""
        except InputError as error:
            kept = changed, None, str(error)
        _read[path] = kept
    return kept[1:]


def calibrating(root: Any) -> str:
    """Name under which the unit's calibration runs beside its simulation."""
    return f"{root.mu_unit.uuid}:calibrate"


def calibrate(root: Any, data: Path) -> None:
    """Calibrate from a folder in a process of its own, and then apply what it finds; raises MuError."""
    if calibrating(root) in simulation.running():
        raise InputError("it is being calibrated", str(data), "wait for it")
    folder = _unused(studies.settle(root) / CALIBRATIONS)
    light, dark = chosen(root)
    line = ["calibrate", str(data), "--out", str(folder), "--json"]
    if light:
        line += ["--channel", light]
    if dark:
        line += ["--dark", str(dark)]
    simulation.launch(calibrating(root), simulation.of_worker(line), folder / "blender")
    _calibrating[root.mu_unit.uuid] = folder
    _tick()


def zero(root: Any, angle_deg: float) -> None:
    """Have the calibration read the present voltage as that angle; raises MuError."""
    from ...sensing.calibration import write_calibration

    found, trouble = calibration(root)
    session = of(root)
    if found is None or session is None or session.reading is None or not session.fresh:
        raise InputError(trouble or "no calibrated signal is there", "zero", "connect and calibrate first")
    zeroed = found.zeroed(session.reading.light_V, angle_deg)
    words = f"zeroed at {angle_deg:g} degrees, {time.strftime('%Y-%m-%d %H:%M:%S')}"
    write_calibration(studies.settle(root) / CALIBRATIONS / IN_USE, zeroed, words)
    root.mu_sensor.calibration = ""


def sweep(settings: Any) -> list[float]:
    """The angles of a guided sweep, to and fro, each end once between two ways."""
    low, high, step = settings.sweep_from, settings.sweep_to, settings.sweep_step
    count = int(abs(high - low) / step + 1e-6)
    there = [low + step * k * (1 if high >= low else -1) for k in range(count + 1)]
    if abs(there[-1] - high) > 1e-3 * step:
        there.append(high)
    there = [round(angle, 3) for angle in there]
    return there + (there[-2::-1] + there[1:]) * (settings.sweep_times - 1) + there[-2::-1]


def hold(session: Session) -> None:
    """Mark the guided sweep's next angle as being held from now on."""
    guide = session.guide
    if guide is not None and guide.held < len(guide.angles) and not guide.holding:
        session.child.tell(f"mark angle {guide.angles[guide.held]:g}")
        guide.held += 1
        guide.until = time.monotonic() + HOLD_S


def poll() -> tuple[bool, bool]:
    """Look into every session; returns whether samples came, and whether panels have something new to say."""
    moved = said = False
    roots = {o.mu_unit.uuid: o for o in bpy.data.objects if o.mu_unit.uuid}
    for uuid, session in _sessions.items():
        if not session.running:
            continue
        root = roots.get(uuid)
        found = None if root is None else calibration(root)[0]
        seconds = 10.0 if root is None else root.mu_sensor.seconds
        said |= session.look(found, seconds)
        moved |= session.fresh
        guide = session.guide
        if guide is not None and guide.until and not guide.holding:
            guide.until = 0.0
            said = True
            if guide.finished and root is not None:
                said |= _finish(root, session)
        now = time.monotonic()
        if root is not None and now - session.read_at >= TWIN_S:
            session.read_at = now
            session.read(found, *chosen(root))
            if not _rendering:
                said |= twin.follow(root, session.reading, session.fresh)
    for uuid, folder in list(_calibrating.items()):
        said |= _take(uuid, folder)
    return moved, said


def _finish(root: Any, session: Session) -> bool:
    """After the last angle of a guided sweep: calibrate from what was recorded."""
    session.guide = None
    try:
        calibrate(root, session.watched.folder)
    except MuError as error:
        session.trouble = str(error)
    return True


def _take(uuid: str, folder: Path) -> bool:
    """Apply a calibration that is finished."""
    child = simulation.of(f"{uuid}:calibrate")
    if child is not None and child.state == RUNNING:
        return False
    del _calibrating[uuid]
    if child is not None and child.state == DONE:
        from ...sensing.calibration import read_calibration, write_calibration

        try:
            found = read_calibration(folder / IN_USE)
            write_calibration(folder.parent / IN_USE, found, f"made in {folder.name}, with its report")
        except MuError as error:
            child.error = {"what": error.what, "where": error.where, "what_to_do": error.remedy}
            child.state = FAILED
    return True


def _poll() -> float | None:
    moved, said = poll()
    if moved or said:
        _redraw(said)
    busy = _calibrating or any(session.running for session in _sessions.values())
    return INTERVAL_S if busy else None


def _redraw(panels: bool) -> None:
    """Have the views drawn again, and their sidebars only where these have something new to say."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "WINDOW" or (panels and region.type == "UI"):
                    region.tag_redraw()


def _tick() -> None:
    if not bpy.app.timers.is_registered(_poll):
        # Persistent: loading another file does not end a session.
        bpy.app.timers.register(_poll, first_interval=INTERVAL_S, persistent=True)


@persistent
def _render_began(*_: Any) -> None:
    # While a render reads the scene, nothing of it may change.
    global _rendering
    _rendering = True


@persistent
def _render_ended(*_: Any) -> None:
    global _rendering
    _rendering = False


_HANDLERS = {
    "render_init": _render_began,
    "render_complete": _render_ended,
    "render_cancel": _render_ended,
}


def register() -> None:
    """The property group, the one property on objects that holds it, and the handlers."""
    bpy.utils.register_class(MU_PG_sensor)
    bpy.types.Object.mu_sensor = PointerProperty(type=MU_PG_sensor)
    handlers.add(_HANDLERS)


def unregister() -> None:
    """End every session, and take everything out; values stay in the file."""
    for uuid in _sessions:
        disconnect(uuid)
    for session in _sessions.values():
        session.watched.close()
    _sessions.clear()
    _calibrating.clear()
    if bpy.app.timers.is_registered(_poll):
        bpy.app.timers.unregister(_poll)
    handlers.remove(_HANDLERS)
    del bpy.types.Object.mu_sensor
    bpy.utils.unregister_class(MU_PG_sensor)
