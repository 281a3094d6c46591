"""Connect the real sensor, mark, calibrate, zero, and show its twin."""

from pathlib import Path

import bpy

from ...design.printing.finding import counted
from ...errors import InputError
from ...sensing.session import SWEEP
from ..jobs.operators import FILES, RUN_FILES, job_operators
from ..results.operators import MotionOperator
from ..shared import viewports
from ..shared.blender_property import Flag, Text
from ..shared.operators import FreeOperator, ask_properties, operator
from ..simulate import study_folder as studies
from ..unit.base_classes import UnitOperator
from . import state as sensor
from . import twin
from .session import Guide

NOT_CONNECTED = "Connect the sensor first"


class SessionOperator(UnitOperator):
    """An operator on the active unit whose sensor is connected."""

    @classmethod
    def trouble(cls, root):
        session = sensor.of(root)
        return NOT_CONNECTED if session is None or not session.running else ""


@operator(FreeOperator, "Find Ports", undo=False)
def sensor_ports(operator):
    """Look for serial ports"""
    found = sensor.find_ports()
    operator.report(
        {"INFO"}, counted(len(found), "serial port", "serial ports") if found else "No serial port is there"
    )


@operator(UnitOperator, "Use Port", name=Text("Name", "A port's device, or usb:VID:PID[:SERIAL]"))
def sensor_port(root, name):
    """Use this port"""
    root.mu_sensor.port = name


def _sensor_connect_trouble(root):
    session, settings = sensor.of(root), root.mu_sensor
    if sensor.missing():
        return f"Not in this Blender: {', '.join(sensor.missing())}"
    if settings.source == "replay" and not settings.replay:
        return "Choose the folder of a recording first"
    return "The sensor is connected" if session is not None and session.running else ""


@operator(UnitOperator, "Connect and Record", undo=False, trouble=_sensor_connect_trouble)
def sensor_connect(root):
    """Read the sensor in a child process; every sample is written to disk before it is shown"""
    sensor.connect(root)
    viewports.redraw()


@operator(
    UnitOperator,
    "Disconnect",
    undo=False,
    others=Flag("Others", "The sensors of all other units instead", options={"SKIP_SAVE"}),
)
def sensor_disconnect(root, others):
    """End the session: the port is free, and the recording complete"""
    for uuid in sensor.others(root) if others else [root.mu_unit.uuid]:
        sensor.disconnect(uuid)


@operator(SessionOperator, "Release Port", undo=False)
def sensor_pause(root):
    """Release the port for another program, or open it again; the session continues"""
    session = sensor.of(root)
    session.child.send("resume" if session.state == "paused" else "pause")


@operator(
    SessionOperator,
    "Mark",
    undo=False,
    invoke=ask_properties,
    words=Text("Words", "What happens now", default="here"),
)
def sensor_mark(root, words):
    """Write a mark with a text into the recording, at this moment"""
    # One line: a second would be another command.
    sensor.of(root).child.send(f"mark {' '.join(words.split())}")


@operator(UnitOperator, "Freeze", undo=False)
def sensor_freeze(root):
    """Freeze the plot, or resume it; recording continues in any case"""
    session = sensor.of(root)
    if session is not None and session.traces is not None:
        session.frozen = session.traces.copy() if session.frozen is None else None
    viewports.redraw()


@operator(UnitOperator, "Draw Channel", name=Text("Channel", "Name of the channel"))
def sensor_channel(root, name):
    """Show or hide this channel in the plot"""
    settings = root.mu_sensor
    hidden = {name for name in settings.hidden.split(",") if name}
    settings.hidden = ",".join(sorted(hidden ^ {name}))


@operator(
    SessionOperator,
    "Guided Sweep",
    undo=False,
    on=Flag("Begin", "Begin a sweep, or stop it", default=True, options={"SKIP_SAVE"}),
)
def sensor_sweep(root, on):
    """Calibrate step by step: hold the unit at a sequence of angles; the fit follows the last"""
    session = sensor.of(root)
    if not on:
        session.guide = None
        return
    if sensor.CALIBRATION.is_running(root):
        raise InputError("a calibration is running", remedy="wait for it, or cancel it")
    angles = sensor.sweep_angles(root.mu_sensor)
    if len(set(angles)) < 3:
        raise InputError(
            f"a sweep over {counted(len(set(angles)), 'angle', 'angles')}",
            remedy="take a smaller step or a wider range",
        )
    # Marks of an earlier sweep in this recording no longer count.
    session.child.send(f"mark {SWEEP}")
    session.guide = Guide(angles)


def _sensor_hold_trouble(root):
    session = sensor.of(root)
    if session.guide is None:
        return "Begin a guided sweep first"
    if session.guide.holding:
        return "Hold still: the angle is being read"
    return "" if session.fresh else "No samples are coming"


@operator(SessionOperator, "Angle Reached", undo=False, trouble=_sensor_hold_trouble)
def sensor_hold(root):
    """Confirm that the unit is at this angle, and hold it there while it is read"""
    sensor.hold(sensor.of(root))
    viewports.redraw()


def _sensor_back_trouble(root):
    guide = sensor.of(root).guide
    return "" if guide is not None and guide.held else "No angle was held yet"


@operator(SessionOperator, "Back", undo=False, trouble=_sensor_back_trouble)
def sensor_back(root):
    """Take back the last angle of the guided sweep, to hold it again"""
    sensor.back(sensor.of(root))
    viewports.redraw()


@operator(
    UnitOperator,
    "Calibrate",
    undo=False,
    data=Text(
        "Sweeps", "Folder. Empty: the one that the panel names", subtype="DIR_PATH", options={"SKIP_SAVE"}
    ),
    channel=Text(
        "Light",
        "Channel of the light to calibrate from now on. Empty: the one that the panel names",
        options={"SKIP_SAVE"},
    ),
)
def sensor_calibrate(root, data, channel):
    """Calibrate from the last sweep of a recording or from measured data, in a child process"""
    session = sensor.of(root)
    data = data or root.mu_sensor.data
    if not data and session is not None:
        data = str(session.watched.folder)
    if channel:
        root.mu_sensor.channel = channel
    if not data:
        raise InputError("no folder is chosen", "Sweeps", "choose a recording with marks, or measured data")
    sensor.calibrate(root, Path(bpy.path.abspath(data)))


@operator(SessionOperator, "Zero", undo=False)
def sensor_zero(root):
    """Zero: set the present angle, to correct for a change in light intensity"""
    sensor.zero(root, root.mu_sensor.known_deg)
    viewports.redraw()


@operator(MotionOperator, "Show Twin", on=Flag("Show", "Show or hide it", default=True))
def sensor_twin(root, on):
    """Show or hide the simulated unit next to the design, bent to the sensor's angle"""
    twin.show(root) if on else twin.hide(root)


def _path_of(root, what):
    """File or folder by its name `what`."""
    session = sensor.of(root)
    if what == "recording":
        return session.watched.folder if session else studies.folder_of(root) / sensor.RECORDINGS
    return sensor.latest_calibration(root) / FILES[what]


job_operators(
    sensor.CALIBRATION,
    "connect, or calibrate",
    kept="the previous calibration stays in use",
    items=[("recording", "Recording", "Folder of the recording"), *RUN_FILES[:3]],
    path_of=_path_of,
)
