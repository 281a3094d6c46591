"""What the hidden unit does: integrated in fine steps, by equations of its own, never by the judge's."""

import numpy as np

from tests.blind import unit_runs
from tests.evidence import analytic

# Steps a sample of the record; every law is followed in these.
FINER = 16


def refined(time, pressure, finer):
    """The same record in finer steps: time, pressure, and the places of the samples."""
    n = len(time)
    places = np.arange(n) * finer
    fine = np.interp(np.arange((n - 1) * finer + 1), places, time)
    return fine, np.interp(fine, time, pressure), places


def first_order(time, drive, time_s):
    """Solution of time_s x' + x = drive by the classical Runge-Kutta rule, from equilibrium."""
    from scipy.signal import lfilter

    h = float(np.median(np.diff(time)))
    # Several steps where the process is faster than the clock.
    parts = max(1, int(np.ceil(4.0 * h / time_s)))
    at = np.arange((len(time) - 1) * parts + 1) / parts
    fine = np.interp(at, np.arange(len(drive)), drive)
    z = h / parts / time_s

    def step(x, a, c):
        b = 0.5 * (a + c)
        k1 = a - x
        k2 = b - x - 0.5 * z * k1
        k3 = b - x - 0.5 * z * k2
        k4 = c - x - z * k3
        return x + z * (k1 + 2 * k2 + 2 * k3 + k4) / 6.0

    # The rule is linear in what it is given: three numbers are the whole of it.
    keeps, of_first, of_last = step(1.0, 0.0, 0.0), step(0.0, 1.0, 0.0), step(0.0, 0.0, 1.0)
    found, _ = lfilter([1.0], [1.0, -keeps], of_first * fine[:-1] + of_last * fine[1:], zi=[keeps * fine[0]])
    return np.concatenate([[drive[0]], found])[::parts]


def relaxed(time, pressure, share, time_s):
    """Elastic equivalent of a pressure on a standard linear solid whose moduli lose `share` in time."""
    # p = E (q - share a), E = 1/(1 - share), and the inner strain a follows: time_s a' = q - a.
    inner = first_order(time, pressure, time_s / (1.0 - share))
    return pressure * (1.0 - share) + share * inner


def rubbed(pressure, share, threshold):
    """Elastic pressure beside one Jenkins element: a spring of stiffness K that slips at its friction."""
    stiffness = share / (1.0 - share)
    limit = stiffness * threshold * (1.0 - share)
    q, force = float(pressure[0]), 0.0
    found = [q]
    for dp in np.diff(pressure).tolist():
        # Stuck: dp = (1 + K) dq; slipping: dp = dq.
        dq = dp / (1.0 + stiffness)
        trial = force + stiffness * dq
        if abs(trial) > limit:
            edge = limit if trial > 0 else -limit
            stuck = (edge - force) / stiffness
            dq = stuck + (dp - (1.0 + stiffness) * stuck)
            trial = edge
        force = trial
        q += dq
        found.append(q)
    return np.array(found)


def softened(pressure, peak, softening, energy_share, reference):
    """Pressure over what Ogden and Roxburgh leave of the modulus, and the peak that is carried along."""
    from scipy.special import erf

    peaks = np.maximum(np.maximum.accumulate(np.abs(pressure)), peak)
    lost = softening * erf((peaks**2 - pressure**2) / (energy_share * reference**2))
    return pressure / (1.0 - lost), float(peaks[-1])


def turns(pressure):
    """Half cycles gone through, as a running number."""
    low, high = pressure.min(), pressure.max()
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(pressure)))])
    return travel / (2.0 * (high - low)) if high - low > 1e-9 else travel * 0.0


def ringing(time, drive, hertz, damping):
    """A mass on the elastic unit, driven by the pressure: average-acceleration Newmark steps."""
    w = 2.0 * np.pi * hertz
    x, v, a = float(drive[0]), 0.0, 0.0
    found = [x]
    for h, to in zip(np.diff(time).tolist(), drive[1:].tolist(), strict=True):
        x_free, v_free = x + h * v + 0.25 * h * h * a, v + 0.5 * h * a
        a = (w * w * (to - x_free) - 2.0 * damping * w * v_free) / (
            1.0 + damping * w * h + 0.25 * h * h * w * w
        )
        x, v = x_free + 0.25 * h * h * a, v_free + 0.5 * h * a
        found.append(x)
    return np.array(found)


def jerky(pressure, jump):
    """The unit follows only when the pressure has run away from it by a jump."""
    x, found = float(pressure[0]), []
    for p in pressure.tolist():
        if abs(p - x) >= jump:
            x = p
        found.append(x)
    return np.array(found)


class Written:
    """The unit whose response is written down; what the judge has of it is a table."""

    parameters = analytic.STATIC
    reference_kPa = 48.0

    def bench(self, dt, count):
        """Name, time, pressure and conditions of each experiment."""
        return analytic.protocols(dt, count)

    def reach(self, effect, parameter):
        """Smallest and largest size of an effect that may be hidden."""
        return parameter.low, parameter.high

    def responses(self, kinds):
        """The judge's responses at (scale, orientation)s."""
        return [analytic.response(*kind) for kind in kinds]

    def still(self, pressure, sizes, scale, turn, stiffness):
        """Channels (c, n) at rest at each pressure."""
        # All moduli scaled alike are every load scaled inversely, weight among them.
        weight = sizes.get("gravity", 0.0) / stiffness
        return analytic.channels(pressure, {**sizes, "gravity": weight}, scale, turn)


class Simulated:
    """The unit by finite elements: mesh, pressures, sizes and interpolation are not the judge's."""

    reference_kPa = max(map(abs, unit_runs.JUDGED_kPa))

    def __init__(self):
        from scipy.interpolate import BarycentricInterpolator, make_interp_spline

        from mu_addon.evidence.effects import STATIC as EFFECTS

        self._runs = unit_runs.table()
        pressures = np.array(unit_runs.HIDDEN_kPa)

        def curve(values):
            return make_interp_spline(pressures, values, k=5, axis=1).c

        base = self._runs["hidden"]
        self._spline = make_interp_spline(pressures, base, k=5, axis=1)
        self.parameters = {}
        self._changes = {}
        for name, sizes in unit_runs.SIZES.items():
            for turn in unit_runs.TURNS if EFFECTS[name].has_gravity else (0.0,):
                own = {s: self._runs.get(f"hidden {name} {s:g} {turn:g}") for s in sizes}
                own = {s: v for s, v in own.items() if v is not None and np.isfinite(v).all()}
                if len(own) == len(sizes):
                    at = [EFFECTS[name].parameter.null, *own]
                    table = np.stack([0.0 * curve(base), *(curve(v - base) for v in own.values())])
                    self._changes[name, turn] = BarycentricInterpolator(at, table)
                    self.parameters[name] = EFFECTS[name].parameter
        self._weighs = {name for name in unit_runs.SIZES if EFFECTS[name].has_gravity}

    def bench(self, dt, count):
        """As the written unit's, at four fifths of the pressure, hanging or level."""
        known = [b for b in analytic.protocols(dt, 10) if b[3].get("orientation_deg", 0.0) in unit_runs.TURNS]
        return [(name, t, 0.8 * p, how) for name, t, p, how in known[:count]]

    def reach(self, effect, parameter):
        """Smallest and largest size of an effect that may be hidden: as far as it was run."""
        sizes = (parameter.null, *unit_runs.SIZES[effect]) if effect in unit_runs.SIZES else ()
        return (min(sizes), max(sizes)) if sizes else (parameter.low, parameter.high)

    def responses(self, kinds):
        """The judge's responses at (scale, orientation)s, of scale 1."""
        return [unit_runs.response(self._runs, turn) for _, turn in kinds]

    def still(self, pressure, sizes, scale, turn, stiffness):
        """Channels (c, n) at rest at each pressure."""
        from scipy.interpolate import BSpline

        c = self._spline.c
        for name, size in sizes.items():
            if name in self._weighs:
                c = c + self._changes[name, turn](size / stiffness)
            else:
                c = c + self._changes[name, 0.0](size)
        return BSpline(self._spline.t, c, self._spline.k)(pressure).T


UNITS = {"written": Written, "simulated": Simulated}


def observe(bench, values, unit, finer=FINER):
    """Channels (c, n) of each experiment of a bench; a specimen goes through them one after the other.

    bench: (name, time, pressure, conditions); values: as the judge names them, and outsiders' own.
    """
    get = values.get
    pasts, answers, start = {}, [], 0.0
    for _, time, pressure, how in bench:
        fine, p, places = refined(time, pressure, finer)
        scale, turned = how.get("scale", 1.0), how.get("orientation_deg", 0.0)
        peak, done = pasts.get(scale, (0.0, 0.0))
        travelled = done + turns(p)
        if delay := get("clock_offset.offset_s", 0.0):
            p = np.interp(fine - delay, fine, p)
        p = (p - get("pressure_offset.offset_kPa", 0.0)) / (1.0 + get("pressure_gain.gain", 0.0))
        p = p / (1.0 + get("leak.conductance_ratio", 0.0))
        if lag := get("line_lag.time_s", 0.0):
            p = first_order(fine, p, lag)
        stiffness = get("modulus_factor", 1.0)
        kelvin = how.get("temperature_C", 23.0) - 23.0
        stiffness = stiffness * (1.0 + get("temperature_drift.per_K", 0.0) * kelvin)
        worn = 1.0 - get("fatigue_drift.per_decade", 0.0) * np.log10(1.0 + travelled)
        p = p / (stiffness * worn)
        if share := get("viscoelasticity.share", 0.0):
            p = relaxed(fine, p, share, values["viscoelasticity.time_s"])
        if share := get("rate_independent_hysteresis.share", 0.0):
            p = rubbed(p, share, values["rate_independent_hysteresis.threshold_kPa"])
        if softening := get("mullins_softening.softening", 0.0):
            share = values["mullins_softening.energy_share"]
            p, peak = softened(p, peak, softening, share, unit.reference_kPa)
        pasts[scale] = peak, float(travelled[-1])
        if hertz := get("resonance.hertz", 0.0):
            rung = ringing(fine, p, hertz, values["resonance.damping"])
            p = p + get("resonance.size", 1.0) * (rung - p)
        if jump := get("stick_slip.jump_kPa", 0.0):
            p = jerky(p, jump)
        static = {k.split(".")[0]: v for k, v in values.items() if k.split(".")[0] in unit.parameters}
        y = unit.still(p, static, scale, turned, stiffness)
        clock = start + fine - fine[0]
        start = clock[-1]
        if torn := get("torn_chamber.share", 0.0):
            # A tear opens at some moment and stays.
            after = clock > values["torn_chamber.after"]
            y = np.where(
                after, unit.still(p, {**static, "clogged_chamber": torn}, scale, turned, stiffness), y
            )
        # On another specimen the marker is another one.
        if (slip := get("marker_slip.marker2_mm", 0.0)) and how.get("specimen", "A") == "A":
            # It turns with the surface, which is along the line from the marker below to the one above.
            tilt = np.arctan2(y[5] - y[1], y[6] - y[2])
            way = np.radians(values["marker_slip.marker2_direction_deg"]) - tilt
            after = clock > values["marker_slip.after"]
            y[3] = y[3] + slip * np.cos(way) * after
            y[4] = y[4] + slip * np.sin(way) * after
        if bulge := get("camera_distortion.per_mm2", 0.0):
            for k in (1, 3, 5):
                square = y[k] ** 2 + (y[k + 1] - 40.0) ** 2
                y[k], y[k + 1] = y[k] * (1 + bulge * square), 40.0 + (y[k + 1] - 40.0) * (1 + bulge * square)
        answers.append(y[:, places])
    return answers
