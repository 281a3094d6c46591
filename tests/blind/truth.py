"""What the hidden unit does: integrated in fine steps, by equations of its own, never by the judge's."""

import numpy as np

from tests.evidence.analytic import channels

FINER = 16


def refined(time, pressure):
    """The same record in finer steps: time, pressure, and the places of the samples."""
    n = len(time)
    places = np.arange(n) * FINER
    fine = np.interp(np.arange((n - 1) * FINER + 1), places, time)
    return fine, np.interp(fine, time, pressure), places


def first_order(time, drive, time_s):
    """Solution of time_s x' + x = drive by the classical Runge-Kutta rule, from equilibrium."""
    x = np.empty_like(drive)
    x[0] = drive[0]
    for i, h in enumerate(np.diff(time)):
        # Several steps where the process is faster than the clock.
        parts = max(1, int(np.ceil(4.0 * h / time_s)))
        value, d0, slope = x[i], drive[i], (drive[i + 1] - drive[i]) / parts
        for k in range(parts):
            a, c = d0 + k * slope, d0 + (k + 1) * slope
            b, s = 0.5 * (a + c), h / parts
            k1 = (a - value) / time_s
            k2 = (b - value - 0.5 * s * k1) / time_s
            k3 = (b - value - 0.5 * s * k2) / time_s
            k4 = (c - value - s * k3) / time_s
            value += s * (k1 + 2 * k2 + 2 * k3 + k4) / 6.0
        x[i + 1] = value
    return x


def relaxed(time, pressure, share, time_s):
    """Elastic equivalent of a pressure on a standard linear solid whose moduli lose `share` in time."""
    # p = E (q - share a), E = 1/(1 - share), and the inner strain a follows: time_s a' = q - a.
    q = np.empty_like(pressure)
    a = pressure[0]
    q[0] = pressure[0]
    for i, h in enumerate(np.diff(time)):
        p0, p1 = pressure[i] * (1 - share), pressure[i + 1] * (1 - share)

        def rate(a, p):
            return (p + share * a - a) / time_s

        k1 = rate(a, p0)
        k2 = rate(a + 0.5 * h * k1, 0.5 * (p0 + p1))
        k3 = rate(a + 0.5 * h * k2, 0.5 * (p0 + p1))
        k4 = rate(a + h * k3, p1)
        a = a + h * (k1 + 2 * k2 + 2 * k3 + k4) / 6.0
        q[i + 1] = p1 + share * a
    return q


def rubbed(pressure, share, threshold):
    """Elastic pressure beside one Jenkins element: a spring of stiffness K that slips at its friction."""
    stiffness = share / (1.0 - share)
    limit = stiffness * threshold * (1.0 - share)
    q, force = pressure[0], 0.0
    found = [q]
    for dp in np.diff(pressure):
        # Stuck: dp = (1 + K) dq; slipping: dp = dq.
        dq = dp / (1.0 + stiffness)
        trial = force + stiffness * dq
        if abs(trial) > limit:
            edge = np.sign(trial) * limit
            stuck = (edge - force) / stiffness
            dq = stuck + (dp - (1.0 + stiffness) * stuck)
            trial = edge
        force = trial
        q += dq
        found.append(q)
    return np.array(found)


def softened(pressure, peak, softening, energy_share, reference):
    """Pressure over what Ogden and Roxburgh leave of the modulus, the peak carried along."""
    from math import erf

    found = np.empty_like(pressure)
    for i, p in enumerate(pressure):
        peak = max(peak, abs(p))
        found[i] = p / (1.0 - softening * erf((peak**2 - p**2) / (energy_share * reference**2)))
    return found, peak


def turns(pressure):
    """Half cycles gone through, as a running number."""
    low, high = pressure.min(), pressure.max()
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(pressure)))])
    return travel / (2.0 * (high - low)) if high - low > 1e-9 else travel * 0.0


def ringing(time, drive, hertz, damping):
    """A mass on the elastic unit, driven by the pressure: average-acceleration Newmark steps."""
    w = 2.0 * np.pi * hertz
    x, v = drive[0], 0.0
    a = 0.0
    found = [x]
    for i, h in enumerate(np.diff(time)):
        target = w * w * drive[i + 1]
        x_free, v_free = x + h * v + 0.25 * h * h * a, v + 0.5 * h * a
        a = (target - w * w * x_free - 2.0 * damping * w * v_free) / (
            1.0 + damping * w * h + 0.25 * h * h * w * w
        )
        x, v = x_free + 0.25 * h * h * a, v_free + 0.5 * h * a
        found.append(x)
    return np.array(found)


def jerky(pressure, jump):
    """The unit follows only when the pressure has run away from it by a jump."""
    x, found = pressure[0], []
    for p in pressure:
        if abs(p - x) >= jump:
            x = p
        found.append(x)
    return np.array(found)


def observe(bench, values, names, reference=48.0):
    """Channels (c, n) of each experiment of a bench, run one after the other on one specimen.

    bench: (name, time, pressure, conditions); values: as the judge names them, and outsiders' own.
    """
    get = values.get
    peak, done, answers = 0.0, 0.0, []
    start = 0.0
    for _, time, pressure, how in bench:
        fine, p, places = refined(time, pressure)
        travelled = done + turns(p)
        done = travelled[-1]
        if delay := get("clock_offset.offset_s", 0.0):
            p = np.interp(fine - delay, fine, p)
        p = (p - get("pressure_offset.offset_kPa", 0.0)) / (1.0 + get("pressure_gain.gain", 0.0))
        p = p / (1.0 + get("leak.conductance_ratio", 0.0))
        if lag := get("line_lag.time_s", 0.0):
            p = first_order(fine, p, lag)
        stiffness = get("modulus_factor", 1.0)
        stiffness = stiffness * (
            1.0 + get("temperature_drift.per_K", 0.0) * (how.get("temperature_C", 23.0) - 23.0)
        )
        p = p / (stiffness * (1.0 - get("fatigue_drift.per_decade", 0.0) * np.log10(1.0 + travelled)))
        if share := get("viscoelasticity.share", 0.0):
            p = relaxed(fine, p, share, values["viscoelasticity.time_s"])
        if share := get("rate_independent_hysteresis.share", 0.0):
            p = rubbed(p, share, values["rate_independent_hysteresis.threshold_kPa"])
        if softening := get("mullins_softening.softening", 0.0):
            p, peak = softened(p, peak, softening, values["mullins_softening.energy_share"], reference)
        if hertz := get("resonance.hertz", 0.0):
            rung = ringing(fine, p, hertz, values["resonance.damping"])
            p = p + get("resonance.size", 1.0) * (rung - p)
        if jump := get("stick_slip.jump_kPa", 0.0):
            p = jerky(p, jump)
        static = {key.split(".")[0]: v for key, v in values.items() if key.split(".")[0] in names}
        turned = how.get("orientation_deg", 0.0)
        y = channels(p, static, 1.0, turned)
        clock = start + fine - fine[0]
        start = clock[-1]
        if torn := get("torn_chamber.share", 0.0):
            # A tear opens at some moment and stays.
            whole = values["torn_chamber.after"]
            after = clock > whole
            y = np.where(after, channels(p, {**static, "clogged_chamber": torn}, 1.0, turned), y)
        if slip := get("marker_slip.mm", 0.0):
            after = clock > values["marker_slip.after"]
            y[3] = y[3] + slip * after
            y[4] = y[4] + 0.5 * slip * after
        if bulge := get("camera_distortion.per_mm2", 0.0):
            for k in (1, 3, 5):
                square = y[k] ** 2 + (y[k + 1] - 40.0) ** 2
                y[k], y[k + 1] = y[k] * (1 + bulge * square), 40.0 + (y[k + 1] - 40.0) * (1 + bulge * square)
        answers.append(y[:, places])
    return answers
