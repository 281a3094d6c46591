"""A bench that hides what is wrong with it: `python -m tests.blind.injector FOLDER`, orders on stdin.

The order is one JSON line. It writes a folder of measured data, prints a commitment (sha256 of the
answer with a salt), waits for the line `reveal`, and only then prints the answer.
"""

import hashlib
import json
import secrets
import sys
from pathlib import Path

import numpy as np

from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.record import record
from tests.blind.truth import observe
from tests.evidence import analytic

OUTSIDE = ("resonance", "marker_slip", "stick_slip", "torn_chamber", "camera_distortion")


def bench(rng, count, dt):
    """Experiments of a bench; order kept, since a specimen remembers."""
    return analytic.protocols(dt, count)


def shape_of(rng, effect, total_s):
    """Parameters of an effect beside its size."""
    if effect is None or effect in analytic.STATIC:
        return {}
    between = {
        "viscoelasticity.time_s": (0.5, 50.0),
        "rate_independent_hysteresis.threshold_kPa": (0.7, 9.0),
        "mullins_softening.energy_share": (0.1, 0.6),
        "resonance.hertz": (0.4, 1.2),
        "resonance.damping": (0.02, 0.08),
    }
    found = {
        k: float(np.exp(rng.uniform(*np.log(v)))) for k, v in between.items() if k.startswith(effect + ".")
    }
    if effect in ("marker_slip", "torn_chamber"):
        found[f"{effect}.after"] = float(rng.uniform(0.2, 0.8) * total_s)
    return found


SIZES = {
    "resonance": ("resonance.size", 1.0, 0.05, 1.0),
    "marker_slip": ("marker_slip.mm", 30.0, 0.1, 1.0),
    "stick_slip": ("stick_slip.jump_kPa", 12.0, 0.5, 0.0),
    "torn_chamber": ("torn_chamber.share", 1.0, 0.05, 1.0),
    "camera_distortion": ("camera_distortion.per_mm2", 2e-3, 1e-6, 1.0),
}


def main():
    folder = Path(sys.argv[1])
    order = json.loads(sys.stdin.readline())
    rng = np.random.default_rng(order["seed"])
    effect, times = order.get("effect"), order.get("times", 4.0)
    dt = float(np.exp(rng.uniform(np.log(0.05), np.log(0.5))))
    dt = round(order.get("dt", dt), 3)
    rho = float(rng.uniform(0.5, 0.97))
    rho = order.get("rho", rho)
    count = int(order.get("count", rng.integers(3, order.get("most", 10) + 1)))
    level = float(np.exp(rng.uniform(np.log(0.03), np.log(0.2))))
    slow_share = float(rng.uniform(0.3, 0.9))
    tests = bench(rng, count, dt)
    total = sum(t[-1] - t[0] for _, t, _, _ in tests)
    noise = {
        c: (
            level * (3.0 if c == "angle_deg" else 1.0) * np.sqrt(1 - slow_share),
            level * (3.0 if c == "angle_deg" else 1.0) * np.sqrt(slow_share),
            -dt / np.log(rho),
        )
        for c in analytic.CHANNELS
    }
    base = {"modulus_factor": float(rng.uniform(0.9, 1.1))}
    zeros = rng.normal(0.0, 0.5, len(analytic.CHANNELS))
    answer = {"effect": effect, "times": times, "values": dict(base), "count": count, "dt": dt, "rho": rho}
    values = base | order.get("values", {})
    # Sizes that were ordered are taken as they are; others are drawn by what can be seen.
    drawn_ones = [] if "values" in order else [effect] if isinstance(effect, str) else (effect or [])
    for name in drawn_ones:
        found = sized(rng, tests, name, times, base, noise, total)
        if found is None:
            answer["impossible"] = True
            break
        values |= found
    answer["values"] = values
    truth = observe(tests, values, analytic.STATIC)
    write(folder, rng, tests, truth, zeros, noise, order)
    sealed = json.dumps({**answer, "salt": secrets.token_hex(16)}, sort_keys=True)
    print(json.dumps({"commitment": hashlib.sha256(sealed.encode()).hexdigest()}), flush=True)
    if sys.stdin.readline().strip() == "reveal":
        print(sealed, flush=True)


def sized(rng, tests, effect, times, base, noise, total):
    """Values of an effect at `times` its detection limit, by the noise that is to come; None if out of reach.

    The limit is that of a size whose change, nuisances fitted, is 4 standard deviations long once whitened.
    """
    shape = shape_of(rng, effect, total)
    # Channels that differ, since repeated ones are left out.
    bare = [
        analytic.experiment(
            n, t, p, {c: np.full(len(t), float(k)) for k, c in enumerate(analytic.CHANNELS)}, **how
        )
        for n, t, p, how in tests
    ]
    model = analytic.simulator(bare)
    data = record(bare, model)
    sources = {g: Source(*noise["angle_deg" if "angle" in g else "marker1_y_mm"]) for g in data.groups}
    fitter = Fitter(data, model, sources)
    plain = long(data, observe(tests, base, analytic.STATIC))
    other = dict(base) | {"modulus_factor": base["modulus_factor"] * 1.001}
    tangent = fitter.project(long(data, observe(tests, other, analytic.STATIC)) - plain)
    tangent /= np.linalg.norm(tangent)

    def length(size):
        moved = long(data, observe(tests, base | shape | {key: size}, analytic.STATIC)) - plain
        j = fitter.project(moved)
        return float(np.linalg.norm(j - tangent * (tangent @ j)))

    sign = 1.0
    if effect in SIZES:
        key, most, small, _ = SIZES[effect]
    else:
        e = next(e for e in model.effects if e.name == effect)
        p = e.parameters[0]
        key = e.keys[0]
        if p.null == p.low:
            most = p.high
        else:
            sign = float(rng.choice([-1.0, 1.0]))
            most = p.high if sign > 0 else -p.low
        small = abs(p.step) * 10.0
    wanted = 4.0 * times
    size = small
    for _ in range(30):
        now = length(sign * size)
        if now <= 1e-9:
            return None
        new = (
            size * wanted / now if effect != "stick_slip" else size * np.clip((wanted / now) ** 0.5, 0.5, 2.0)
        )
        new = min(max(new, size / 20.0), size * 20.0)
        if new >= most:
            if size >= most:
                return None
            new = most
        done = abs(now / wanted - 1.0) < 0.03
        size = new
        if done:
            return shape | {key: sign * size}
    return shape | {key: sign * size} if abs(length(sign * size) / wanted - 1.0) < 0.3 else None


def long(data, observed):
    """Channels of each experiment as the long vector of a record."""
    found = np.empty(len(data))
    for s in data.series:
        found[s.at] = s.mean(observed[s.experiment][s.row])
    return found


def write(folder, rng, tests, truth, zeros, noise, order):
    """The folder of measured data, with metadata that mean nothing among those that do."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    shift = float(rng.uniform(0.0, 500.0))
    for k, ((name, time, pressure, how), y) in enumerate(zip(tests, truth, strict=True)):
        columns = [time + shift, pressure]
        head = ["time_s", "pressure_kPa"]
        for c, v, zero in zip(analytic.CHANNELS, y, zeros, strict=True):
            if order.get("markers", True) or c == "angle_deg":
                head.append(c)
                columns.append(v + zero + drawn(rng, time, *noise[c]))
        for m in (1, 2, 3):
            if f"marker{m}_y_mm" in head:
                # Out of the plane nothing moves; the camera sees noise there too.
                head.append(f"marker{m}_x_mm")
                columns.append(drawn(rng, time, *noise["marker1_y_mm"]))
        text = ["# bench record", ",".join(head)]
        text += [",".join(f"{v:.6f}" for v in row) for row in np.stack(columns, axis=1)]
        (folder / f"run{k}.csv").write_text("\n".join(text) + "\n")
        lines += [
            "[[experiment]]",
            f'name = "{name}"',
            'kind = "unit_pressure"',
            f'file = "run{k}.csv"',
            'role = "fit"',
            f"orientation_deg = {how.get('orientation_deg', 0.0)}",
            'specimen = "A"',
            f"temperature_C = {how.get('temperature_C', 23.0)}",
            f'source = "{rng.choice(["bench 1", "bench 2", "suspected leak", "new line, lag?"])}"',
            "",
        ]
    (folder / "experiments.toml").write_text("\n".join(lines))


def drawn(rng, time, white, slow, time_s):
    """Slow and white noise: an AR(1) series run in from far before the record."""
    from scipy.signal import lfilter

    rho = float(np.exp(-(time[1] - time[0]) / time_s))
    before = int(20.0 / max(1.0 - rho, 1e-3))
    shocks = rng.normal(size=before + len(time)) * np.sqrt(1.0 - rho * rho)
    series = lfilter([1.0], [1.0, -rho], shocks)[before:]
    return slow * series + rng.normal(0.0, white, len(time))


if __name__ == "__main__":
    main()
