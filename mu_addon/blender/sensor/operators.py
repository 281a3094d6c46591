"""Connect the real sensor, mark, calibrate, zero, and show its twin."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ...design.printing.finding import counted
from ...errors import InputError
from ...sensing.session import SWEEP
from ..jobs.operators import FILES, RUN_FILES, job_operators
from ..results.operators import MotionOperator
from ..shared import viewports
from ..shared.operators import reports_errors
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


class MU_OT_sensor_ports(bpy.types.Operator):
    """Look for serial ports"""

    bl_idname = "mu.sensor_ports"
    bl_label = "Find Ports"
    bl_options = {"REGISTER"}

    @reports_errors
    def execute(self, context):
        found = sensor.find_ports()
        self.report(
            {"INFO"},
            counted(len(found), "serial port", "serial ports") if found else "No serial port is there",
        )
        return {"FINISHED"}


class MU_OT_sensor_port(UnitOperator, bpy.types.Operator):
    """Use this port"""

    bl_idname = "mu.sensor_port"
    bl_label = "Use Port"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Name", description="A port's device, or usb:VID:PID[:SERIAL]")

    def act(self, context, root):
        root.mu_sensor.port = self.name


class MU_OT_sensor_connect(UnitOperator, bpy.types.Operator):
    """Read the sensor in a child process; every sample is written to disk before it is shown"""

    bl_idname = "mu.sensor_connect"
    bl_label = "Connect and Record"
    bl_options = {"REGISTER"}

    @classmethod
    def trouble(cls, root):
        session, settings = sensor.of(root), root.mu_sensor
        if sensor.missing():
            return f"Not in this Blender: {', '.join(sensor.missing())}"
        if settings.source == "replay" and not settings.replay:
            return "Choose the folder of a recording first"
        return "The sensor is connected" if session is not None and session.running else ""

    def act(self, context, root):
        sensor.connect(root)
        viewports.redraw()


class MU_OT_sensor_disconnect(UnitOperator, bpy.types.Operator):
    """End the session: the port is free, and the recording complete"""

    bl_idname = "mu.sensor_disconnect"
    bl_label = "Disconnect"
    bl_options = {"REGISTER"}

    others: BoolProperty(
        name="Others", description="The sensors of all other units instead", options={"SKIP_SAVE"}
    )

    def act(self, context, root):
        for uuid in sensor.others(root) if self.others else [root.mu_unit.uuid]:
            sensor.disconnect(uuid)


class MU_OT_sensor_pause(SessionOperator, bpy.types.Operator):
    """Release the port for another program, or open it again; the session continues"""

    bl_idname = "mu.sensor_pause"
    bl_label = "Release Port"
    bl_options = {"REGISTER"}

    def act(self, context, root):
        session = sensor.of(root)
        session.child.send("resume" if session.state == "paused" else "pause")


class MU_OT_sensor_mark(SessionOperator, bpy.types.Operator):
    """Write a mark with a text into the recording, at this moment"""

    bl_idname = "mu.sensor_mark"
    bl_label = "Mark"
    bl_options = {"REGISTER"}

    words: StringProperty(name="Words", description="What happens now", default="here")

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context, root):
        # One line: a second would be another command.
        words = " ".join(self.words.split())
        sensor.of(root).child.send(f"mark {words}")


class MU_OT_sensor_freeze(UnitOperator, bpy.types.Operator):
    """Freeze the plot, or resume it; recording continues in any case"""

    bl_idname = "mu.sensor_freeze"
    bl_label = "Freeze"
    bl_options = {"REGISTER"}

    def act(self, context, root):
        session = sensor.of(root)
        if session is None or session.traces is None:
            return {"CANCELLED"}
        session.frozen = session.traces.copy() if session.frozen is None else None
        viewports.redraw()
        return {"FINISHED"}


class MU_OT_sensor_channel(UnitOperator, bpy.types.Operator):
    """Show or hide this channel in the plot"""

    bl_idname = "mu.sensor_channel"
    bl_label = "Draw Channel"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Channel", description="Name of the channel")

    def act(self, context, root):
        settings = root.mu_sensor
        hidden = {name for name in settings.hidden.split(",") if name}
        settings.hidden = ",".join(sorted(hidden ^ {self.name}))


class MU_OT_sensor_sweep(SessionOperator, bpy.types.Operator):
    """Calibrate step by step: hold the unit at a sequence of angles; the fit follows the last"""

    bl_idname = "mu.sensor_sweep"
    bl_label = "Guided Sweep"
    bl_options = {"REGISTER"}

    on: BoolProperty(
        name="Begin", description="Begin a sweep, or stop it", default=True, options={"SKIP_SAVE"}
    )

    def act(self, context, root):
        session = sensor.of(root)
        if not self.on:
            session.guide = None
            return {"FINISHED"}
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
        return {"FINISHED"}


class MU_OT_sensor_hold(SessionOperator, bpy.types.Operator):
    """Confirm that the unit is at this angle, and hold it there while it is read"""

    bl_idname = "mu.sensor_hold"
    bl_label = "Angle Reached"
    bl_options = {"REGISTER"}

    @classmethod
    def trouble(cls, root):
        if why := super().trouble(root):
            return why
        session = sensor.of(root)
        if session.guide is None:
            return "Begin a guided sweep first"
        if session.guide.holding:
            return "Hold still: the angle is being read"
        return "" if session.fresh else "No samples are coming"

    def act(self, context, root):
        sensor.hold(sensor.of(root))
        viewports.redraw()


class MU_OT_sensor_back(SessionOperator, bpy.types.Operator):
    """Take back the last angle of the guided sweep, to hold it again"""

    bl_idname = "mu.sensor_back"
    bl_label = "Back"
    bl_options = {"REGISTER"}

    @classmethod
    def trouble(cls, root):
        guide = None if super().trouble(root) else sensor.of(root).guide
        return super().trouble(root) or ("" if guide is not None and guide.held else "No angle was held yet")

    def act(self, context, root):
        sensor.back(sensor.of(root))
        viewports.redraw()


class MU_OT_sensor_calibrate(UnitOperator, bpy.types.Operator):
    """Calibrate from the last sweep of a recording or from measured data, in a child process"""

    bl_idname = "mu.sensor_calibrate"
    bl_label = "Calibrate"
    bl_options = {"REGISTER"}

    data: StringProperty(
        name="Sweeps",
        description="Folder. Empty: the one that the panel names",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )

    channel: StringProperty(
        name="Light",
        description="Channel of the light to calibrate from now on. Empty: the one that the panel names",
        options={"SKIP_SAVE"},
    )

    def act(self, context, root):
        session = sensor.of(root)
        data = self.data or root.mu_sensor.data
        if not data and session is not None:
            data = str(session.watched.folder)
        if self.channel:
            root.mu_sensor.channel = self.channel
        if not data:
            raise InputError(
                "no folder is chosen", "Sweeps", "choose a recording with marks, or measured data"
            )
        sensor.calibrate(root, Path(bpy.path.abspath(data)))
        viewports.redraw()


class MU_OT_sensor_zero(SessionOperator, bpy.types.Operator):
    """Zero: set the present angle, to correct for a change in light intensity"""

    bl_idname = "mu.sensor_zero"
    bl_label = "Zero"
    bl_options = {"REGISTER"}

    def act(self, context, root):
        sensor.zero(root, root.mu_sensor.known_deg)
        viewports.redraw()


class MU_OT_sensor_twin(MotionOperator, bpy.types.Operator):
    """Show or hide the simulated unit next to the design, bent to the sensor's angle"""

    bl_idname = "mu.sensor_twin"
    bl_label = "Show Twin"
    bl_options = {"REGISTER", "UNDO"}

    on: BoolProperty(name="Show", description="Show or hide it", default=True)

    def act(self, context, root):
        twin.show(root) if self.on else twin.hide(root)


def _path_of(root, what):
    """File or folder by its name `what`."""
    session = sensor.of(root)
    if what == "recording":
        return session.watched.folder if session else studies.folder_of(root) / sensor.RECORDINGS
    return sensor.latest_calibration(root) / FILES[what]


CLASSES = (
    MU_OT_sensor_ports,
    MU_OT_sensor_port,
    MU_OT_sensor_connect,
    MU_OT_sensor_disconnect,
    MU_OT_sensor_pause,
    MU_OT_sensor_mark,
    MU_OT_sensor_freeze,
    MU_OT_sensor_channel,
    MU_OT_sensor_sweep,
    MU_OT_sensor_hold,
    MU_OT_sensor_back,
    MU_OT_sensor_calibrate,
    MU_OT_sensor_zero,
    MU_OT_sensor_twin,
    *job_operators(
        sensor.CALIBRATION,
        "sensor_",
        "calibration",
        kept="the previous calibration stays in use",
        first="connect, or calibrate",
        items=[("recording", "Recording", "Folder of the recording"), *RUN_FILES[:3]],
        path_of=_path_of,
    ),
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
