"""Folders of measured data whose cause is known."""

import json

import numpy as np

from mu_addon.evidence.prediction.lattice_compression import Struts
from tests.evidence import analytic

SCALES = (0.75, 1.0, 1.5)
DRAWN_kPa = 12.0


def weighed_blocks(folder, offset_mm, noise=(0.4, -0.3, 0.2)):
    """Blocks of lattice at three scales, every surface `offset_mm` too far out, pressed and weighed."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for scale, z in zip(SCALES, noise, strict=True):
        modulus = DRAWN_kPa * Struts().stiffness(scale, offset_mm, 0.0) * (1 + 0.01 * z)
        side = 37.5 * scale
        mass = 0.15e-3 * side**3 * Struts().mass(scale, offset_mm) * (1 - 0.005 * z)
        rows = [f"{e},{modulus * e:.6f},{0.01 * modulus * e:.6f}" for e in (0.0, 0.1, 0.2, 0.3)]
        name = f"block_{scale:g}.csv"
        (folder / name).write_text("strain,stress_kPa,stress_sd_kPa\n" + "\n".join(rows) + "\n")
        lines.append(
            f'[[experiment]]\nname = "{scale:g}x"\nkind = "lattice_compression"\nfile = "{name}"\n'
            f'role = "fit"\nscale = {scale}\nspecimen = "{scale:g}x"\nsection_mm = [{side}, {side}]\n'
            f"length_mm = {side}\nmass_g = {mass:.6f}\nmass_sd_g = {0.005 * mass:.6f}\n"
        )
    (folder / "experiments.toml").write_text("\n".join(lines))
    return folder


def bent_unit(folder, values, count=3, dt=0.4, seed=3, gauge_kPa=0.0):
    """Cycles of the analytic unit, the last of them held out, with white noise of 0.1 deg and 0.03 mm.

    gauge_kPa: white noise of the gauge.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    tests = analytic.protocols(dt, count)
    empty = {c: np.arange(len(tests[0][1]), dtype=float) for c in analytic.CHANNELS}
    lines = []
    for i, (name, t, p, how) in enumerate(tests):
        seen = {c: np.zeros(len(t)) for c in empty}
        e = analytic.experiment(name, t, p, seen, **how)
        y = analytic.simulator([e]).predict(e, values)
        columns = {"time_s": t, "pressure_kPa": p + gauge_kPa * np.random.default_rng(i).normal(size=len(t))}
        for c, row in zip(analytic.CHANNELS, y, strict=True):
            columns[c] = row + (0.1 if c == "angle_deg" else 0.03) * rng.normal(size=len(t))
        for m in (1, 2, 3):
            columns[f"marker{m}_x_mm"] = np.full(len(t), 1.5 * m)
        table = "\n".join(",".join(f"{v:.6f}" for v in row) for row in zip(*columns.values(), strict=True))
        (folder / f"{i}.csv").write_text(",".join(columns) + "\n" + table + "\n")
        role = "held_out" if i == count - 1 else "fit"
        lines.append(
            f'[[experiment]]\nname = {json.dumps(name)}\nkind = "unit_pressure"\nfile = "{i}.csv"\n'
            f'role = "{role}"\nspecimen = "A"\n'
            + "".join(f"{k} = {v}\n" for k, v in ({"temperature_C": 23.0} | how).items())
        )
    (folder / "experiments.toml").write_text("\n".join(lines))
    return folder
