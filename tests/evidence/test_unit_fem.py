"""The unit's simulated responses: exact at nulls, kept and found again, right in sign; its markers."""

from types import SimpleNamespace
from unittest import mock

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import ConvergenceError, InputError
from mu_addon.evidence import unit_fem
from mu_addon.evidence.effects import ON_UNITS
from mu_addon.evidence.effects import STATIC as EFFECTS
from mu_addon.evidence.markers import attached, material_points, nearest
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.unit_body import Body, down
from mu_addon.evidence.unit_fem import UnitResponseWarning, unit_responses
from mu_addon.evidence.unit_plan import UnitPlan
from mu_addon.evidence.unit_run import Result, Run, _from_beside, _states, run
from mu_addon.evidence.unit_settings import UnitSettings, pressures
from mu_addon.fem.clogged import CloggedModel
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.unit_materials import materials_of
from mu_addon.measured.pose import X, at_rest
from mu_addon.meshing.settings import MeshSettings
from tests.evidence import analytic
from tests.evidence.hollow_finger import UNIT, finger, in_place_of_units

ROUGH, FINER = MeshSettings(refine=0.35), MeshSettings(refine=0.5)
QUICK = UnitSettings(
    ROUGH,
    ROUGH,
    pressures=6,
    effects=("gravity", "wall_thickness"),
    whole=None,
    self_contact=False,
    workers=1,
)
# On the side, off its middle plane; and on the tip.
MARKERS = {1: (7.5, 3.0, 40.0), 2: (0.0, 6.0, 75.0)}
TIME, PRESSURE = analytic.triangle(0.5, 10.0, 1, -10.0, 20.0)


def bench(name="one", markers=MARKERS, pressure=PRESSURE, angle=True, axes="xyz", **more):
    """An experiment with markers at rest, or nearly."""
    n = len(pressure)
    columns = {"angle_deg": np.zeros(n)} if angle else {}
    for number, place in markers.items():
        for a, x in zip("xyz", place, strict=True):
            if a in axes:
                columns[f"marker{number}_{a}_mm"] = np.full(n, float(x))
    return analytic.experiment(name, np.arange(n) * 0.5, pressure, columns, **more)


@pytest.fixture(scope="module", autouse=True)
def fingers():
    with in_place_of_units():
        yield


@pytest.fixture(scope="module")
def mesh():
    return finger(UNIT, ROUGH)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


TURNS = (0.0, 90.0, 180.0, 270.0)


@pytest.fixture(scope="module")
def responses(cache):
    tests = [bench(f"at {turn:g}", orientation_deg=turn) for turn in TURNS]
    return unit_responses(UNIT, tests, QUICK, cache)


def test_there_is_one_response_an_orientation_and_the_simulator_takes_them(responses):
    assert [(r.scale, r.orientation_deg) for r in responses] == [(1.0, t) for t in TURNS]
    one = responses[0]
    assert one.channels == ("angle_deg", *(f"marker{m}_{a}_mm" for m in (1, 2) for a in "xyz"))
    assert one.pressures_kPa[0] < PRESSURE.min() < PRESSURE.max() < one.pressures_kPa[-1]
    level = bench(orientation_deg=-270.0)
    unit = UnitPressure(responses, [level])
    assert {"gravity", "wall_thickness"} <= {e.name for e in unit.effects}
    y = unit.predict(level, {"gravity.density_kg_m3": 1000.0})
    assert y.shape == (7, len(PRESSURE))
    assert np.isfinite(y).all()


def test_at_its_null_a_variant_is_the_base_and_at_rest_the_base_is_as_drawn(responses):
    for r in responses:
        for v in r.variants.values():
            np.testing.assert_array_equal(v.values[list(v.at).index(v.parameter.null)], r.values)
        rest = r.values[:, list(r.pressures_kPa).index(0.0)]
        np.testing.assert_array_equal(rest, [0.0, *MARKERS[1], *MARKERS[2]])


def test_pressure_bends_the_unit_to_the_side_with_more_lattice(responses):
    # Under the largest suction the finger's thin wall has snapped.
    (r, *_), steady = responses, responses[0].pressures_kPa > -5.0
    assert (np.diff(r.values[0][steady]) > 0).all()
    assert (np.diff(r.values[r.channels.index("marker2_y_mm")][steady]) > 0).all()


def test_things_fall_downward(responses):
    hanging, level, standing, other = responses
    at = list(hanging.pressures_kPa).index(0.0)

    def sag(r, size=-1):
        """Moves of the tip's marker (x, y, z) and turn of the tip, unpressed, by the densest resin."""
        moved = (r.variants["gravity"].values[size] - r.values)[:, at]
        return moved[4:7], moved[0]

    assert sag(hanging)[0][2] > 0 > sag(standing)[0][2]
    assert sag(level)[0][1] < 0 < sag(other)[0][1]
    assert sag(level)[1] < 0 < sag(other)[1]
    # Weight along the axis stretches; across it, it bends, much further.
    assert abs(sag(level)[0][1]) > 5 * abs(sag(hanging)[0][2])
    assert sag(hanging)[0][2] == pytest.approx(-sag(standing)[0][2], rel=0.1)
    assert sag(level)[0][1] == pytest.approx(-sag(other)[0][1], rel=0.05)
    # Nearly in proportion to the weight.
    ratio = np.divide(*level.variants["gravity"].at[[2, 1]])
    assert sag(level)[0][1] == pytest.approx(ratio * sag(level, 1)[0][1], rel=0.05)
    np.testing.assert_allclose(sag(hanging)[0][0], 0.0, atol=1e-9)


def test_down_is_z_turned_about_x():
    np.testing.assert_allclose(down(0.0), [0, 0, 1])
    np.testing.assert_allclose(down(90.0), [0, -1, 0], atol=1e-15)
    np.testing.assert_allclose(down(180.0), [0, 0, -1], atol=1e-15)


def test_moduli_scaled_alike_are_the_pressure_scaled():
    m = UNIT.material
    stiffer = attrs.evolve(
        UNIT,
        material=attrs.evolve(
            m,
            membrane_modulus_kPa=1.2 * m.membrane_modulus_kPa,
        ),
    )
    at = (-12.0, -5.0, 0.0, 8.0, 16.0, 24.0)
    points = (MARKERS[1],)
    found = run(Run(Body(stiffer, ROUGH), at, points)).values
    expected = run(Run(Body(UNIT, ROUGH), tuple(p / 1.2 for p in at), points)).values
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


def test_what_was_run_is_found_again(responses, cache, monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("ran again")

    reports = []
    with monkeypatch.context() as patch:
        patch.setattr(unit_fem, "run", refuse)
        again = unit_responses(UNIT, [bench(orientation_deg=90.0)], QUICK, cache)
        np.testing.assert_array_equal(again[0].values, responses[1].values)
        for name, v in responses[1].variants.items():
            np.testing.assert_array_equal(again[0].variants[name].values, v.values)
        with pytest.raises(AssertionError, match="ran again"):
            unit_responses(UNIT, [bench(orientation_deg=45.0)], QUICK, cache)
    # A damaged entry is missing: one run is done again, with the same result.
    at = pressures(PRESSURE, QUICK.pressures, QUICK.margin)
    base = Run(Body(UNIT, ROUGH), at, tuple(MARKERS.values()), outline=True)
    path = cache / f"unit-{base.key()}.npz"
    path.write_bytes(path.read_bytes()[:-40])
    one = unit_responses(UNIT, [bench()], QUICK, cache, lambda stage, share: reports.append((stage, share)))
    np.testing.assert_array_equal(one[0].values, responses[0].values)
    assert [t for t in reports if t[0].startswith("unit")] == [("unit, base", 1.0)]
    assert any("marker 1 at 1x lies 0.00 mm" in stage for stage, _ in reports)


def test_what_changes_a_result_changes_its_key():
    base = Run(Body(UNIT, ROUGH), (-5.0, 0.0, 5.0))
    others = [
        attrs.evolve(base, pressures_kPa=(-5.0, 0.0, 6.0)),
        attrs.evolve(base, points=(MARKERS[1],)),
        attrs.evolve(base, effect="gravity", size=1000.0),
        attrs.evolve(base, effect="gravity", size=1000.0, body=attrs.evolve(base.body, orientation_deg=90.0)),
        *(attrs.evolve(base, effect=name, size=e.sizes[-1]) for name, e in EFFECTS.items()),
    ]
    keys = {base.key(), *(r.key() for r in others)}
    assert len(keys) == len(others) + 1
    assert base.key() != attrs.evolve(base, body=Body(UNIT, FINER)).key()
    # Pressure alone does not know which way is down.
    assert attrs.evolve(base, body=attrs.evolve(base.body, orientation_deg=90.0)).key() == base.key()


def test_units_of_all_scales_share_their_runs():
    """The bound at each scale is reached by sizes of one list, the one beyond it being the last."""
    for e in EFFECTS.values():
        every = (*e.sizes, *e.larger)
        for enlarged in (0.75, 1.0, 1.5, 2.0):
            sizes = e.sizes_at(enlarged)
            assert sizes == every[: len(sizes)]
            needed = e.parameter.high / enlarged**e.length
            assert e.length == 0 or sizes[-1] >= 0.97 * needed
            assert all(s < needed for s in sizes[:-1])
    assert EFFECTS["overcure"].sizes_at(0.75)[-1] == 0.34
    assert EFFECTS["overcure"].sizes_at(1.5) == (0.0, 0.06, 0.14, 0.25)
    assert EFFECTS["gravity"].sizes_at(1.5) == (0.0, 1300.0, 4000.0, 6000.0)


AT = (-10.0, 0.0, 10.0, 20.0)


@pytest.fixture(scope="module")
def angle():
    return run(Run(Body(UNIT, ROUGH), AT)).values[0]


STIFFER = [name for name in EFFECTS if name != "gravity"]


GROWS = pytest.mark.nightly("test_an_effect_grows_from_nothing_and_the_right_way")


@pytest.mark.parametrize(
    "name", [n if n == "strain_stiffening" else pytest.param(n, marks=GROWS) for n in STIFFER]
)
def test_an_effect_grows_from_nothing_and_the_right_way(name, angle):
    e = EFFECTS[name]
    body = Body(UNIT, ROUGH)
    far = run(Run(body, AT, (), name, e.sizes[-1])).values[0] - angle
    assert (far[2:] < 0).all(), "the unit bends less under pressure"
    sizes = [s for s in (e.parameter.null + 1e-4, e.parameter.null - 1e-4) if s >= e.sizes[0]]
    for size in sizes:
        near = run(Run(body, AT, (), name, size)).values[0] - angle
        assert 0 < np.abs(near).max() < 1e-3 * np.abs(angle).max()
        assert np.sign(near[3]) == -np.sign(size - e.parameter.null)


def test_what_cannot_be_computed_is_left_out_and_said(monkeypatch):
    e = EFFECTS["wall_thickness"]
    # A wall of 9 mm has no room in a bladder of 12.5 mm.
    broken = attrs.evolve(e, parameter=attrs.evolve(e.parameter, high=20.0), sizes=(0.9, 1.0, 10.0))
    monkeypatch.setitem(ON_UNITS, "wall_thickness", broken)
    quick = attrs.evolve(QUICK, effects=("wall_thickness",))
    with pytest.warns(UnitResponseWarning, match="wall_thickness = 10 at 1x is left out"):
        (r,) = unit_responses(UNIT, [bench(markers={})], quick)
    np.testing.assert_array_equal(r.variants["wall_thickness"].at, [0.9, 1.0])
    # What it would do there is not guessed either.
    (effect,) = (e for e in UnitPressure([r]).effects if e.name == "wall_thickness")
    assert effect.parameters[0].low < 0.9
    assert effect.parameters[0].high == 1.0
    monkeypatch.setitem(ON_UNITS, "wall_thickness", attrs.evolve(broken, sizes=(1.0, 10.0)))
    with pytest.warns(UnitResponseWarning):
        (r,) = unit_responses(UNIT, [bench(markers={})], quick)
    assert "wall_thickness" not in r.variants


def test_pressures_out_of_reach_are_named():
    soft = attrs.evolve(UNIT, material=attrs.evolve(UNIT.material, membrane_modulus_kPa=10.0))
    with pytest.raises(ConvergenceError, match="too few of the measured pressures"):
        unit_responses(soft, [bench(markers={}, pressure=100 * PRESSURE)], attrs.evolve(QUICK, effects=()))


@settings(max_examples=200)
@given(st.floats(-90, 90), st.floats(0.5, 90), st.integers(5, 20))
def test_pressures_span_the_readings_with_rest_among_them(low, width, count):
    found = np.array(pressures(np.array([low, low + width]), count, 0.05))
    assert len(found) == count
    assert (np.diff(found) > 0).all()
    assert 0.0 in found
    # Two digits: ends may be rounded inward by half of the second.
    assert found[0] <= min(0.0, low) + 0.05 * abs(low)
    assert found[-1] >= max(0.0, low + width) - 0.05 * abs(low + width)


def test_scales_and_kinds_are_told_apart():
    tests = [bench(markers={}), bench("small", {}, scale=0.75), bench("hold", {})]
    tests[2] = attrs.evolve(tests[2], kind="pressure_hold")
    found = unit_responses(UNIT, tests, attrs.evolve(QUICK, effects=()))
    assert [r.scale for r in found] == [0.75, 1.0]
    # Proportional scaling has no length of its own: the same angle.
    np.testing.assert_allclose(found[0].values, found[1].values, rtol=1e-6)
    assert unit_responses(UNIT, tests[2:], QUICK) == ()


def test_bad_orders_are_refused():
    with pytest.raises(InputError, match="viscosity"):
        UnitSettings(effects=("viscosity",))
    with pytest.raises(InputError, match="too few"):
        UnitSettings(workers=0)
    with pytest.raises(InputError, match="added mass"):
        unit_responses(UNIT, [bench(added_mass_g=5.0)], QUICK)
    with pytest.raises(InputError, match="the pressure is always 0"):
        unit_responses(UNIT, [bench(pressure=0 * PRESSURE)], QUICK)


# Markers


def test_a_marker_sits_on_the_nearest_point_of_the_unit(mesh):
    places = {1: (7.5 + 1.0, 3.0, 40.0), 2: (-5.0, 7.5 + 0.5, 30.0), 3: (2.0, 6.0, 50.0)}
    found = {m.number: m for m in attached(mesh, [bench(markers=places)], 4.0)}
    np.testing.assert_allclose(found[1].point, [7.5, 3.0, 40.0], atol=1e-9)
    assert found[1].distance_mm == pytest.approx(1.0)
    np.testing.assert_allclose(found[2].point, [-5.0, 7.5, 30.0], atol=1e-9)
    # Inside the body it is where it is.
    np.testing.assert_array_equal(found[3].point, places[3])
    assert found[3].distance_mm == 0.0
    # Within the air of a chamber it is on its wall, the nearest one.
    wall = nearest(mesh, np.array([0.0, 0.0, 31.25]))
    nodes = mesh.nodes[np.unique(mesh.cavity)]
    assert np.linalg.norm(wall - [0, 0, 31.25]) <= np.linalg.norm(nodes - [0, 0, 31.25], axis=1).min() + 1e-9


def test_a_marker_across_the_mirror_moves_like_its_image(mesh):
    u = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    one, other = material_points(mesh, np.array([[5.0, 6.0, 40.0], [-5.0, 6.0, 40.0]])).at(u)
    np.testing.assert_allclose(other, one * [-1, 1, 1])


def test_without_x_a_marker_lies_in_the_mirror_plane(mesh):
    (m,) = attached(mesh, [bench(markers={4: (5.0, 6.0, 40.0)}, axes="yz")], 4.0)
    np.testing.assert_array_equal(m.point, [0.0, 6.0, 40.0])
    assert m.axes == "yz"
    with pytest.raises(InputError, match="marker 4 lacks its y or z"):
        attached(mesh, [bench(markers={4: (5.0, 6.0, 40.0)}, axes="xy")], 4.0)


def markers_of(experiment):
    """Where the markers of an experiment at 1.0x sit on the unit."""
    return UnitPlan.of(UNIT, [experiment], 1.0, None, UnitSettings(), None, {}).markers


def test_a_marker_off_the_unit_is_named():
    with pytest.raises(InputError, match=r"marker 3 lies 11\.2 mm from the unit") as error:
        markers_of(bench("bad camera", {1: MARKERS[1], 3: (18.7, 3.0, 40.0)}))
    assert error.value.where == "bad camera"
    assert [m.number for m in markers_of(bench())] == [1, 2]


def test_a_marker_on_two_places_is_named(mesh):
    moved = bench("second", {1: (7.5, 3.0, 50.0)})
    with pytest.raises(InputError, match=r"marker 1 sits 10\.0 mm from where one has it"):
        attached(mesh, [bench(), moved], 4.0)


def test_rest_is_looked_for_where_there_is_no_pressure():
    p = np.concatenate([np.full(10, 15.0), np.zeros(10), np.full(10, 20.0)])
    e = bench(markers={1: (18.0, 10.0, 40.0)}, pressure=p)
    y = 10.0 + p
    e = attrs.evolve(e, columns={**e.columns, "marker1_y_mm": np.where(np.arange(30) == 11, np.nan, y)})
    np.testing.assert_allclose(at_rest([e])[1][1], [18.0, 10.0, 40.0])
    pressed = attrs.evolve(
        e,
        name="pressed",
        columns={c: v[20:] + (np.arange(10) if "p" in c else 0.0) for c, v in e.columns.items()},
    )
    with pytest.raises(InputError, match="marker 1 is never visible at rest"):
        at_rest([pressed])
    assert at_rest([pressed, e])[1][2] == e.name


# The clog


def test_a_clogged_body_has_the_potential_of_its_residual(mesh):
    m = mesh
    model = CloggedModel(m, 50.0, 0.7, threads=1)
    plain = Model(m, threads=1)
    data = model.parameters(materials_of(UNIT, m))
    rng = np.random.default_rng(1)
    u, way = (0.02 * rng.standard_normal(m.nodes.shape) for _ in range(2))
    for axis in m.symmetry:
        u[m.symmetry_nodes(axis), "xyz".index(axis)] = 0.0
        way[m.symmetry_nodes(axis), "xyz".index(axis)] = 0.0
    p, h = 0.03, 1e-3
    slope = (model.potential(u + h * way, p, data) - model.potential(u - h * way, p, data)) / (2 * h)
    residual = model.residual(u, p, data)
    assert slope == pytest.approx(float((residual * way).sum()), rel=1e-6)
    # Each closed part is in balance under its own pressure.
    added = residual - plain.residual(u, p, data)
    assert np.abs(added).max() > 1e-3
    np.testing.assert_allclose(added.sum(axis=0)[1:], 0.0, atol=1e-12)
    # The two parts of the cavity are the whole.
    whole = plain.cavity_volume(u)
    beyond = model.volume_beyond(u)
    assert 0.2 * whole < beyond < 0.45 * whole


def test_nothing_lost_is_no_clog_and_all_lost_leaves_the_rest(mesh):
    data = (whole := Model(mesh, threads=1)).parameters(materials_of(UNIT, mesh))
    u = 0.01 * np.random.default_rng(2).standard_normal(mesh.nodes.shape)
    none = CloggedModel(mesh, 62.5, 0.0, threads=1)
    np.testing.assert_array_equal(none.residual(u, 0.01, data), whole.residual(u, 0.01, data))
    np.testing.assert_array_equal(none.tangent(u, 0.01, data), whole.tangent(u, 0.01, data))
    with pytest.raises(InputError, match="no cavity is cut"):
        CloggedModel(mesh, 99.0, 0.5)
    # Behind a clog before the last chambers only the weight of what is before it is felt.
    one, three = (
        run(Run(Body(UNIT, ROUGH, distal=k), (0.0, 10.0), (), "clogged_chamber", 1.0)).values[0, 1]
        for k in (1, 3)
    )
    base = run(Run(Body(UNIT, ROUGH), (0.0, 10.0))).values[0, 1]
    assert 0.2 * base < three < one < base


def test_a_clogged_tangent_is_near_that_of_its_residual(mesh):
    m = mesh
    model = CloggedModel(m, 50.0, 0.7, threads=1)
    data = model.parameters(materials_of(UNIT, m))
    state = Equilibrium(model, materials_of(UNIT, m)).newton(np.zeros_like(m.nodes), 0.005)
    assert state.residual < 1e-9
    K = model.matrix(model.tangent(state.u, 0.005, data))
    way = np.zeros(m.nodes.size)
    way[model.free] = np.random.default_rng(3).standard_normal(len(model.free))
    step = 1e-6 * way.reshape(-1, 3)
    change = model.residual(state.u + step, 0.005, data) - model.residual(state.u - step, 0.005, data)
    expected = change.ravel()[model.free] / 2e-6
    away = K @ way[model.free] - expected
    assert np.linalg.norm(away) < 1e-2 * np.linalg.norm(expected)


@pytest.mark.nightly("test_a_run_starts_from_the_states_of_the_body_without_its_effect")
def test_changes_on_a_coarser_mesh_are_taken_over_in_proportion(cache):
    fine = MeshSettings(refine=1.0)
    alone = attrs.evolve(QUICK, mesh=fine, changes=fine, pressures=4, effects=("wall_thickness",))
    both = attrs.evolve(alone, changes=ROUGH)
    tests = [bench(markers={})]
    wanted, found, coarse = (
        unit_responses(UNIT, tests, how, cache)[0] for how in (alone, both, attrs.evolve(both, mesh=ROUGH))
    )
    at = found.pressures_kPa
    np.testing.assert_allclose(found.values, wanted.values, rtol=1e-12)
    assert np.abs(coarse.values - wanted.values).max() > 0.01 * np.abs(wanted.values).max()
    thick = [r.variants["wall_thickness"] for r in (wanted, found, coarse)]
    np.testing.assert_array_equal(thick[0].at, thick[1].at)
    changes = [v.values[-1] - r.values for v, r in zip(thick, (wanted, found, coarse), strict=True)]
    away = np.abs(changes[0]) > 0.1 * np.abs(changes[0]).max()
    miss = [np.abs(c - changes[0])[away] / np.abs(changes[0])[away] for c in changes[1:]]
    assert miss[0].max() < 0.5 * miss[1].max()
    # What is between both meshes stands beside every hypothesis, at each suction with a size of its own, and
    # midway between two: walls meet there, too.
    suction = at[at <= 0]
    np.testing.assert_allclose(suction[1::2], (suction[:-1:2] + suction[2::2]) / 2)
    shares = {"mesh_share": np.ones_like(at)}
    shares |= {f"mesh_share_{-p:.3g}_kPa_below": 1.0 * (at == p) for p in at[at < 0]}
    assert len(shares) == 3
    for name, share in shares.items():
        error = found.variants[name]
        way = share * (found.values - coarse.values)
        np.testing.assert_allclose(error.values[-1] - found.values, way, atol=1e-9)
        assert error.parameter in UnitPressure([found], tests).nuisances


@pytest.mark.parametrize(("effect", "size"), [("strain_stiffening", 0.4), ("gravity", 1300.0)])
def test_a_run_starts_from_the_states_of_the_body_without_its_effect(tmp_path, effect, size):
    base = Run(Body(UNIT, ROUGH), (-4.0, 0.0, 6.0, 12.0), outline=True)
    run(base, tmp_path)
    changed = attrs.evolve(base, effect=effect, size=size, outline=False)
    taken = []

    def counted(equilibrium, *args):
        taken.append(_from_beside(equilibrium, *args))
        return taken[-1]

    with mock.patch("mu_addon.evidence.unit_run._from_beside", counted):
        found = run(changed, tmp_path).values
    assert len(taken) == 3
    assert all(taken)
    np.testing.assert_allclose(found, run(changed).values, atol=1e-6)


@pytest.mark.parametrize("name", ["wall_thickness", "anisotropy", "tension_compression_asymmetry"])
def test_what_acts_both_ways_is_sought_from_both_sides(name):
    """From above 0 alone, an asymmetry of -0.3 ended at 0.78, and a thinner wall was named."""
    p = EFFECTS[name].parameter
    assert min(p.starts) < p.null < max(p.starts)


def planned(settings, at=(-6.0, 0.0, 8.0, 12.0), readings=(-6.0, 12.0)):
    """Runs of a unit without markers, of which each has the same angles."""
    found = mock.MagicMock()
    found.__getitem__.return_value = Result(np.arange(len(at))[None] - 1.0)
    return UnitPlan(Body(UNIT), settings, 1.0, 1.0, ((0.0, X),), at, readings, (), frozenset(), found)


def test_a_first_look_runs_few_sizes_and_a_name_asks_for_the_others():
    settings = UnitSettings()
    runs = list(planned(settings).runs())
    sizes = {n: [r.size for r in runs if r.effect == n] for n in EFFECTS}
    assert max(map(len, sizes.values())) <= 2
    assert min(map(len, sizes.values())) == 1
    assert sizes["wall_thickness"] == [0.8, 1.3]
    further = settings.further({"wall_thickness", "leak"})
    assert further is not None
    assert further.whole == {"wall_thickness"}
    assert further.further(("wall_thickness",)) is None
    assert planned(further).sizes("wall_thickness") == (0.8, 0.9, 1.0, 1.15, 1.3)


def test_an_effect_is_believed_no_further_than_a_first_look_at_it():
    plan, bounds = planned(UnitSettings()), {}
    for name in ("strain_stiffening", "wall_thickness"):
        p = unit_fem._variant(plan, name, (0.0, X), lambda result: result.values).parameter
        bounds[name] = p.low, p.high
    assert bounds == {"strain_stiffening": (0.0, 1.0), "wall_thickness": (0.8, 1.3)}


def test_a_change_goes_on_beyond_the_readings_alone():
    plan = planned(UnitSettings(), (-12.0, -8.0, 0.0, 8.0, 12.0), (-9.0, 12.0))
    plan.found.__getitem__.return_value = Result(np.array([[-32.0, -13.0, 0.0, 5.0, 7.0]]))
    found = unit_fem._continued(plan, Result(np.array([[np.nan, -11.0, 0.0, 4.0, np.nan]]), "it collapses"))
    # At -12 kPa 1.5 times the change at -8 kPa; at 12 kPa, which was read, nothing is made up.
    np.testing.assert_allclose(found.values, [[-29.0, -11.0, 0.0, 4.0, np.nan]])
    assert found.why == "it collapses"


def test_another_design_ends_with_the_readings_and_its_change_goes_on_in_proportion():
    at = np.array([-12.0, -6.0, 0.0, 24.0, 48.0])
    plan = planned(UnitSettings(), tuple(at.tolist()), (-10.0, 40.0))
    designs = SimpleNamespace(units=(UNIT, UNIT.evolve(wall_mm=1.1 * UNIT.chambers.wall_mm)))
    same, other = plan.of_designs(designs)
    assert same == plan.case()
    own = np.array(other.pressures_kPa)
    assert (own[0], own[-1], np.abs(np.diff(own)).max()) == (-10.0, 40.0, 2.5)
    plan.found.__getitem__.return_value = Result((0.5 * own + 0.01 * own**2)[None])
    found = unit_fem._of_design(plan, other, [0], at, 0.5 * at[None]) - 0.5 * at
    np.testing.assert_allclose(found, [[1.2, 0.36, 0.0, 5.76, 19.2]], atol=1e-9)
    unread = attrs.evolve(plan, readings_kPa=(0.0, 40.0)).of_designs(designs)[1]
    assert unread.pressures_kPa[:2] == (-12.0, 0.0)


@pytest.mark.parametrize(("other", "tried"), [(True, [0.01, 0.02]), (False, [-0.01, 0.01, 0.02])])
def test_another_design_ends_where_one_pressure_is_not_reached_and_sucks_last(other, tried):
    seen = []

    def reach(target, history):
        seen.append(target)
        if target == 0.02:
            raise ConvergenceError("it bursts")
        return history[-1]

    case = Run(Body(UNIT, other=other), (-10.0, 0.0, 10.0, 20.0, 30.0))
    with pytest.raises(ConvergenceError, match="it bursts"):
        list(_states(SimpleNamespace(reach=reach), case, None))
    assert seen == tried
