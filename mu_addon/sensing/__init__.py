"""The real sensor: its optics, its calibration, and the serial line that it speaks on."""
