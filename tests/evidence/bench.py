"""Experiments made of numbers, and fits of a few values to them, for tests of what predicts a kind."""

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from mu_addon.evidence.camera import View
from mu_addon.evidence.chamber import Chamber
from mu_addon.evidence.effects import Acting, laws_of
from mu_addon.evidence.effects.declaration import Setting
from mu_addon.measured import Experiment


def experiment(kind, columns, name="made", **fields):
    n = len(next(iter(columns.values())))
    return Experiment(name, kind, "fit", Path("made.csv"), columns, np.arange(n), "", **fields)


def acted(kind, quantity, values, *places, **setting):
    """A quantity after what acts on it at places of a kind, with values by "effect.parameter"."""
    return Acting(kind, values, Setting(**setting)).along(quantity, *places)


def read_by_camera(channels, y, time, scale, values):
    """Channels as a camera with faults reads them."""
    return acted("unit_pressure", View(), values, "view", time_s=time).read(channels, y, scale)


def held(time, initial_kPa, compliance_per_kPa=0.0, **values):
    """Pressures in a chamber with its valve shut, with values by name of an effect's parameter."""
    keys = {p.name: f"{n}.{p.name}" for n, laws in laws_of("pressure_hold").items() for w in laws
            for p in w.parameters}  # fmt: skip
    values = {keys[name]: value for name, value in values.items()}
    chamber = acted("pressure_hold", Chamber(initial_kPa, compliance_per_kPa), values, "gas")
    return chamber.pressure_kPa(time)


def measured(simulator, planned, values, noise=0.0, seed=0):
    """The planned experiment as the simulator sees it, first channel only, with white noise."""
    import attrs

    channel = simulator.channels(planned)[0]
    y = simulator.predict(planned, values)[0]
    y = y + noise * np.random.default_rng(seed).normal(size=len(y))
    return attrs.evolve(planned, columns={**planned.columns, channel: y})


def parameters(simulator):
    """Every parameter by the key of its value."""
    found = {p.name: p for p in simulator.nuisances}
    for e in simulator.effects:
        found |= dict(zip(e.keys, e.parameters, strict=True))
    return found


def recovered(simulator, experiments, start, noise):
    """Values that fit first channels best, within bounds, their standard deviations, and chi squared."""
    known = parameters(simulator)
    keys = tuple(start)
    x0 = np.array([start[k] for k in keys])
    low, high = np.array([known[k].low for k in keys]), np.array([known[k].high for k in keys])
    size = np.maximum(np.abs(x0), 1e-3)

    def off(x):
        values = dict(zip(keys, x * size, strict=True))
        return np.concatenate(
            [(simulator.predict(e, values)[0] - e[simulator.channels(e)[0]]) / noise for e in experiments]
        )

    found = least_squares(off, x0 / size, bounds=(low / size, high / size), diff_step=1e-5, x_scale="jac")
    sd = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac))) * size
    return dict(zip(keys, found.x * size, strict=True)), dict(zip(keys, sd, strict=True)), 2 * found.cost
