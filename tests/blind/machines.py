"""Benches of the kinds of experiment beside the unit's: closed forms of their own, effect by effect.

What the judge has by splines of its own, exact recursions, collocation and fixed points, is had here by
energies that are differentiated, differential equations that are stepped through, shooting and bisection.
"""

import math

import attrs
import numpy as np
from scipy.integrate import cumulative_trapezoid, simpson, solve_ivp, trapezoid
from scipy.optimize import brentq
from scipy.special import erf

from tests.blind.truth import first_order, refined
from tests.evidence.bench import experiment

GRAVITY = 9.80665
ATMOSPHERE = 101.325
FINER = 4


def loop(dt, *ends):
    """Time and strain of a machine that goes to each end (strain, seconds), in turn, from rest."""
    at, to = [0.0], [0.0]
    for strain, seconds in ends:
        at.append(at[-1] + seconds)
        to.append(strain)
    t = np.arange(0.0, at[-1], dt)
    return t, np.interp(t, at, to)


class Coupons:
    """Strips and sheets of resin, stretched and pressed at several rates, temperatures and directions.

    shapes: of effects, beside their sizes: key and range.
    """

    kind, channel = "coupon", "stress_kPa"
    effects = (
        "strain_stiffening",
        "tension_compression_asymmetry",
        "viscoelasticity",
        "mullins_softening",
        "rate_independent_hysteresis",
        "fatigue_drift",
        "temperature_drift",
        "anisotropy",
        "seating",
        "frame_compliance",
    )
    shapes = (
        ("viscoelasticity.time_s", 1.0, 60.0),
        ("mullins_softening.energy_share", 0.1, 0.6),
        ("rate_independent_hysteresis.hardening", 0.02, 0.4),
        ("seating.preload_kPa", 0.5, 2.0),
    )

    def plan(self, rng, dt):
        """The experiments, whose measured columns hold nothing yet."""
        long, thin = {"section_mm": (10.0, 4.0), "length_mm": 30.0}, {"section_mm": (6.0, 2.0)}
        first = loop(2 * dt, (0.3, 30), (0.0, 30), (0.6, 60), (0.0, 60))
        slow = loop(2 * dt, (0.6, 240), (0.0, 240))
        press = loop(2 * dt, (-0.25, 60), (0.0, 60))
        hold = loop(2 * dt, (0.4, 4), (0.4, 100), (0.1, 3), (0.1, 60))
        planned = [
            ("strip", "A", first, "uniaxial", long),
            ("strip again", "A", first, "uniaxial", long),
            ("slow", "B", slow, "uniaxial", long),
            ("pressed", "C", press, "uniaxial", long),
            ("held", "D", hold, "uniaxial", {**thin, "length_mm": 60.0}),
            ("warm", "E", first, "uniaxial", {**long, "temperature_C": 38.0}),
            ("across", "F", first, "uniaxial", {**long, "axis": "x"}),
            ("sheet", "G", slow, "equibiaxial", {**long, "section_mm": (40.0, 2.0)}),
            ("sheared", "H", first, "pure_shear", {"section_mm": (60.0, 2.0), "length_mm": 12.0}),
            ("strip, third", "A", first, "uniaxial", long),
        ]
        return [
            experiment(
                self.kind,
                {"time_s": t, "strain": e, self.channel: np.zeros(len(t))},
                name,
                specimen=specimen,
                mode=mode,
                **{"temperature_C": 23.0, "axis": "z"} | how,
            )
            for name, specimen, (t, e), mode, how in planned
        ]

    def base(self, rng):
        """What is fitted in every model, as it truly is."""
        return {"coupon_modulus_kPa": float(np.exp(rng.uniform(math.log(300.0), math.log(3000.0))))}

    def reading(self, base):
        """What the instrument usually reads, of whose share the noise is drawn."""
        return 0.3 * base["coupon_modulus_kPa"]

    def law(self, e, values):
        """Nominal stress of a strain at rest: the energy's derivative by the stretch, shared by two axes."""
        c1 = values["coupon_modulus_kPa"] / 6.0
        c2 = c1 * values.get("strain_stiffening.c2_over_c1", 0.0)
        excess = values.get("tension_compression_asymmetry.excess", 0.0)

        def energy(stretch):
            first = {
                "uniaxial": stretch**2 + 2.0 / stretch,
                "equibiaxial": 2.0 * stretch**2 + stretch**-4,
                "pure_shear": stretch**2 + 1.0 + stretch**-2,
            }[e.mode]
            return c1 * (first - 3.0) + c2 * (first - 3.0) ** 2

        def stress(strain):
            h = 1e-5
            found = (energy(1.0 + strain + h) - energy(1.0 + strain - h)) / (2.0 * h)
            found = found / (2.0 if e.mode == "equibiaxial" else 1.0)
            return np.where(strain < 0, (1.0 + excess) * found, found)

        return stress

    def observe(self, planned, values):
        """Stress (n,) of every experiment; specimens remember."""
        past, found = {}, []
        for e in planned:
            key = e.specimen, e.scale
            found.append({self.channel: pulled(e, self.law(e, values), values, *past.get(key, (0, 0.0)))})
            done, most = past.get(key, (0, 0.0))
            past[key] = done + 1, max(most, float(np.abs(e["strain"]).max()))
        return found


def pulled(e, law, values, done, most):
    """What a machine reads of a specimen of a law at rest that had `done` tests, to a strain of `most`."""
    get = values.get
    factor = 1.0 + get("anisotropy.in_plane", 0.0) * (e.axis in ("x", "y"))
    factor *= 1.0 + get("temperature_drift.per_K", 0.0) * (e.temperature_C - 23.0)
    factor *= 1.0 - get("fatigue_drift.per_decade", 0.0) * math.log10(1.0 + done)
    clock, strain, places = refined(e["time_s"], e["strain"], FINER)

    def rest(strain):
        return factor * law(strain)

    if gap := get("seating.gap_mm", 0.0):
        toe = gap / e.length_mm
        far = np.linspace(0.0, 1.2 * np.abs(strain).max() + 0.3, 20001)
        # Of each further bit of travel the specimen gets what the closing faces leave.
        travelled = cumulative_trapezoid(1.0 - np.exp(-far / toe), far, initial=0.0)
        bare = rest

        def closing(v):
            return bare(np.sign(v) * np.interp(np.abs(v), far, travelled))

        preload = get("seating.preload_kPa", 0.0) * min(1.0, gap / 0.01)
        begins = brentq(lambda v: float(closing(np.array(v))) - preload, 0.0, far[-1]) if preload else 0.0

        def rest(strain):
            return closing(strain + begins)

    if give := get("frame_compliance.mm_per_N", 0.0):
        width, thickness = e.section_mm
        # Travel of the machine is the specimen's and the frame's: read off along the specimen's own.
        own = np.linspace(min(strain.min(), 0.0) - 1e-9, max(strain.max(), 0.0) + 1e-9, 20001)
        travel = own + 1e-3 * give * width * thickness * rest(own) / e.length_mm
        strain = np.interp(strain, travel, own)
    if per_strain := get("rate_independent_hysteresis.per_strain", 0.0):
        strain = yielded(strain, 1.0 / per_strain, values["rate_independent_hysteresis.hardening"])
    stress = rest(strain)
    if softening := get("mullins_softening.softening", 0.0):
        every = np.linspace(0.0, 1.0, 2001)
        before = trapezoid(rest(every * most * (np.sign(strain.sum()) or 1.0)), every * most)
        ends = np.linspace(strain.min(), strain.max(), 4001)
        stored = cumulative_trapezoid(rest(ends), ends, initial=0.0)
        energy = np.interp(strain, ends, stored - np.interp(0.0, ends, stored))
        peak = np.maximum(np.maximum.accumulate(energy), abs(before))
        width = values["mullins_softening.energy_share"] * peak.max()
        stress = stress * (1.0 - softening * erf((peak - energy) / width))
    if share := get("viscoelasticity.share", 0.0):
        stress = stress - share * first_order(clock, stress, values["viscoelasticity.time_s"])
    return stress[places]


def yielded(strain, mean, hardening):
    """Strain that stress goes by, of many elements side by side that slide at strains of their own."""
    count = 2000
    slides = -mean * np.log1p(-(np.arange(count) + 0.5) / count)
    state, before, found = np.zeros(count), 0.0, []
    for e in strain:
        state = np.clip(state + (e - before), -slides, slides)
        found.append(hardening * e + (1.0 - hardening) * state.mean())
        before = e
    return np.array(found)


class Lattices(Coupons):
    """Blocks of slender struts of three scales, weighed, pressed along and across the layers."""

    kind = "lattice_compression"
    effects = (
        "overcure",
        "skin_cure",
        "strain_stiffening",
        "viscoelasticity",
        "mullins_softening",
        "rate_independent_hysteresis",
        "fatigue_drift",
        "temperature_drift",
        "anisotropy",
        "seating",
        "frame_compliance",
    )
    strut_mm = 1.5

    def plan(self, rng, dt):
        """The experiments, whose measured columns hold nothing yet."""
        press = loop(2 * dt, (0.1, 30), (0.0, 30), (0.2, 60), (0.0, 60))
        slow = loop(2 * dt, (0.2, 240), (0.0, 240))
        hold = loop(2 * dt, (0.15, 4), (0.15, 100), (0.05, 3), (0.05, 60))
        planned = [
            ("1.0x", "A", press, 1.0, {}),
            ("1.0x again", "A", press, 1.0, {}),
            ("0.75x", "B", slow, 0.75, {}),
            ("1.5x", "C", press, 1.5, {}),
            ("held", "D", hold, 1.0, {}),
            ("warm", "E", press, 1.0, {"temperature_C": 38.0}),
            ("across", "F", press, 1.0, {"axis": "x"}),
            ("1.5x slow", "G", slow, 1.5, {}),
            ("1.0x tall", "H", press, 1.0, {"length_mm": 60.0}),
            ("1.0x, third", "A", press, 1.0, {}),
        ]
        return [
            experiment(
                self.kind,
                {"time_s": t, "strain": e, self.channel: np.zeros(len(t))}
                | {c: np.ones(len(t)) for c in ("mass_g", "mass_sd_g")},
                name,
                specimen=specimen,
                scale=scale,
                **{
                    "temperature_C": 23.0,
                    "axis": "z",
                    "section_mm": (25.0 * scale, 25.0 * scale),
                    "length_mm": 25.0 * scale,
                }
                | how,
            )
            for name, specimen, (t, e), scale, how in planned
        ]

    def base(self, rng):
        """What is fitted in every model, as it truly is."""
        return {
            "lattice_modulus_kPa": float(np.exp(rng.uniform(math.log(8.0), math.log(60.0)))),
            "lattice_density_g_cm3": float(rng.uniform(0.1, 0.25)),
        }

    def reading(self, base):
        """What the instrument usually reads, of whose share the noise is drawn."""
        return 0.1 * base["lattice_modulus_kPa"]

    def law(self, e, values):
        """Stress of a strain at rest: struts that bend, which is of the fourth power of their thickness."""
        thick = self.strut_mm * e.scale
        grown = 1.0 + 2.0 * values.get("overcure.offset_mm", 0.0) / thick
        modulus = values["lattice_modulus_kPa"] * grown**4
        modulus *= 1.0 + 8.0 * values.get("skin_cure.excess_mm", 0.0) / thick
        closing = values.get("strain_stiffening.closing", 0.0)
        return lambda strain: modulus * strain / (1.0 - closing * strain)

    def observe(self, planned, values):
        """Stress (n,) and mass of every experiment."""
        found = super().observe(planned, values)
        for e, y in zip(planned, found, strict=True):
            grown = 1.0 + 2.0 * values.get("overcure.offset_mm", 0.0) / (self.strut_mm * e.scale)
            cm3 = 1e-3 * e.section_mm[0] * e.section_mm[1] * e.length_mm
            y["mass_g"] = np.full(len(e), values["lattice_density_g_cm3"] * cm3 * grown**2)
        return found


class Holds:
    """Chambers shut at three pressures."""

    kind, channel = "pressure_hold", "pressure_kPa"
    effects = ("leak", "viscoelasticity", "temperature_drift")
    shapes = (
        ("viscoelasticity.onset_s", 1.0, 10.0),
        ("temperature_drift.cooling_s", 10.0, 80.0),
        ("leak.inertia", 0.05, 1.0),
    )
    levels_kPa = (50.0, 150.0, 300.0)

    def plan(self, rng, dt):
        """The experiments, whose measured columns hold nothing yet."""
        t = np.arange(0.0, 400.0, 2.0 * dt)
        return [
            experiment(self.kind, {"time_s": t, self.channel: np.full(len(t), p)}, f"{p:g} kPa")
            for p in self.levels_kPa
        ]

    def base(self, rng):
        """What is fitted in every model, as it truly is."""
        found = {}
        for p in self.levels_kPa:
            found[f"initial_kPa of {p:g} kPa"] = p
            found[f"shut_s of {p:g} kPa"] = float(rng.uniform(0.0, 5.0))
        return found

    def reading(self, base):
        """What the instrument usually reads, of whose share the noise is drawn."""
        return 100.0

    def observe(self, planned, values):
        """Gauge pressure (n,) of every experiment."""
        return [{self.channel: self.emptied(e, values)} for e in planned]

    def emptied(self, e, values):
        """Gas, wall and warmth of a chamber as one system of differential equations, from its shutting."""
        get = values.get
        start = values[f"initial_kPa of {e.name}"] + ATMOSPHERE
        loss, inertia = get("leak.loss_per_s", 0.0), get("leak.inertia", 0.0)
        creep = 1e-3 * get("viscoelasticity.creep_per_MPa", 0.0)
        onset = get("viscoelasticity.onset_s", 1.0) * 10.0 ** np.arange(6)
        warmer, cools = get("temperature_drift.cooling_K", 0.0), get("temperature_drift.cooling_s", 30.0)

        def pressure(t, gas, crept):
            kelvin = 296.0 + warmer * np.exp(-t / cools)
            return start * gas * kelvin / (296.0 + warmer) / (1.0 + creep * crept.sum(axis=0))

        def slope(t, state):
            P = pressure(t, state[0], state[1:])
            drive = (P**2 - ATMOSPHERE**2) / (2.0 * ATMOSPHERE**2)
            # Pressure falls as flow plus inertia times its square.
            flow = 2.0 * drive / (1.0 + math.sqrt(1.0 + 4.0 * inertia * abs(drive)))
            return np.concatenate([[-loss * ATMOSPHERE / start * flow], (P - ATMOSPHERE - state[1:]) / onset])

        t = e["time_s"] - values[f"shut_s of {e.name}"]
        after = t > 0
        found = np.full(len(t), start)
        first = np.concatenate([[1.0], np.zeros(6)])
        way = solve_ivp(slope, (0.0, t[-1]), first, method="LSODA", t_eval=t[after], rtol=1e-8, atol=1e-10)
        found[after] = pressure(way.t, way.y[0], way.y[1:])
        return found - ATMOSPHERE


class Beams:
    """Cantilevers of three lengths and thicknesses under masses that are each hung on three times."""

    kind, channel = "beam_deadweight", "tip_deflection_mm"
    effects = ("gravity", "strain_stiffening", "frame_compliance")
    shapes = ()

    def plan(self, rng, dt):
        """The experiments, whose measured columns hold nothing yet."""
        planned = (
            ("thin", (20.0, 5.0), 60.0, 4.0),
            ("thick", (20.0, 15.0), 80.0, 60.0),
            ("long", (20.0, 10.0), 120.0, 6.0),
        )
        return [
            experiment(
                self.kind,
                {"added_mass_g": (m := np.repeat(np.linspace(0, most, 8), 3)), self.channel: 0 * m},
                name,
                section_mm=section,
                length_mm=length,
            )
            for name, section, length, most in planned
        ]

    def base(self, rng):
        """What is fitted in every model, as it truly is."""
        return {"beam_modulus_kPa": float(rng.uniform(400.0, 900.0)), "tilt_deg": float(rng.normal(0.0, 0.7))}

    def reading(self, base):
        """What the instrument usually reads, of whose share the noise is drawn."""
        return 5.0

    def observe(self, planned, values):
        """Sag (n,) of every experiment's tip."""
        return [{self.channel: self.sagged(e, values)} for e in planned]

    def sagged(self, e, values):
        """Slope and moment stepped from the clamp by Runge and Kutta, its moment shot for."""
        (width, h), length = e.section_mm, e.length_mm
        bending = 1e-3 * values["beam_modulus_kPa"] * width * h**3 / 12.0
        masses, row = np.unique(e["added_mass_g"], return_inverse=True)
        tip = 1e-3 * GRAVITY * masses * length**2 / bending
        kg = 1e-9 * values.get("gravity.density_kg_m3", 0.0) * width * h * length
        weight = GRAVITY * kg * length**2 / bending
        give = values.get("frame_compliance.mm_per_N", 0.0) / h**2 * bending / length
        stiffening = 0.9 * values.get("strain_stiffening.c2_over_c1", 0.0) * (h / length) ** 2
        tilt, steps = math.radians(values["tilt_deg"]), 80
        s, ds = np.linspace(0.0, 1.0, steps + 1), 1.0 / steps

        def curved(moment):
            k = moment
            for _ in range(30 if stiffening else 0):
                k = k - (k + stiffening * k**3 - moment) / (1.0 + 3.0 * stiffening * k**2)
            return k

        def along(moment):
            a, m = tilt + give * moment, moment.copy()
            slopes = [a]
            for at in s[:-1]:

                def rate(x, a, m):
                    return curved(m), -(tip + weight * (1.0 - x)) * np.cos(a)

                k1 = rate(at, a, m)
                k2 = rate(at + ds / 2, a + ds / 2 * k1[0], m + ds / 2 * k1[1])
                k3 = rate(at + ds / 2, a + ds / 2 * k2[0], m + ds / 2 * k2[1])
                k4 = rate(at + ds, a + ds * k3[0], m + ds * k3[1])
                a, m = (
                    v + ds / 6 * (p + 2 * q + 2 * r + t)
                    for v, p, q, r, t in zip((a, m), k1, k2, k3, k4, strict=True)
                )
                slopes.append(a)
            return np.array(slopes), m

        moment = (tip + weight / 2.0) * math.cos(tilt)
        other = 0.9 * moment - 1e-6
        left, others = along(moment)[1], along(other)[1]
        for _ in range(40):
            apart = left - others
            step = np.where(np.abs(apart) > 1e-15, left * (moment - other) / np.where(apart, apart, 1.0), 0.0)
            other, others = moment, left
            moment = moment - step
            slopes, left = along(moment)
            if np.abs(left).max() < 1e-12:
                break
        shear = h**2 / (4.0 * 15.0 / 17.5 * length**2)
        load = tip + weight * (1.0 - s[:, None])
        return length * simpson(np.sin(slopes) + shear * load * np.cos(slopes) ** 2, x=s, axis=0)[row]


class Waveguides:
    """Guides bent to and fro at two paces and at rest."""

    kind, channel = "waveguide_bending", "voltage_V"
    effects = ("led_drift", "ambient_light", "optical_nonlinearity", "clock_offset")
    shapes = (("optical_nonlinearity.onset_deg", 2.0, 30.0),)
    paces = (("slow", 61.0, 45.0, 50.0), ("fast", 13.0, 40.0, 45.0), ("small", 23.0, 10.0, 30.0))

    def angle(self, name, t):
        """Bending angle in deg at times t: from rest to rest, before the record began and after it too."""
        _, period, middle, reach = next(p for p in self.paces if p[0] == name)
        moving = np.clip(t - 3.0, 0.0, 290.0)
        return middle + reach * np.sin(2.0 * np.pi * moving / period)

    def plan(self, rng, dt):
        """The experiments, whose measured columns hold nothing yet."""
        t = np.arange(0.0, 300.0, dt)
        return [
            experiment(
                self.kind,
                {"time_s": t, "angle_deg": self.angle(name, t), self.channel: np.zeros(len(t))},
                name,
            )
            for name, *_ in self.paces
        ]

    def base(self, rng):
        """What is fitted in every model, as it truly is."""
        return {"straight_V": float(rng.uniform(0.5, 3.0)), "loss_per_deg": float(rng.uniform(0.004, 0.015))}

    def reading(self, base):
        """What the instrument usually reads, of whose share the noise is drawn."""
        return 0.5 * base["straight_V"]

    def observe(self, planned, values):
        """Voltage (n,) of every experiment: what is left after loss upon loss along the bend."""
        get, found = values.get, []
        onset = get("optical_nonlinearity.onset_deg", 0.0)
        for e in planned:
            t = e["time_s"]
            bent = self.angle(e.name, t - get("clock_offset.offset_s", 0.0))
            share = np.linspace(0.0, 1.0, 401)[:, None]
            # Loss a degree grows in proportion to the degrees beyond the onset.
            excess = 2.0 * get("optical_nonlinearity.excess", 0.0) / 90.0
            each = 1.0 + excess * np.maximum(np.abs(bent) * share - onset, 0.0)
            exponent = -values["loss_per_deg"] * bent * trapezoid(each, share, axis=0)
            hours = (t - t[0]) / 3600.0
            light = values["straight_V"] * np.exp(exponent) * np.exp(get("led_drift.per_hour", 0.0) * hours)
            found.append({self.channel: light + get("ambient_light.ambient_V", 0.0)})
        return found


BENCHES = {b.kind: b for b in (Coupons(), Lattices(), Holds(), Beams(), Waveguides())}


def with_channels(planned, observed):
    """The experiments with what was observed in their columns."""
    return [attrs.evolve(e, columns={**e.columns, **y}) for e, y in zip(planned, observed, strict=True)]
