"""A unit whose response is written down: six segments that bend, each a cubic in its pressure."""

from pathlib import Path

import numpy as np

from mu_addon.evidence.effect import Parameter
from mu_addon.evidence.prediction.unit_pressure import UnitPressure, UnitResponse, Variant, nuisances
from mu_addon.evidence.simulator import Composite
from mu_addon.measured import Experiment

CHANNELS = ("angle_deg", *(f"marker{m}_{a}_mm" for m in (1, 2, 3) for a in "yz"))
LENGTH_MM = 12.5
SHAPE = np.array([1.15, 1.05, 1.0, 1.0, 0.95, 0.85])
PRESSURES = np.linspace(-32.0, 48.0, 65)

STATIC = {
    "gravity": Parameter("density_kg_m3", "kg/m3", 0.0, 2500.0, 0.0, (1000.0,), "of the resin"),
    "strain_stiffening": Parameter("stiffening", "", 0.0, 1.0, 0.0, (0.1,), "second term of Yeoh's energy"),
    "overcure": Parameter("offset_mm", "mm", -0.1, 0.3, 0.0, (0.05,), "printer"),
    "wall_thickness": Parameter("change_mm", "mm", -0.3, 0.3, 0.0, (0.05,), "printer"),
    "clogged_chamber": Parameter("share_lost", "", 0.0, 1.0, 0.0, (0.1,), "third chamber"),
    "contact": Parameter("overlap_deg", "deg", 0.0, 30.0, 0.0, (5.0,), "table"),
}
GRID = {
    "gravity": (0.0, 500.0, 1200.0, 2500.0),
    "strain_stiffening": (0.0, 0.02, 0.05, 0.12, 0.3, 1.0),
    "overcure": (-0.1, 0.0, 0.05, 0.15, 0.3),
    "wall_thickness": (-0.3, -0.1, 0.0, 0.1, 0.3),
    "clogged_chamber": (0.0, 0.2, 0.5, 1.0),
    "contact": (0.0, 0.6, 1.2, 2.5, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0),
}


def channels(pressure_kPa, sizes=None, scale=1.0, orientation_deg=0.0):
    """Channels (7, n) at pressures (n,) with static effects of given sizes."""
    s = dict.fromkeys(STATIC, 0.0) | (sizes or {})
    x = np.asarray(pressure_kPa, float)[:, None] / 20.0 * np.ones(6)
    x = x * (1.0 - s["clogged_chamber"] * (np.arange(6) == 2))
    grown = s["overcure"] / scale
    thicker = s["wall_thickness"] / scale
    first = 4.0 * (1.0 - 1.6 * grown - 0.9 * thicker)
    second = 0.9 * (1.0 + 3.0 * grown - 1.5 * thicker)
    third = -0.25 * (1.0 + 1.0 * grown + 4.0 * thicker)
    ends = 1.0 + thicker * np.linspace(-0.5, 0.5, 6) + grown * np.linspace(0.4, -0.4, 6)
    bend = SHAPE * ends * (first * x + second * x**2 + third * x**3) / (1.0 + s["strain_stiffening"] * x**2)
    tilt = np.cumsum(bend, axis=1)
    lever = np.linspace(6, 1, 6) ** 2 / 36.0
    bend = bend - 2.0 * scale * s["gravity"] / 1000.0 * lever * np.sin(np.radians(tilt + orientation_deg))
    if s["contact"]:
        over = bend.sum(axis=1) - (36.0 - s["contact"])
        bend = bend - 0.6 * np.maximum(over, 0.0)[:, None] * np.array([0, 0, 0, 0.1, 0.3, 0.6])
    tilt = np.cumsum(bend, axis=1)
    middle = np.radians(tilt - bend / 2.0)
    y = np.cumsum(scale * LENGTH_MM * np.sin(middle), axis=1)
    z = np.cumsum(scale * LENGTH_MM * np.cos(middle), axis=1)
    return np.stack([tilt[:, 5], y[:, 1], z[:, 1], y[:, 3], z[:, 3], y[:, 5], z[:, 5]])


def response(scale=1.0, orientation_deg=0.0, pressures=PRESSURES):
    """What a simulation would hand over: values and variants at some pressures."""
    variants = {
        name: Variant(
            p, GRID[name], [channels(pressures, {name: v}, scale, orientation_deg) for v in GRID[name]]
        )
        for name, p in STATIC.items()
    }
    values = channels(pressures, {}, scale, orientation_deg)
    return UnitResponse(CHANNELS, pressures, values, variants, scale, orientation_deg)


def simulator(experiments):
    """The simulator of these experiments."""
    kinds = sorted({(e.scale, e.orientation_deg) for e in experiments if e.kind == "unit_pressure"})
    return Composite({"unit_pressure": UnitPressure([response(*k) for k in kinds], experiments)})


def experiment(name, time, pressure, observed, **more):
    """An experiment in memory; observed: by column."""
    columns = {"time_s": time, "pressure_kPa": pressure, **observed}
    fields = {"role": "fit", "specimen": "A", "temperature_C": 23.0} | more
    return Experiment(
        name=name,
        kind="unit_pressure",
        file=Path(f"{name}.csv"),
        columns=columns,
        rows=np.arange(len(time)) + 2,
        sha256=name,
        **fields,
    )


def triangle(dt, period, cycles, low, high):
    """Time and pressure of a triangular wave that starts and ends at rest."""
    corners, at = [0.0], [0.0]
    for _ in range(cycles):
        rise = period / 2.0
        corners += [high, low]
        at += [at[-1] + rise, at[-1] + 2.0 * rise]
    corners.append(0.0)
    at.append(at[-1] + period / 4.0)
    t = np.arange(0.0, at[-1], dt)
    return t, np.interp(t, at, corners)


def steps(dt, levels, hold_s, ramp_s=0.5):
    """Time and pressure of levels that are each held."""
    at, p = [0.0], [0.0]
    for level in levels:
        at += [at[-1] + ramp_s, at[-1] + ramp_s + hold_s]
        p += [level, level]
    t = np.arange(0.0, at[-1], dt)
    return t, np.interp(t, at, p)


def protocols(dt, count=10):
    """Up to ten experiments of a bench: name, time, pressure, and what describes each."""
    ladder = steps(dt, (10, 0, 20, 0, 30, 0, 40, 0), 6.0, 4.0)
    slow = triangle(dt, 24.0, 3, 0.0, 35.0)
    fast = triangle(max(dt / 2, 0.05), 4.0, 6, 0.0, 35.0)
    all_ = [
        ("ladder", *ladder, {}),
        ("slow cycles", *slow, {}),
        ("fast cycles", *fast, {}),
        ("hold", *steps(dt, (30, 0, -15, 0), 25.0), {}),
        ("slow cycles, level", *slow, {"orientation_deg": 90.0}),
        ("slow cycles again", *slow, {"temperature_C": 27.0}),
        ("pressure and vacuum", *triangle(dt, 20.0, 3, -20.0, 30.0), {}),
        ("slow cycles, upside down", *slow, {"orientation_deg": 180.0}),
        ("fast cycles again", *fast, {}),
        ("ladder again", *ladder, {}),
    ]
    return all_[:count]


def coloured(rng, time, white, slow, time_s):
    """White and first-order noise (n,) on a clock."""
    found = np.empty(len(time))
    found[0] = rng.normal()
    for i, h in enumerate(np.diff(time), 1):
        r = np.exp(-h / time_s)
        found[i] = r * found[i - 1] + np.sqrt(1.0 - r * r) * rng.normal()
    return slow * found + white * rng.normal(size=len(time))


def measured(rng, values, dt=0.2, count=10, level=0.1, rho=0.9, slow_share=0.7, predict=None):
    """Experiments in memory of the bench's protocols, made by the simulator itself unless told otherwise."""
    bare = [
        experiment(name, t, p, {c: np.zeros(len(t)) for c in CHANNELS}, **more)
        for name, t, p, more in protocols(dt, count)
    ]
    model = simulator(bare)
    found = []
    for e in bare:
        y = model.predict(e, values) if predict is None else predict(e)
        observed = {}
        for c, v in zip(CHANNELS, y, strict=True):
            sd = level * (3.0 if c == "angle_deg" else 1.0)
            slow = sd * np.sqrt(slow_share)
            white = sd * np.sqrt(1.0 - slow_share)
            observed[c] = v + coloured(rng, e["time_s"], white, slow, -dt / np.log(rho))
        more = {k: getattr(e, k) for k in ("scale", "orientation_deg", "temperature_C", "specimen", "role")}
        found.append(experiment(e.name, e["time_s"], e["pressure_kPa"], observed, **more))
    return found


class DeadLoad:
    """A beam of the unit's resin: its sag tells the modulus, whatever a gauge of pressure says."""

    nuisances = nuisances(())
    effects = ()

    def channels(self, experiment):
        return ("tip_deflection_mm",)

    def predict(self, experiment, values):
        return 0.4 * experiment["added_mass_g"][None] / values.get("modulus_factor", 1.0)
