"""Models that have no prediction for some values: a diagnosis goes on, and says so."""

import attrs
import numpy as np
import pytest

from mu_addon.errors import ConvergenceError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import Effect, Parameter
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment

STRAIN = np.linspace(0.0, 0.1, 24)


class Moduli:
    """Compressed lattices of several scales: one modulus, times what brings a length, a time or a force."""

    nuisances = (Parameter("modulus_kPa", "kPa", 1.0, 1000.0, 20.0, (20.0,), "resin and lattice"),)
    effects = tuple(
        Effect(name, (Parameter(p, unit, 0.0, high, 0.0, (start,), "stand-in"),), ("lattice_compression",))
        for name, p, unit, high, start in (
            ("overcure", "offset_mm", "mm", 1.0, 0.1),
            ("skin_cure", "depth_share", "", 5.0, 0.3),
            ("frame_compliance", "share", "", 5.0, 0.3),
            ("seating", "gap_strain", "", 0.01, 0.001),
            ("anisotropy", "share", "", 1.0, 0.1),
        )
    )

    def channels(self, experiment):
        return ("stress_kPa",)

    def predict(self, experiment, values):
        s = experiment.scale
        modulus = values.get("modulus_kPa", 20.0)
        # Bending struts: to the fourth power of their diameter, 1.5 mm at scale 1.
        modulus *= (1.0 + values.get("overcure.offset_mm", 0.0) / (1.5 * s)) ** 4
        modulus *= 1.0 + values.get("skin_cure.depth_share", 0.0) / s
        modulus /= 1.0 + values.get("frame_compliance.share", 0.0) * s
        modulus *= 1.0 + values.get("anisotropy.share", 0.0) * (experiment.axis == "z")
        gap = values.get("seating.gap_strain", 0.0)
        return modulus * np.maximum(experiment["strain"] - gap, 0.0)[None]


class Buckling(Moduli):
    """Blocks that have no equilibrium once the frame is softer than `softest`."""

    def __init__(self, softest):
        self.softest = softest

    def predict(self, experiment, values):
        if values.get("frame_compliance.share", 0.0) > self.softest:
            raise ConvergenceError("no equilibrium of the block", experiment.name)
        return super().predict(experiment, values)


def blocks(**hidden):
    """Blocks of four scales as the stand-in's mechanics have them, with noise of 0.002 kPa."""
    rng = np.random.default_rng(1)
    values = {"modulus_kPa": 20.0} | {k.replace("__", "."): v for k, v in hidden.items()}
    found = []
    for scale in (0.75, 1.0, 1.5, 2.0):
        columns = {"time_s": 400.0 * STRAIN, "strain": STRAIN}
        e = experiment("lattice_compression", columns, f"{scale:g}x", scale=scale)
        stress = Moduli().predict(e, values)[0] + 0.002 * rng.normal(size=len(STRAIN))
        found.append(attrs.evolve(e, columns=columns | {"stress_kPa": stress}))
    return found


@pytest.mark.parametrize(
    ("softest", "refused"),
    # The fits of a frame's share begin at 0.3.
    [
        (0.0, {"frame_compliance": "no equilibrium of the block"}),
        (0.05, {"frame_compliance": "no equilibrium of the block"}),
        (0.31, {}),
    ],
    ids=["at no size", "at no start", "on the way"],
)
def test_a_rival_without_prediction_does_not_end_a_diagnosis(softest, refused):
    found = diagnose(blocks(overcure__offset_mm=0.1), Composite({"lattice_compression": Buckling(softest)}))
    assert "overcure" in found.names
    assert found.refused == refused
    assert np.isfinite(list(found.intervals.values())).all()
    computed = {f.effects[0].name for f in found.selection.singles}
    assert ("frame_compliance" in computed) == (not refused)


def test_a_base_model_without_prediction_is_an_error():
    class Never(Moduli):
        def predict(self, experiment, values):
            raise ConvergenceError("no equilibrium of the block", experiment.name)

    with pytest.raises(ConvergenceError, match="no equilibrium"):
        diagnose(blocks(), Composite({"lattice_compression": Never()}))


def test_a_size_is_not_followed_to_where_nothing_can_be_computed():
    """The truth lies beyond what has a prediction: the fit ends below it, and no verdict rests on it."""
    softest = 0.35
    simulator = Composite({"lattice_compression": Buckling(softest)})
    found = diagnose(blocks(frame_compliance__share=0.6), simulator)
    fits = {f.effects[0].name: f for f in found.selection.singles}
    assert fits["frame_compliance"].values["frame_compliance.share"] <= softest
    assert found.kind != "named" or found.names != ("frame_compliance",)


@pytest.mark.parametrize("every", [True, False], ids=["all of them", "one of two"])
def test_what_was_held_out_and_cannot_be_predicted_is_told_and_left_out(every):
    class Short(Moduli):
        """No prediction beyond a tenth of strain."""

        def predict(self, experiment, values):
            if experiment.columns["strain"].max() > 0.11:
                raise ConvergenceError("the block has no equilibrium at 20 % of strain", experiment.name)
            return super().predict(experiment, values)

    fitted = blocks(overcure__offset_mm=0.1)
    far = attrs.evolve(
        fitted[0], name="far", role="held_out", columns={**fitted[0].columns, "strain": 2.0 * STRAIN}
    )
    held = [far] if every else [far, attrs.evolve(fitted[1], name="near", role="held_out")]
    simulator = Composite({"lattice_compression": Short()})
    found = diagnose([*fitted, *held], simulator)
    alone = diagnose(fitted, Composite({"lattice_compression": Short()}))
    assert (found.kind, found.names) == (alone.kind, alone.names)
    assert found.gain.fit == alone.gain.fit
    [told] = found.set_aside
    assert "far was held out" in told
    assert "no equilibrium at 20 %" in told
    assert (found.gain.held_out is None) == every


def test_a_null_model_without_prediction_of_what_was_held_out_is_none():
    """Corrections without a meaning may ask for values that no block can have: there is no such null then."""

    class Fragile(Moduli):
        """A second nuisance before the modulus; what was held out has no equilibrium if it is stiffer."""

        nuisances = (Parameter("curvature", "", -1.0, 1.0, 0.0, (0.5,), "stand-in"), *Moduli.nuisances)

        def predict(self, experiment, values):
            # The base has 25.2 kPa; the null with permuted effects asks for 26.0.
            if experiment.name == "far" and values.get("modulus_kPa", 20.0) > 25.5:
                raise ConvergenceError("no equilibrium of the block", experiment.name)
            curved = 40.0 * values.get("curvature", 0.0) * experiment["strain"][None] ** 2
            return super().predict(experiment, values) + curved

    fitted = blocks(overcure__offset_mm=0.1)
    far = attrs.evolve(fitted[0], name="far", role="held_out")
    found = diagnose([*fitted, far], Composite({"lattice_compression": Fragile()}))
    assert "overcure" in found.names
    assert np.isfinite([found.gain.held_out.before, found.gain.held_out.after]).all()
    assert np.isfinite(found.gain.held_out.black_box)
    assert np.isnan(found.gain.held_out.permuted)
    assert not found.set_aside
