"""Recordings of a sensor that is bent by known angles."""

import numpy as np

from mu_addon.sensing.recording import Recorder
from mu_addon.sensing.samples import Layout, Samples


def recorded(folder, sweeps=4, seed=0, period_s=10.0, marked=False):
    """A sensor that bends by 1.25 degrees a kPa, on a gauge of 20 kPa/V; its light is by Beer's law.

    marked: it is held at every tenth degree, and marks tell. Returns times in s and angles in degrees.
    """
    noise = np.random.default_rng(seed)
    t = np.arange(0, period_s * sweeps, 0.02)
    angle = 25.0 - 25.0 * np.cos(2 * np.pi * t / period_s)
    if marked:
        angle = np.round(angle / 10) * 10
    dark = 0.05 + 0.001 * noise.normal(size=len(t))
    light = 2.4 * np.exp(-0.006 * angle) + dark + 0.002 * noise.normal(size=len(t))
    values = np.column_stack([light, dark, 0.5 + angle / 25.0])
    recorder = Recorder(folder, {})
    recorder.write(Samples(Layout(("light", "dark", "gauge"), "V"), t, t, np.arange(len(t)), values), 0.0)
    for k in np.flatnonzero(np.diff(angle, prepend=-1.0)) if marked else ():
        recorder.event("mark", float(t[k]), text=f"angle {angle[k]:g}")
    recorder.close()
    return t, angle


def write_angles(path, time_s, angle_deg):
    """A table of angles over time."""
    rows = zip(time_s, angle_deg, strict=True)
    path.write_text("time_s,angle_deg\n" + "".join(f"{t},{a}\n" for t, a in rows))
