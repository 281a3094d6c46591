"""Connection, calibration and display of a unit's sensor, kept on the unit's root object."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import StringProperty

from ...sensing.settings import BAUD, PORT, SPEED
from ..shared.blender_property import Choice, Flag, Integer, Number, Text, blender_property, path_property
from ..shared.registration import property_of
from . import state as sensor


def _ports(group, context, typed):
    return [pair for pair in sensor.known_ports() if typed.lower() in " ".join(pair).lower()]


def _channels(group, context, typed):
    session = sensor.of(group.id_data)
    return [name for name in (session.channels if session else ()) if typed.lower() in name.lower()]


def _again(group, context):
    session = sensor.of(group.id_data)
    if session is not None:
        session.traces = None


@property_of(bpy.types.Object, "mu_sensor")
class MU_PG_sensor(bpy.types.PropertyGroup):
    """Connection, calibration and display of a unit's sensor."""

    source: Choice(
        "Sensor",
        "Source of the samples",
        items=[
            ("port", "Serial Port", "The sensor at a port of this computer"),
            ("simulated", "Simulated", "A simulated sensor that bends by 45 degrees every 8 s"),
            ("replay", "Recording", "A recording as if it came from the sensor"),
        ],
    )
    port: blender_property(PORT, search=_ports, search_options={"SUGGESTION"})
    baud: blender_property(BAUD, name="Baud")
    replay: path_property("Recording", "Folder of the recording to play", folder=True)
    speed: blender_property(SPEED._replace(low=0.01, high=100.0), precision=2)
    channel: Text(
        "Light",
        "Channel of the light. Empty: the first whose name begins with light, or the first",
        search=_channels,
        search_options={"SUGGESTION"},
    )
    dark: Text(
        "Dark",
        "Channel of the dark level, or volts. Empty: the first whose name begins with dark, or 0",
        search=_channels,
        search_options={"SUGGESTION"},
    )
    calibration: path_property(
        "Calibration", "A calibration.toml. Empty: the one that was made for this unit"
    )
    data: path_property(
        "Sweeps", "Folder of a recording with angles marked, or of measured data", folder=True
    )
    plot: Flag("Plot", "Draw the signal in the viewport", default=True)
    seconds: Number(
        "Seconds", "How much of the past the plot shows", default=10.0, min=1.0, max=600.0, update=_again
    )
    hidden: StringProperty(options={"HIDDEN"})
    sweep_from: Number("First (deg)", "Where a sweep begins and ends", default=0.0)
    sweep_to: Number("Last (deg)", "Where a sweep turns", default=45.0)
    sweep_step: Number("Step (deg)", "From one held angle to the next", default=15.0, min=0.5)
    sweep_times: Integer(
        "Times", "Number of sweeps back and forth: two show how well it repeats", default=2, min=2
    )
    known_deg: Number("Angle (deg)", "The angle at which the unit is held now")
