"""Settings of a sensor: its serial line, its recordings and their calibration."""

from __future__ import annotations

from ..design.quantity import described

BAUD = described("baud", 115200, "bits a second on the serial line", low=300, high=10_000_000)
PORT = described(
    "port",
    "",
    "serial port: a device name, or usb:VID:PID[:SERIAL], which identifies the board at any USB socket; "
    "empty: the only USB serial port",
)
SPEED = described(
    "speed", 1.0, "replay speed relative to real time; 0: as fast as possible", low=0.0, high=1000.0
)
CHANNEL = described("channel", "", "column of the light signal; empty: the only column")
DARK = described("dark", "", "dark level: the name of a column, or a voltage in V; empty: 0")
ANGLES = described(
    "angles",
    "",
    'reference angles, CSV with the columns time_s,angle_deg, for a recording without marks such as "angle '
    '30"; empty: by its marks',
)
