"""The panel Sensor on the Bench of the sidebar tab MU: the real sensor, its calibration, and the twin."""

from __future__ import annotations

import time
from math import isfinite

import bpy

from ...design.printing.finding import counted
from ...run.child import FAILED
from ...sensing.session import LOSSES
from ..jobs.panel import job_state
from ..shared.panels import alert, fold, large_button, plain_row, wrapped
from ..shared.wording import in_panel
from ..simulate import study_folder as studies
from ..unit.base_classes import UnitPanel
from . import state as sensor
from . import twin

STATES = {
    "starting": ("Starting", "TIME"),
    "searching": ("Searching for the sensor", "VIEWZOOM"),
    "waiting": ("Sensor not found; searching", "ERROR"),
    "disconnected": ("Unplugged; waiting for it", "ERROR"),
    "connected": ("Connected", "LINKED"),
    "paused": ("Port released", "PAUSE"),
    "ended": ("Disconnected", "UNLINKED"),
}


class MU_PT_sensor(UnitPanel, bpy.types.Panel):
    """The real sensor: connect, record, calibrate, and bend the twin by it"""

    bl_label = "Sensor on the Bench"

    def show(self, layout, context, root):
        missing = sensor.missing()
        if missing:
            box = layout.box()
            wrapped(box, f"Not in this Blender: {', '.join(missing)}. Install the built extension", "ERROR")
            return
        session = sensor.of(root)
        if session is None or not session.running:
            _source(layout, root.mu_sensor)
        if session is not None:
            _session(layout, root.mu_sensor, session)
        if sensor.others(root):
            count = counted(len(sensor.others(root)), "sensor", "sensors")
            wrapped(layout, f"{count} of other units connected", "INFO")
            layout.operator("mu.sensor_disconnect", text="Disconnect Them", icon="UNLINKED").others = True
        _calibration(layout, root, session)
        _twin(layout, root)
        # What grows with the channels stands below what is pressed meanwhile.
        _plot(layout, root.mu_sensor, session)
        if session is not None:
            _readings(layout, session)


def _source(layout, settings):
    layout.prop(settings, "source")
    if settings.source == "port":
        row = layout.row(align=True)
        row.prop(settings, "port")
        row.operator("mu.sensor_ports", text="", icon="FILE_REFRESH")
        for name, words in sensor.known_ports():
            icon = "CHECKMARK" if name == settings.port else "BLANK1"
            layout.operator("mu.sensor_port", text=words, icon=icon).name = name
        layout.prop(settings, "baud")
    elif settings.source == "replay":
        layout.prop(settings, "replay")
        layout.prop(settings, "speed")
    large_button(layout, "mu.sensor_connect", "LINKED")


def _session(layout, settings, session):
    status = session.watched.status
    if session.running:
        row = layout.row(align=True)
        row.operator("mu.sensor_disconnect", icon="UNLINKED")
        text, icon = ("Open Port", "PLAY") if session.state == "paused" else ("Release Port", "PAUSE")
        row.operator("mu.sensor_pause", text=text, icon=icon)
    box = layout.box()
    words, icon = STATES.get(session.state, (session.state, "INFO"))
    if session.child.state == FAILED:
        box.alert = True
        error = session.child.error or {}
        wrapped(box, in_panel(str(error.get("what", ""))), "ERROR")
        wrapped(box, in_panel(str(error.get("what_to_do") or error.get("where", ""))))
        wrapped(box, "The recording is kept. Connect again")
    elif session.running and session.watched.silent_s > sensor.SILENT_S and status:
        box.alert = True
        silent = f"{session.watched.silent_s:.0f} s"
        wrapped(box, f"No status for {silent}: does the folder still exist?", "ERROR")
    else:
        if session.state == "connected" and not session.fresh:
            words, icon = "Connected, no samples", "ERROR"
        port = f": {status['port']}" if status.get("port") and session.state == "connected" else ""
        box.label(text=f"{words}{port}", icon=icon)
    # As many lines before the first sample as after it: buttons stay under the mouse.
    column = box.column(align=True)
    column.label(text=f"{_format(status)}, {status.get('rate_hz', 0):.0f} Hz")
    column.label(text=f"{status.get('rows', 0)} samples on disk in {status.get('duration_s', 0):.0f} s")
    losses = [f"{status[key]} {word}" for key, word in LOSSES.items() if status.get(key)]
    wrapped(column, ", ".join(losses) or "Nothing lost", "ERROR" if losses else "CHECKMARK")
    if session.trouble:
        box.alert = True
        wrapped(box, session.trouble, "ERROR")
    row = box.row(align=True)
    row.operator("mu.sensor_open", text="Recording", icon="FILE_FOLDER").what = "recording"
    if session.running:
        row.operator("mu.sensor_mark", icon="BOOKMARKS")


def _readings(layout, session):
    """What comes and goes with the samples, below all buttons."""
    status, column = session.watched.status, layout.column(align=True)
    for words in status.get("complaint", ()):
        wrapped(column, in_panel(words), "INFO")
    for name, value in zip(session.channels, list(status.get("latest", ()))[3:], strict=False):
        row = column.row()
        row.label(text=name)
        row.label(text="-" if value is None else f"{value:.4f}")
    reading = session.reading
    if session.fresh and reading is not None and isfinite(reading.angle_deg):
        row = column.row()
        row.label(text=f"Angle {reading.angle_deg:.1f}°", icon="NONE" if reading.possible else "ERROR")
        row.label(text=f"{reading.low_deg:.1f} to {reading.high_deg:.1f}°")


def _format(status) -> str:
    """Format of the lines on the port, in words."""
    found = status.get("format")
    return f"Format {found}" if found else "Format not found yet"


def _plot(layout, settings, session):
    body = fold(layout, "MU_sensor_plot", "Plot")
    if not body:
        return
    running = session is not None and session.running
    row = plain_row(body)
    row.prop(settings, "plot", toggle=True)
    row = row.row(align=True)
    row.enabled = running
    frozen = running and session.frozen is not None
    row.operator("mu.sensor_freeze", text="Go On" if frozen else "Freeze", icon="PLAY" if frozen else "PAUSE")
    body.prop(settings, "seconds")
    if running:
        hidden = settings.hidden.split(",")
        grid = body.grid_flow(columns=2, align=True)
        for name in session.channels:
            grid.operator("mu.sensor_channel", text=name, depress=name not in hidden).name = name


def _calibration(layout, root, session):
    settings = root.mu_sensor
    body = fold(layout, "MU_sensor_calibration", "Calibration", closed=False)
    if not body:
        return
    found, trouble = sensor.calibration(root)
    if found is not None:
        low, high = found.range_deg
        zeroed = "" if found.gain == 1.0 else f", light {100 * (found.gain - 1):+.1f} % since"
        error = f"{found.error_deg:.2f}° rms cross-validated"
        wrapped(body, f"{low:.0f} to {high:.0f}°, {found.sweeps} sweeps, {error}{zeroed}", "CHECKMARK")
    else:
        wrapped(body, trouble or "Not calibrated: voltages only", "ERROR" if trouble else "INFO")
    light, dark = sensor.chosen(root)
    body.prop(settings, "channel", placeholder=light)
    body.prop(settings, "dark", placeholder=str(dark))
    body.prop(settings, "calibration")
    child = sensor.CALIBRATION.child(root)
    job_state(body, child, "now in use", sensor.CALIBRATION.prefix)
    if child is not None and child.state == FAILED and session is not None:
        others = [name for name in session.channels if name not in (light, dark)]
        for name in others[:3]:
            again = body.operator("mu.sensor_calibrate", text=f"Calibrate with {name}", icon="FILE_REFRESH")
            again.channel = name
    guide = session.guide if session is not None and session.running else None
    if guide is None:
        column = body.column(align=True)
        for name in ("sweep_from", "sweep_to", "sweep_step", "sweep_times"):
            column.prop(settings, name)
        body.operator("mu.sensor_sweep", icon="CON_ROTLIKE")
    else:
        _guide(body, guide)
    column = body.column(align=True)
    column.prop(settings, "data")
    row = column.row()
    # An error's popup would cover the field that it asks for.
    row.enabled = bool(settings.data or session is not None)
    row.operator("mu.sensor_calibrate", icon="CHECKMARK")
    row = body.row(align=True)
    row.prop(settings, "known_deg")
    row.operator("mu.sensor_zero", icon="PIVOT_CURSOR")


def _guide(layout, guide):
    box = layout.box()
    if guide.holding:
        left = max(0.0, guide.until - time.monotonic())
        wrapped(box, f"Hold still at {guide.angles[guide.held - 1]:g}°: {left:.1f} s", "TIME")
    elif guide.held < len(guide.angles):
        angle = guide.angles[guide.held]
        wrapped(box, f"Bend to {angle:g}°, hold, press", "FORWARD")
    else:
        wrapped(box, "Every angle is held", "CHECKMARK")
    row = box.row(align=True)
    row.scale_y = 1.6
    text = f"At {guide.angles[guide.held]:g}°" if guide.held < len(guide.angles) else "Done"
    row.operator("mu.sensor_hold", text=text, icon="PINNED")
    row.operator("mu.sensor_back", icon="LOOP_BACK")
    box.progress(factor=guide.held / len(guide.angles), text=f"{guide.held} of {len(guide.angles)}")
    box.operator("mu.sensor_sweep", text="Stop", icon="CANCEL").on = False
    odd = guide.odd
    if odd is not None:
        # Below what was pressed, which it neither moves nor covers.
        words = f"Number {odd + 1}, {guide.angles[odd]:g}°, breaks the order of the light"
        alert(box, f"{words}: go back to it and repeat it")


def _twin(layout, root):
    body = fold(layout, "MU_sensor_twin", "Twin", closed=False)
    if not body:
        return
    on = bool(twin.parts(root))
    text = "Hide Twin" if on else "Show Twin"
    body.operator("mu.sensor_twin", text=text, icon="MOD_SIMPLEDEFORM", depress=on).on = not on
    if on:
        state, words = twin.status(root)
        if state == twin.OUTSIDE:
            body.alert = True
        wrapped(body, words, {twin.LIVE: "CHECKMARK", twin.OUTSIDE: "ERROR"}.get(state, "INFO"))
        found = studies.findings(root)
        if found is not None and found.stale:
            wrapped(body, "Its motion is of other parameters: simulate again", "ERROR")
