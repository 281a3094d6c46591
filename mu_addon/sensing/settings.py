"""Settings of a serial line."""

from __future__ import annotations

from ..design.quantity import described

BAUD = described("baud", 115200, "bits a second on the serial line", low=300, high=10_000_000)
