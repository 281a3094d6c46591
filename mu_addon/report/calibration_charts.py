"""Chart of a calibration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..sensing import Calibration, CalibrationSweep
from .plots import canvas


def curve_chart(
    found: Calibration, fitted: Sequence[CalibrationSweep], held: Sequence[tuple[str, CalibrationSweep]]
) -> str:
    """Voltage against angle: the readings, the map and its 95 % band."""
    with canvas(6.4, 3.6) as (drawing, svg):
        axes = drawing.add_axes((0.11, 0.15, 0.86, 0.82))
        at = np.linspace(*found.range_deg, 201)
        volts = found.voltage_of(at)
        axes.fill_between(at, volts - found.band_V, volts + found.band_V, color="0.85", label="95 % band")
        kinds = (("fitted", fitted), ("held out", [sweep for _, sweep in held]))
        for color, (label, sweeps) in zip(("C0", "C1"), kinds, strict=True):
            for k, sweep in enumerate(sweeps):
                few = slice(None, None, max(1, len(sweep.angle_deg) // 400))
                words = "" if k else label
                axes.plot(sweep.angle_deg[few], sweep.voltage_V[few], ".", ms=2, color=color, label=words)
        axes.plot(at, volts, color="black", lw=1, label="map")
        axes.set_xlabel("bending angle, deg")
        axes.set_ylabel("voltage, V")
        axes.legend(frameon=False, fontsize=8)
    return svg()
