"""What others measured on benches, and what the paper printed: fits by hand first, then the verdicts."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.evidence.diagnosis import diagnose, noise_of
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.lattice_fem import scalings
from mu_addon.evidence.prediction.beam_deadweight import BeamSag
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.prediction.lattice_compression import LatticeStress
from mu_addon.evidence.record import record
from mu_addon.evidence.sensitivity import best_seen, sensitivities
from mu_addon.evidence.simulator import Composite
from mu_addon.measured import read_folder

from .bench import recovered

REAL = Path(__file__).parents[1] / "data" / "real"
PAPER = Path(__file__).parents[2] / "assets" / "examples" / "paper-moduli"


def folder(name):
    experiments = read_folder(REAL / name).experiments
    return [e for e in experiments if e.role == "fit"], [e for e in experiments if e.role == "held_out"]


def rms(simulator, experiments, values):
    off = [e[simulator.channels(e)[0]] - simulator.predict(e, values)[0] for e in experiments]
    return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


def verdict(experiments):
    blocks = scalings(experiments, load_preset("mu-1.0x"))[0]
    return diagnose(experiments, Composite(bench_simulators(experiments, blocks)))


# The silicone beam, 30 x 30 x 100 mm of Dragon Skin 10 (1070 kg/m3 by its maker).


def test_its_weight_is_found_and_a_mass_not_seen_is_predicted():
    """902 kg/m3: 14 % too light, as if the beam had hung up by 0.6 deg when it was called straight."""
    fit, held = folder("silicone_beam")
    simulator = BeamSag()
    start = {"beam_modulus_kPa": 300.0, "gravity.density_kg_m3": 1000.0}
    found, sd, _ = recovered(simulator, fit, start, 0.05)
    assert found["gravity.density_kg_m3"] == pytest.approx(902, abs=10)
    assert sd["gravity.density_kg_m3"] < 25
    # Its two trials differ by 0.7 mm.
    assert rms(simulator, held, found) < 0.7

    def tilted(tilt):
        class Tilted(BeamSag):
            def predict(self, experiment, values):
                return super().predict(experiment, {**values, "tilt_deg": tilt})

        return recovered(Tilted(), fit, start, 0.05)[0]["gravity.density_kg_m3"]

    assert tilted(-0.7) > 1070 > 1050 > tilted(-0.5)


def test_what_is_known_of_clamps_limits_what_they_hide():
    """Two loads cannot tell a tilt from weight; a degree of it is worth some 240 kg/m3, four are seen."""
    fit, _ = folder("silicone_beam")

    def limit(spread):
        simulator = BeamSag()
        modulus, tilt = simulator.nuisances
        simulator.nuisances = (modulus, attrs.evolve(tilt, spread=spread))
        both = Composite({"beam_deadweight": simulator})
        made = record(fit, both)
        values = {"beam_modulus_kPa": 251.0, "gravity.density_kg_m3": 902.0}
        seen = sensitivities(Fitter(made, both, noise_of(made, both)), values)
        return best_seen(seen)["gravity"].limit

    assert limit(1.0) == pytest.approx(4 * 240, rel=0.1)
    assert limit(2.0) == pytest.approx(2 * limit(1.0), rel=0.05)
    assert limit(1e-3) < 150
    assert limit(np.inf) > 1e4


def test_a_tilted_clamp_would_do_as_well_were_it_plausible():
    fit, _ = folder("silicone_beam")
    start = {"beam_modulus_kPa": 300.0, "tilt_deg": 2.0}
    found, _, _ = recovered(BeamSag(), fit, start, 0.05)
    assert rms(BeamSag(), fit, found) < 0.05
    assert found["tilt_deg"] == pytest.approx(3.7, abs=0.1)


# A printed foam, compressed along x, y and z; the second run along z was not fitted.


def foam(start):
    fit, held = folder("printed_foam")
    simulator = LatticeStress([*fit, *held])
    found, _, _ = recovered(simulator, fit, {"lattice_modulus_kPa": 80.0, **start}, 0.05)
    return found, rms(simulator, fit, found), rms(simulator, held, found)


def test_the_foam_is_stiffer_in_its_layers_and_had_to_be_seated():
    axes = {"anisotropy.in_plane": 0.5}
    seat = {"seating.gap_mm": 1.0, "seating.preload_kPa": 1.0}
    _, alike, alike_held = foam({})
    _, by_axis, by_axis_held = foam(axes)
    found, both, both_held = foam(axes | seat)
    assert alike > 1.3
    assert alike_held > 1.3
    assert by_axis < 0.7
    assert both < 0.12
    # 1 % of the largest stress, on a run it has not seen.
    assert both_held < 0.07 < 0.4 < by_axis_held
    assert found["seating.preload_kPa"] == pytest.approx(1.2, abs=0.05)
    assert 1 + found["anisotropy.in_plane"] == pytest.approx(2.15, abs=0.05)


# Verdicts.


@pytest.mark.parametrize(
    "truth",
    [
        "overcure",
        pytest.param(
            "skin_cure",
            marks=pytest.mark.nightly("test_masses_end_the_ambiguity_between_struts_and_skin"),
        ),
    ],
)
def test_masses_end_the_ambiguity_between_struts_and_skin(truth):
    offset = 0.12 if truth == "overcure" else 0.0
    printed = scalings(read_folder(PAPER).experiments, load_preset("mu-1.0x"))[0]

    def weighed(e, noise):
        volume = np.prod(e.section_mm) * e.length_mm * 1e-3
        mass = 0.15 * volume * printed[e.name].mass(e.scale, offset) * (1 + noise)
        columns = {**e.columns, "mass_g": np.full(len(e), mass), "mass_sd_g": np.full(len(e), 0.01 * mass)}
        return attrs.evolve(e, columns=columns)

    noise = 0.01 * np.random.default_rng(1).normal(size=3)
    found = verdict([weighed(e, z) for e, z in zip(read_folder(PAPER).experiments, noise, strict=True)])
    assert found.names == (truth,)
    assert found.ambiguity.isdisjoint({"overcure", "skin_cure"} - {truth})


def test_the_verdict_on_the_printed_chamber():
    fit, _ = folder("chamber_printed_fdm")
    found = verdict(fit)
    # Of 648 kPa the leak leaves 2, yet not all of that is noise.
    assert [c.effect.name for c in found.selection.causes] == ["leak"]
    assert not found.selection.causes[0].rivals
    assert found.gain.fit.after < 0.005 * found.gain.fit.before
    assert found.sources["pressure_hold pressure"].white < 0.35
    assert found.sources["pressure_hold pressure"].slow < 2.0
    low, high = found.intervals["leak.loss_per_s"]
    assert 0.025 < low < high < 0.028
    # By so little that every fifth row may not tell; all of them do (1e-5).
    assert min(d.p_value for d in found.selection.table) < 1e-3
    written = found.as_json()
    assert [c["effect"] for c in written["causes"] + written["partly_explained_by"]] == ["leak"]
    assert bool(written["causes"]) == (found.kind == "named")


def test_the_verdict_on_the_rigid_blank_is_no_leak():
    """Gas that cools, a wall that creeps and a leak of 1e-5 a second drift alike over 150 s."""
    fit, _ = folder("chamber_control_aluminium")
    found = verdict(fit)
    assert found.kind != "named"
    assert found.names != ("leak",)


def test_the_verdict_on_the_beam():
    fit, held = folder("silicone_beam")
    found = verdict([*fit, *held])
    assert found.kind == "named"
    assert found.names == ("gravity",)
    # Without weight the clamp must have been turned by nearly four of its spreads, which does as well.
    assert found.selection.base.values["tilt_deg"] > 3.5
    assert found.gain.held_out.after < min(0.7, found.gain.held_out.before)
    # Its maker's density; a degree of tilt is worth 240 kg/m3.
    low, high = found.intervals["gravity.density_kg_m3"]
    assert low < 1070 < high
    assert 400 < high - 902 < 550
    low, high = found.intervals["tilt_deg"]
    assert (low, high) == pytest.approx((-1.96, 1.96), abs=0.05)


@pytest.mark.nightly("test_the_verdict_on_the_printed_chamber")
def test_the_verdict_on_the_foam_finds_direction_and_seating():
    fit, held = folder("printed_foam")
    found = verdict([*fit, *held])
    # They take most of the misfit, and something of the foam's own law is left.
    assert found.kind == "named"
    assert sorted(found.names) == ["anisotropy", "seating"]
    assert 0.95 < found.share_taken < 1.0
    assert found.selection.left
    assert found.gain.held_out.after < 0.1 * found.gain.held_out.before
