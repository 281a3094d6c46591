"""Benches that hide what is wrong with them: a folder of measured data by an order, and its truth.

An order holds a seed, and may hold: effect (a name, or several), times (its detection limit), values (sizes
that are not drawn by what can be seen), unit ("written" or "simulated", or a kind of experiment that
`machines` has a bench of), noise ("one" slow process beside white noise, "two", or "white"), and, for a unit,
count, most, dt, level.
"""

import math

import numpy as np

from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.blind.machines import BENCHES, with_channels
from tests.blind.truth import UNITS, observe
from tests.evidence import analytic

OUTSIDE = ("resonance", "stick_slip", "torn_chamber", "camera_distortion")
# Experiments without which an effect leaves no trace: the sixth is the first at another temperature.
FEWEST = {"temperature_drift": 6}
# Size of what is not in any library, or has its parameters by the data there, and where it ends.
SIZES = {
    "resonance": ("resonance.size", 1.0),
    "marker_slip": ("marker_slip.marker2_mm", 12.0),
    "stick_slip": ("stick_slip.jump_kPa", 12.0),
    "torn_chamber": ("torn_chamber.share", 1.0),
    "camera_distortion": ("camera_distortion.per_mm2", 2e-3),
}
SHAPES = {
    "viscoelasticity.time_s": (0.5, 50.0),
    "rate_independent_hysteresis.threshold_kPa": (0.7, 9.0),
    "mullins_softening.energy_share": (0.1, 0.6),
    "resonance.hertz": (0.4, 1.2),
    "resonance.damping": (0.02, 0.08),
    "marker_slip.marker2_direction_deg": (5.0, 170.0),
}


def gauge_noise(order):
    """The gauge's own white noise as a share of what it goes through: none in half of the sets."""
    rng = np.random.default_rng([order["seed"], 1])
    return float(np.exp(rng.uniform(np.log(1e-4), np.log(1e-3))) * rng.integers(2))


def gauged(order, number, values):
    """A drive (n,) as a gauge reads it in the experiment of that number."""
    # By a generator of its own: another gauge is no other camera.
    rng = np.random.default_rng([order["seed"], 2, number])
    return values + rng.normal(size=len(values)) * gauge_noise(order) * np.ptp(values)


def shape_of(rng, effect, total_s):
    """Parameters of an effect beside its size."""
    found = {
        k: float(np.exp(rng.uniform(*np.log(v)))) for k, v in SHAPES.items() if k.startswith(effect + ".")
    }
    if effect in ("marker_slip", "torn_chamber"):
        found[f"{effect}.after"] = float(rng.uniform(0.2, 0.8) * total_s)
    return found


def hide(order, folder):
    """Write the folder that an order asks for."""
    (hide_machine if order.get("unit") in BENCHES else hide_in_unit)(order, folder)


def drawn_effects(order):
    """Effects of an order, as a list."""
    effects = order.get("effect") or []
    return [effects] if isinstance(effects, str) else effects


def hide_in_unit(order, folder):
    """Serve one order of a unit under pressure."""
    rng = np.random.default_rng(order["seed"])
    unit = UNITS[order.get("unit", "written")]()
    effects, times = drawn_effects(order), order.get("times", 4.0)
    dt = float(np.exp(rng.uniform(np.log(0.1), np.log(0.5))))
    dt = round(order.get("dt", dt), 3)
    rho = float(rng.uniform(0.5, 0.97))
    fewest = max([3, *(FEWEST.get(e, 3) for e in effects)])
    count = int(order.get("count", rng.integers(fewest, max(order.get("most", 10), fewest) + 1)))
    level = float(np.exp(rng.uniform(np.log(0.03), np.log(0.2))))
    level = order.get("level", level)
    slow_share = float(rng.uniform(0.3, 0.9))
    if order.get("noise") == "white":
        slow_share = 0.0
    tests = unit.bench(dt, count)
    total = sum(t[-1] - t[0] for _, t, _, _ in tests)
    noise = {}
    for c in analytic.CHANNELS:
        sd = level * (3.0 if c == "angle_deg" else 1.0)
        noise[c] = (sd * np.sqrt(1 - slow_share), sd * np.sqrt(slow_share), -dt / np.log(rho))
    base = {"modulus_factor": float(rng.uniform(0.9, 1.1))}
    zeros = rng.normal(0.0, 0.5, len(analytic.CHANNELS))
    values = base | order.get("values", {})
    # Sizes that were ordered are taken as they are; others are drawn by what can be seen.
    for name in effects if "values" not in order else []:
        values |= sized(rng, unit, tests, name, times, base, noise, total)
    truth = observe(tests, values, unit)
    clock = float(rng.uniform(0.0, 500.0))
    write(folder, rng, tests, truth, zeros, noise, order, clock)


def hide_machine(order, folder):
    """Serve one order of another kind of experiment."""
    rng = np.random.default_rng(order["seed"])
    bench = BENCHES[order["unit"]]
    effects, times = drawn_effects(order), order.get("times", 4.0)
    dt = round(float(np.exp(rng.uniform(np.log(0.2), np.log(0.6)))), 3)
    rho, slow_share = float(rng.uniform(0.5, 0.97)), float(rng.uniform(0.3, 0.9))
    level = float(np.exp(rng.uniform(np.log(1e-3), np.log(1e-2))))
    planned, base = bench.plan(rng, dt), bench.base(rng)
    if order.get("noise") == "white" or "time_s" not in planned[0].columns:
        slow_share = 0.0
    sd = level * bench.reading(base)
    source = Source(sd * np.sqrt(1 - slow_share), sd * np.sqrt(slow_share), -dt / np.log(rho))
    values = base | order.get("values", {})
    for name in effects if "values" not in order else []:
        values |= sized_machine(rng, bench, planned, name, times, base, source)
    truth = bench.observe(planned, values)
    clock = float(rng.uniform(0.0, 500.0))
    write_machine(folder, rng, bench, planned, truth, source, order, clock)


def sized_machine(rng, bench, planned, effect, times, base, source):
    """As `sized`: the size whose change the base model, fitted to it, cannot follow by so much."""
    group = f"{bench.kind} {bench.channel.rpartition('_')[0]}"
    shape = {
        k: float(np.exp(rng.uniform(np.log(low), np.log(high))))
        for k, low, high in bench.shapes
        if k.startswith(effect + ".")
    }
    model = Composite(bench_simulators(weighed(planned, bench.observe(planned, base))))
    p = next(e for e in model.effects if e.name == effect).parameters[0]
    key = f"{effect}.{p.name}"
    sign = float(rng.choice([s for s, bound in ((-1.0, p.low), (1.0, p.high)) if bound != p.null]))
    slow = Source(source.white, max(source.slow, 1e-3 * source.white), source.time_s)

    def length(size):
        made = weighed(planned, bench.observe(planned, base | shape | {key: p.null + sign * size}))
        other = Composite(bench_simulators(made))
        fitter = Fitter(record(made, other), other, {group: slow})
        return float(np.sqrt(fitter.fit((), base).chi2))

    size = reached(length, abs((p.high if sign > 0 else p.low) - p.null), 4.0 * times)
    return shape | {key: p.null + sign * size}


def weighed(planned, observed):
    """The experiments with what was observed, masses to half a per cent."""
    return with_channels(
        planned, [y | ({"mass_sd_g": 5e-3 * y["mass_g"]} if "mass_g" in y else {}) for y in observed]
    )


def write_machine(folder, rng, bench, planned, truth, source, order, clock):
    """The folder of measured data of another kind; source: of the noise."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for k, (e, y) in enumerate(zip(planned, truth, strict=True)):
        columns = {c: v for c, v in {**e.columns, **y}.items() if not c.startswith("mass")}
        lines += ["[[experiment]]", f'name = "{e.name}"', f'kind = "{e.kind}"', f'file = "run{k}.csv"']
        lines += ['role = "fit"', f"scale = {e.scale}"]
        for name in ("specimen", "mode", "axis"):
            lines += [f'{name} = "{getattr(e, name)}"'] if getattr(e, name) else []
        for name in ("length_mm", "section_mm"):
            value = getattr(e, name)
            lines += [f"{name} = {list(value) if name == 'section_mm' else value}"] if value else []
        lines += [f"temperature_C = {e.temperature_C}"] if np.isfinite(e.temperature_C) else []
        if "mass_g" in y:
            mass = float(y["mass_g"][0])
            lines += [f"mass_g = {mass * (1 + 5e-3 * rng.normal())}", f"mass_sd_g = {5e-3 * mass}"]
        time = columns.get("time_s", np.arange(len(e), dtype=float))
        noise = drawn(rng, time, source.white, source.slow, source.time_s, order.get("noise") == "two")
        columns[bench.channel] = columns[bench.channel] + noise
        for drive in ("strain", "angle_deg") if "time_s" in columns else ():
            if drive in columns:
                columns[drive] = gauged(order, k, columns[drive])
        if "time_s" in columns:
            columns["time_s"] = columns["time_s"] + clock
        lines += [f'source = "{rng.choice(["machine 1", "machine 2", "worn grips?", "new operator"])}"', ""]
        text = [",".join(columns)]
        text += [",".join(f"{v:.9g}" for v in row) for row in np.stack(list(columns.values()), axis=1)]
        (folder / f"run{k}.csv").write_text("\n".join(text) + "\n")
    (folder / "experiments.toml").write_text("\n".join(lines))


def sized(rng, unit, tests, effect, times, base, noise, total):
    """Values of an effect at `times` its detection limit, by the noise that is to come.

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
    model = judged_unit(unit, bare)
    data = record(bare, model)
    sources = {g: Source(*noise["angle_deg" if "angle" in g else "marker1_y_mm"]) for g in data.groups}
    sources = {g: Source(s.white, max(s.slow, 1e-3 * s.white), s.time_s) for g, s in sources.items()}
    fitter = Fitter(data, model, sources)
    plain = long(data, observe(tests, base, unit, 4))
    other = dict(base) | {"modulus_factor": base["modulus_factor"] * 1.001}
    tangent = fitter.project(long(data, observe(tests, other, unit, 4)) - plain)
    tangent /= np.linalg.norm(tangent)

    sign = 1.0
    if effect in SIZES:
        (key, most), null = SIZES[effect], 0.0
    else:
        e = next(e for e in model.effects if e.name == effect)
        key, null = e.keys[0], e.parameters[0].null
        low, high = unit.reach(effect, e.parameters[0])
        sign = float(rng.choice([s for s, bound in ((-1.0, low), (1.0, high)) if bound != null]))
        most = abs((high if sign > 0 else low) - null)

    def length(size):
        values = base | shape | {key: null + sign * size}
        j = fitter.project(long(data, observe(tests, values, unit, 4)) - plain)
        return float(np.linalg.norm(j - tangent * (tangent @ j)))

    size = reached(length, most, 4.0 * times)
    return shape | {key: null + sign * size}


def reached(length, most, wanted):
    """The size, up to `most`, at which `length` of it is what is wanted; a ValueError where it never is."""
    # What touches only at a large size shows nothing below it, and little again where it always touches.
    low, high, now = 0.0, math.inf, 0.0
    for size in most * np.unique([*np.geomspace(1e-5, 1.0, 11), *np.linspace(0.1, 1.0, 10)]):
        now = length(size)
        if now >= wanted:
            high = float(size)
            break
        low = float(size)
    if math.isinf(high):
        raise ValueError("no size is seen as well as that")
    size = high
    for _ in range(30):
        if abs(now / wanted - 1.0) < 0.03:
            return size
        # In proportion where that lies between the bounds, their middle otherwise.
        guess = size * wanted / now if now > 0 else 0.0
        size = guess if low < guess < high else 0.5 * (low + high)
        now = length(size)
        low, high = (size, high) if now < wanted else (low, size)
    if abs(now / wanted - 1.0) >= 0.3:
        raise ValueError("no size is seen just as well as that")
    return size


def judged_unit(unit, experiments):
    """The judge's simulator of unit_pressure experiments made with a unit."""
    from mu_addon.evidence.prediction.unit_pressure import UnitPressure

    kinds = sorted({(e.scale, e.orientation_deg) for e in experiments if e.kind == "unit_pressure"})
    return Composite({"unit_pressure": UnitPressure(unit.responses(kinds), experiments)})


def long(data, observed):
    """Channels of each experiment as the long vector of a record."""
    found = np.empty(len(data))
    for s in data.series:
        found[s.at] = s.mean(observed[s.experiment][s.row])
    return found


def write(folder, rng, tests, truth, zeros, noise, order, clock):
    """The folder of measured data, with metadata that mean nothing among those that do."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    many = order.get("noise") == "two"
    for k, ((name, time, pressure, how), y) in enumerate(zip(tests, truth, strict=True)):
        columns, head = [time + clock, gauged(order, k, pressure)], ["time_s", "pressure_kPa"]

        def read(values, c, time=time):
            return values + drawn(rng, time, *noise[c], many=many)

        for c, v, zero in zip(analytic.CHANNELS, y, zeros, strict=True):
            head.append(c)
            columns.append(read(v + zero, c))
        for m in (1, 2, 3):
            # Out of the plane nothing moves; the camera sees noise there too.
            head.append(f"marker{m}_x_mm")
            columns.append(read(np.zeros(len(time)), "marker1_y_mm"))
        text = ["# bench record", ",".join(head)]
        text += [",".join(f"{v:.6f}" for v in row) for row in np.stack(columns, axis=1)]
        (folder / f"run{k}.csv").write_text("\n".join(text) + "\n")
        lines += [
            "[[experiment]]",
            f'name = "{name}"',
            'kind = "unit_pressure"',
            f'file = "run{k}.csv"',
            'role = "fit"',
            f"scale = {how.get('scale', 1.0)}",
            f"orientation_deg = {how.get('orientation_deg', 0.0)}",
            f'specimen = "{how.get("specimen", "A")}"',
            f"temperature_C = {how.get('temperature_C', 23.0)}",
            f'source = "{rng.choice(["bench 1", "bench 2", "suspected leak", "new line, lag?"])}"',
            "",
        ]
    (folder / "experiments.toml").write_text("\n".join(lines))


def drawn(rng, time, white, slow, time_s, many=False):
    """Slow and white noise; many: half of the slow part wanders eight times as slowly."""
    found = rng.normal(0.0, white, len(time))
    for share, longer in ((0.5, 1.0), (0.5, 8.0)) if many else ((1.0, 1.0),):
        found = found + np.sqrt(share) * slow * wandering(rng, time, longer * time_s)
    return found


def wandering(rng, time, time_s):
    """An AR(1) series of unit variance, run in from far before the record."""
    from scipy.signal import lfilter

    rho = float(np.exp(-(time[1] - time[0]) / time_s))
    before = int(20.0 / max(1.0 - rho, 1e-3))
    shocks = rng.normal(size=before + len(time)) * np.sqrt(1.0 - rho * rho)
    return lfilter([1.0], [1.0, -rho], shocks)[before:]
