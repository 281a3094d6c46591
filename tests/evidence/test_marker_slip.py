"""A marker that slips at one moment is named with its size and moment; what moves otherwise is not."""

import math

import attrs
import numpy as np
import pytest
from scipy.integrate import trapezoid

from mu_addon.diagnose.words import sentence, to_do
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import SLIP
from mu_addon.evidence.effect import offered as laws
from mu_addon.evidence.effects.declaration import Data
from mu_addon.evidence.effects.marker_slip import Recordings, searched
from mu_addon.evidence.extended import extended_model
from mu_addon.evidence.hypotheses import by_search
from tests.evidence import analytic, bench

DT = 0.4
SHARE = 0.37
KEY = "marker_slip.marker2_"


def folder(
    seed, moved=lambda e, y, clock, total: y, white=0.05, slow=0.0, specimens="A", truth=None, dt=DT, many=4
):
    """Some records of the written unit; `moved` changes channels (7, n) by the clock of all records, in s."""
    rng, truth = np.random.default_rng(seed), {"modulus_factor": 1.05} | (truth or {})
    zero = dict.fromkeys(analytic.CHANNELS, 0.0)
    bare = [
        analytic.experiment(
            name,
            t,
            p,
            {c: v + 0.0 * t for c, v in zero.items()},
            **more,
            specimen=specimens[k % len(specimens)],
        )
        for k, (name, t, p, more) in enumerate(analytic.protocols(dt, many))
    ]
    model, found, before = analytic.simulator(bare), [], 0.0
    total = sum(float(e["time_s"][-1]) for e in bare)
    for e in bare:
        y = moved(e, np.array(model.predict(e, truth)), before + e["time_s"], total)
        before += float(e["time_s"][-1])
        noise = [(3.0 if c == "angle_deg" else 1.0) for c in analytic.CHANNELS]
        observed = {
            c: v + analytic.coloured(rng, e["time_s"], k * white, k * slow, 4.0)
            for c, v, k in zip(analytic.CHANNELS, y, noise, strict=True)
        }
        found.append(attrs.evolve(e, columns=e.columns | observed))
    return found


def slip(mm, degrees=26.0, share=SHARE, specimen="A"):
    """The second marker slips, of one specimen, on a surface along the line from the first to the third."""

    def moved(e, y, clock, total):
        after = (clock >= share * total) & (e.specimen == specimen)
        way = math.radians(degrees) - np.arctan2(y[5] - y[1], y[6] - y[2])
        y[3] += mm * np.cos(way) * after
        y[4] += mm * np.sin(way) * after
        return y

    return moved


def judged(experiments):
    return diagnose(experiments, analytic.simulator(experiments))


def when(experiments, share=SHARE):
    """Record, its own time in s of the last sample before a moment, and of the first one after it."""
    total, before = sum(float(e["time_s"][-1]) for e in experiments), 0.0
    for e in experiments:
        t = e["time_s"]
        after = before + t >= share * total
        if after.any():
            k = int(np.argmax(after))
            return e.name, float(t[k - 1]), float(t[k])
        before += float(t[-1])
    raise AssertionError


NIGHTLY = pytest.mark.nightly("test_a_slip_of_a_third_of_a_millimetre_is_named_with_size_way_and_moment")


@pytest.mark.parametrize(
    "slow", [0.05, pytest.param(0.0, marks=NIGHTLY)], ids=["slow noise too", "white noise"]
)
def test_a_slip_of_a_third_of_a_millimetre_is_named_with_size_way_and_moment(slow):
    made = folder(1, slip(0.3), slow=slow)
    found = judged(made)
    assert (found.kind, found.names) == ("named", (SLIP,))
    for key, true in ((f"{KEY}mm", 0.3), (f"{KEY}direction_deg", 26.0)):
        low, high = found.intervals[key]
        assert low < true < high
    assert found.intervals[f"{KEY}mm"][1] - found.intervals[f"{KEY}mm"][0] < 0.15
    name, last, first = when(made)
    moment = found.selection.chosen.values[f"{KEY}moment_s"]
    record, second = Recordings(made).place(moment)
    assert (record.name, last < second < first) == (name, True)
    low, high = (second + v - moment for v in found.intervals[f"{KEY}moment_s"])
    # Between two samples no record tells when.
    assert low - DT / 2 < last
    assert first < high + DT / 2
    assert high - low < 4.0 * DT
    _, words = sentence(found)
    assert "Marker 2 slips" in words
    assert f"in {name} at {second:.4g} s" in words
    assert "leave this marker out" in to_do(found).lower()
    # Other records start from where the marker sits now.
    assert SLIP not in extended_model(found).effects


@pytest.mark.nightly("test_a_slip_of_a_third_of_a_millimetre_is_named_with_size_way_and_moment")
def test_a_slip_beside_a_thicker_wall_is_named_with_it():
    found = judged(folder(2, slip(0.3), truth={"wall_thickness.change_mm": 0.06}, dt=0.6))
    assert (found.kind, set(found.names)) == ("named", {SLIP, "wall_thickness"})


@pytest.mark.parametrize(
    "seeds",
    [
        ((3, 0.0), (5, 0.08)),
        pytest.param(((4, 0.0), (6, 0.08)), marks=pytest.mark.nightly("test_without_a_slip_none_is_found")),
    ],
)
def test_without_a_slip_none_is_found(seeds):
    for seed, slow in seeds:
        assert judged(folder(seed, slow=slow)).kind == "none"


@pytest.mark.nightly("test_a_slip_of_a_third_of_a_millimetre_is_named_with_size_way_and_moment")
def test_a_slip_on_one_of_two_specimens_leaves_the_other_s_marker_where_it_was():
    found = judged(folder(7, slip(0.3, share=0.1), specimens="AB"))
    assert (found.kind, found.names) == ("named", (SLIP,))
    low, high = found.intervals[f"{KEY}mm"]
    assert low < 0.3 < high


@pytest.mark.parametrize(
    "what",
    [
        "a camera that was bumped",
        pytest.param(
            "a torn chamber", marks=pytest.mark.nightly("test_what_moves_more_than_one_marker_is_no_slip")
        ),
    ],
)
def test_what_moves_more_than_one_marker_is_no_slip(what):
    def moved(e, y, clock, total):
        after = clock >= SHARE * total
        if what.startswith("a camera"):
            y[[1, 3, 5]] += 0.3 * after
            y[[2, 4, 6]] += 0.15 * after
            return y
        torn = analytic.channels(e["pressure_kPa"] / 1.05, {"clogged_chamber": 0.1})
        return np.where(after, torn, y)

    found = judged(folder(8, moved, dt=0.6, many=2))
    assert found.kind == "unexplained" or (found.kind == "ambiguous" and len(found.ambiguity) > 1)


def test_before_its_moment_a_slip_shows_nothing_and_after_it_all():
    made = folder(9, specimens="AAB")
    records = Recordings(made)
    moment = records.moment(made[1].name, 40)
    share = records.share(made[1], moment)
    np.testing.assert_array_equal(share, np.arange(len(share)) >= 40)
    assert [float(records.share(e, moment)) for e in (made[0], made[2], made[3])] == [0.0, 0.0, 1.0]
    # Half a sample later the first sample after it shows half of it, so that a moment has a derivative.
    later = records.share(made[1], moment + DT / 2)
    assert (later[39], later[40], later[41]) == (0.0, pytest.approx(0.5), 1.0)
    place, second = records.place(moment)
    assert (place.name, second) == (made[1].name, pytest.approx(made[1]["time_s"][40] - DT / 2))
    # A denser clock of the same record is the ramp's, not a steeper one's.
    t = made[1]["time_s"]
    dense = np.linspace(t[0], t[-1], 4 * (len(t) - 1) + 1)
    fine = attrs.evolve(
        made[1],
        columns={c: np.interp(dense, t, v) for c, v in made[1].columns.items()},
        rows=np.arange(dense.size),
    )
    np.testing.assert_allclose(records.share(fine, moment + DT / 2)[::4], later, atol=1e-9)


def slipped(channels, y, rest, experiment, recordings, values):
    setting = {"channels": channels, "rest": rest, "experiment": experiment, "recordings": recordings}
    return bench.acted("unit_pressure", y, values, "surface", **setting)


def test_a_slip_of_nothing_leaves_every_reading_as_it_is():
    made = folder(10)
    y = np.arange(7.0 * len(made[0])).reshape(7, -1)
    values = {f"{KEY}mm": 0.0, f"{KEY}direction_deg": 30.0, f"{KEY}moment_s": 3.0}
    assert slipped(analytic.CHANNELS, y, y[:, 0], made[0], Recordings(made), values) is y


def test_a_displacement_turns_with_the_arc_that_its_marker_sits_on():
    made, angle = folder(10), np.radians([0.0, 30.0, -50.0])
    # Arcs of 50 mm to the marker, by where they end.
    s = np.linspace(0.0, 50.0, 50001)
    places = [trapezoid([np.sin(a * s / 50.0), np.cos(a * s / 50.0)], s, axis=1) for a in angle]
    y = np.zeros((7, 3))
    y[3:5] = np.transpose(places)
    e = attrs.evolve(made[3], columns={c: v[:3] for c, v in made[3].columns.items()}, rows=made[3].rows[:3])
    values = {f"{KEY}mm": 2.0, f"{KEY}direction_deg": 90.0, f"{KEY}moment_s": 0.0}
    changed = slipped(analytic.CHANNELS, y, np.zeros(7), e, Recordings(made), values) - y
    # What was along the axis is along the tip of its arc.
    np.testing.assert_allclose(changed[3:5], 2.0 * np.stack([np.sin(angle), np.cos(angle)]), atol=1e-6)
    assert not changed[[0, 1, 2, 5, 6]].any()


def without(experiments, *columns):
    return [
        attrs.evolve(e, columns={c: v for c, v in e.columns.items() if not c.startswith(columns)})
        for e in experiments
    ]


def offered(experiments, channels=analytic.CHANNELS):
    data = Data(kind="unit_pressure", experiments=experiments, channels=channels)
    return [e for e in laws(data) if e.name == SLIP]


def test_one_marker_alone_or_an_angle_alone_cannot_be_told_from_a_camera_that_moved():
    made = folder(11, slip(0.3))
    assert not offered(without(made, "marker1", "marker3"))
    assert not offered(without(made, "marker"))
    assert offered(without(made, "marker1", "angle"))
    # What the model does not predict is not offered either.
    assert not offered(made, ("angle_deg",))


def test_a_marker_seen_along_one_axis_has_a_signed_slip():
    made = without(folder(12, slip(-0.4, 0.0)), "marker2_z")
    effect = offered(made)[0]
    assert [p.name for p in effect.parameters] == ["marker2_y_mm", "marker2_moment_s"]
    assert effect.parameters[0].starts[0] == pytest.approx(-0.4, abs=0.05)
    values = {effect.keys[0]: -0.4, effect.keys[1]: effect.parameters[1].starts[0]}
    y = np.zeros((7, len(made[1])))
    changed = slipped(analytic.CHANNELS, y, y[:, 0], made[1], Recordings(made), values)
    assert changed[3].min() == -0.4
    assert not np.delete(changed, 3, axis=0).any()


def test_the_search_finds_the_sample_among_readings_that_stand_alone():
    made, rng = [], np.random.default_rng(0)
    for e in folder(13, slip(0.3), slow=0.05):
        columns = dict(e.columns)
        for c in analytic.CHANNELS[1:]:
            columns[c] = columns[c] + 2.0 * np.isin(np.arange(len(e)), rng.integers(0, len(e), 2))
        made.append(attrs.evolve(e, columns=columns))
    best = max(searched(Recordings(made)), key=lambda s: s.gain)
    name, last, first = when(made)
    record, second = Recordings(made).place(best.moment_s)
    assert (best.marker, record.name) == (2, name)
    assert last < second < first
    assert math.hypot(best.step_mm[0] - 0.27, best.step_mm[1] - 0.13) < 0.08


def test_the_best_of_so_many_moments_pays_for_them():
    made = folder(14)
    effects = offered(made)
    samples = sum(len(e) for e in made)
    # In noise alone the best marker, and no other.
    assert len(effects) == 1
    assert 2.0 * samples < effects[0].tried <= 3.0 * samples
    simulator = analytic.simulator(made)
    fit = judged(made).selection.base
    paid = by_search(attrs.evolve(fit, effects=tuple(effects)))
    assert paid == pytest.approx(2.0 * math.log(effects[0].tried))
    assert by_search(fit) == 0.0
    assert effects[0].keys in [e.keys for e in simulator.effects]
