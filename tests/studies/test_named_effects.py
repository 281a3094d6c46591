"""What evidence named, in a designer's simulation: as the evidence computes it, kept, refused, resumed."""

import json

import attrs
import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.cli.main import parser
from mu_addon.cli.objects import modelled
from mu_addon.design import shapes
from mu_addon.design.body import body_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.rigid_body import RigidBody
from mu_addon.errors import InputError
from mu_addon.evidence.effects import STATIC as EFFECTS
from mu_addon.evidence.extended import ExtendedModel, Fitted
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.unit_body import Body
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.clogged import CloggedModel
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import Foam, Layered, Yeoh
from mu_addon.fem.protocol import Protocol
from mu_addon.fem.time_stepping import simulate_in_time
from mu_addon.fem.trajectory import simulate
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.context import run_to_end
from mu_addon.run.folder import keep_inputs
from mu_addon.run.progress import Progress
from mu_addon.simulate_and_place.extended_unit import extend
from mu_addon.simulate_and_place.named_effects import STATIC, NamedEffects
from mu_addon.studies.parameter_study.plan import parse_plan
from mu_addon.studies.unit_ranking import UnitStudy
from tests.evidence import analytic
from tests.evidence.hollow_finger import finger

from . import unit_runs
from .made_up import bent

UNIT = load_preset("mu-1.0x")
ROUGH = MeshSettings(refine=0.35)
TIME, PRESSURE = np.arange(2.0), np.array([0.0, 2.0])
# Three chambers, one path.
SHORT = UNIT.evolve(count=3)
JOB = UnitStudy(
    unit=SHORT,
    protocol=Protocol(TIME, PRESSURE),
    mesh=ROUGH,
    times=2,
    stations=11,
    mesh_check=False,
    workers=1,
)
SIZES = {
    "gravity": 1300.0,
    "strain_stiffening": 0.6,
    "anisotropy": 1.3,
    "tension_compression_asymmetry": 1.5,
    "clogged_chamber": 0.65,
}


def named(**sizes):
    """Effects of these sizes, as a table has them."""
    return {name: {EFFECTS[name].parameter.name: size} for name, size in sizes.items()}


def with_effects(orientation_deg=0.0, job=JOB, **sizes):
    return attrs.evolve(job, effects=NamedEffects(named(**sizes), orientation_deg))


def model_file(path, **sizes):
    """model.toml of a diagnosis that named these effects."""
    effects = {
        n: {p: Fitted(s, 0.1 * s, 0.8 * s, 1.2 * s) for p, s in v.items()} for n, v in named(**sizes).items()
    }
    ExtendedModel("named", effects, {}).save(path)
    return path


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(SHORT, ROUGH)


def moved(job, mesh):
    """Model A of a job, and its angles by pressure."""
    found = simulate(job.mechanics.equilibrium(mesh), TIME, PRESSURE)
    return found, np.array([bending_angle_deg(mesh, s.u) for s in found.solved])


def ran(job, folder):
    """Summary of its run."""
    return unit_runs.ran(job, folder)[0]


def test_every_static_effect_of_the_evidence_can_be_simulated():
    assert set(SIZES) == set(STATIC)
    assert set(EFFECTS) - set(STATIC) == {"overcure", "skin_cure", "wall_thickness"}


@pytest.mark.parametrize("name", STATIC)
def test_a_simulation_is_what_the_evidence_computes_of_the_same_effect(name, mesh):
    """The same materials, loads and chambers on one mesh: there is nothing to tell the two apart."""
    size, effect = SIZES[name], EFFECTS[name]
    of_model = ExtendedModel("named", {name: {effect.parameter.name: Fitted(size, 0, 0, 0)}}, {})
    effects = attrs.evolve(extend(SHORT, of_model).effects, orientation_deg=90.0)
    job, body = attrs.evolve(JOB, effects=effects), Body(SHORT, ROUGH, orientation_deg=90.0)
    base = body.materials(mesh)
    materials = effect.materials(base, mesh, size) if effect.materials else base
    model = effect.model(body, mesh, size) if effect.model else body.model(mesh)
    load = effect.load(body, mesh, size) if effect.load else None
    assert job.mechanics.materials(mesh).hash() == materials.hash()
    found = job.mechanics.model(mesh)
    assert type(found) is type(model)
    u, data = bent(mesh, 1.0), found.parameters(materials)
    np.testing.assert_array_equal(found.residual(u, 0.01, data) if load is None else found.load,
                                  model.residual(u, 0.01, data) if load is None else load)  # fmt: skip
    assert job.mechanics.newton == body.newton(effect)
    plain = JOB.mechanics.model(mesh)
    same = materials.hash() == JOB.mechanics.materials(mesh).hash() and load is None
    assert not same or not np.array_equal(plain.residual(u, 0.01, data), found.residual(u, 0.01, data))


def test_weight_alone_bends_a_unit_that_lies_and_none_that_hangs(mesh):
    def sag(turn):
        job = with_effects(turn, gravity=1300.0)
        state = job.mechanics.equilibrium(mesh).at_zero_pressure()
        return bending_angle_deg(mesh, state.u)

    hanging, lying, turned = map(sag, (0.0, 90.0, -90.0))
    # Not none at all: there is more lattice on one side.
    assert abs(hanging) < 0.2 * abs(lying)
    assert lying < -0.05
    assert turned == pytest.approx(-lying, rel=0.05)


def test_effects_side_by_side_are_all_in_one_body(mesh):
    job = with_effects(90.0, **SIZES)
    assert isinstance(job.mechanics.model(mesh), CloggedModel)
    assert job.mechanics.model(mesh).load is not None
    laws = {layer.law for layer in job.mechanics.materials(mesh).layers}
    assert laws == {Yeoh, Layered, Foam}


def test_a_layered_wall_that_stiffens_does_so_in_what_of_it_is_isotropic(mesh):
    """The order in which the two are given changes nothing."""
    one = with_effects(anisotropy=1.3, strain_stiffening=0.4).mechanics.materials(mesh)
    other = attrs.evolve(
        JOB, effects=NamedEffects(named(strain_stiffening=0.4) | named(anisotropy=1.3))
    ).mechanics.materials(mesh)
    assert one.hash() == other.hash()
    np.testing.assert_allclose(
        one.small_strain(len(mesh.tets))[0],
        with_effects(anisotropy=1.3).mechanics.materials(mesh).small_strain(len(mesh.tets))[0],
        rtol=1e-12,
    )


def test_beside_obstacles_weight_acts_from_the_first_instant_on():
    mesh = finger(SHORT, ROUGH)
    block = shapes.box((-40, 300, 15), (40, 320, 50)).to_mesh64()
    far = body_of(np.array(block.vert_properties)[:, :3], np.asarray(block.tri_verts).astype(int), "far.stl")
    job = with_effects(90.0, gravity=1300.0)
    beside = attrs.evolve(job, obstacles=(RigidBody(far),))
    free, _ = moved(job, mesh)
    model = beside.mechanics.model(mesh)
    assert len(model.obstacles) == 1
    simulated_in_time = simulate_in_time(
        Equilibrium(model, beside.mechanics.materials(mesh), beside.mechanics.newton), TIME, PRESSURE
    )
    for k, state in enumerate(simulated_in_time.states):
        np.testing.assert_allclose(state.u, free.states[k].u, atol=1e-6)


@pytest.mark.slow
def test_sensor_paths_are_ranked_in_a_unit_that_weighs_something(tmp_path, with_light):
    """A candidate started from Model A's states is where its own path from no pressure leads it."""
    found = ran(with_effects(90.0, gravity=1300.0), with_light(tmp_path))
    assert found["sweep"]["path_difference_mm"] < 0.02 * found["J_hat_mm"]["alpha1"]
    # Under its weight a unit with a sensor hangs otherwise.
    with np.load(tmp_path / "delta.npz") as stored:
        assert stored["delta_mm"][0, 0].mean() > 1e-3
    assert (tmp_path / "sensitivity.vtu").is_file()
    # Light is told about the angle without pressure.
    for low, high in found["light"]["monotonic_deg"].values():
        assert low <= found["angle_deg"]["0"] <= high
    assert found["study"]["orientation_deg"] == 90.0
    assert found["study"]["effects"] == named(gravity=1300.0)


def test_another_size_or_direction_is_another_study_and_no_weight_has_no_direction():
    keys = {
        json.dumps(with_effects(turn, gravity=density).tables)
        for turn in (0.0, 90.0, 450.0 - 360.0)
        for density in (1000.0, 1300.0)
    }
    assert len(keys) == 4
    assert (
        with_effects(90.0, strain_stiffening=0.4).texts() == with_effects(0.0, strain_stiffening=0.4).texts()
    )
    assert with_effects(90.0, gravity=0.0).texts() == JOB.texts()
    assert with_effects(90.0, gravity=0.0).effects.parts == JOB.effects.parts == ()


def test_a_job_with_effects_comes_back_from_its_folder(tmp_path):
    job = with_effects(45.0, **SIZES)
    keep_inputs(tmp_path, job.texts())
    assert "[simulate.effects.gravity]" in job.texts()["study.toml"]
    found = UnitStudy.read(tmp_path)
    assert found.effects == job.effects
    assert found.texts() == job.texts()


GRAVITY = "[simulate.effects.gravity]\ndensity_kg_m3 = 1300.0\n"


@pytest.mark.parametrize(
    ("old", "new", "what", "remedy"),
    [
        ("gravity", "magnetism", "no effect 'magnetism' is known", "known: anisotropy, clogged"),
        ("gravity", "gravitty", "did you mean 'gravity'", "known: anisotropy"),
        (
            "gravity",
            "pressure_gain",
            "not an effect that a simulation of the unit can contain",
            "known: anisotropy",
        ),
        ("density", "mass", "gravity has density_kg_m3, not mass_kg_m3", "write density_kg_m3"),
        ("1300.0", "-5.0", "density_kg_m3 = -5.0 is out of bounds", "give 0 to 4000 kg/m3"),
        ("1300.0", "inf", "out of bounds", "give 0 to 4000"),
        ("1300.0", "true", "out of bounds", "give 0 to 4000"),
        (GRAVITY, "[simulate.effects]\ngravity = 3\n", "gravity has density_kg_m3, not 3", "write density"),
    ],
)
def test_effects_that_are_none_are_refused_with_place_and_remedy(tmp_path, old, new, what, remedy):
    keep_inputs(tmp_path, with_effects(90.0, gravity=1300.0).texts())
    path = tmp_path / "study.toml"
    found = path.read_text()
    assert GRAVITY in found
    path.write_text(found.replace(GRAVITY, GRAVITY.replace(old, new)))
    with pytest.raises(InputError) as caught:
        UnitStudy.read(tmp_path)
    assert what in caught.value.what
    assert f"{path}, [simulate.effects]" in caught.value.where
    assert remedy in caught.value.remedy


@pytest.mark.parametrize("turn", ["sideways", True, float("nan"), 400.0])
def test_a_direction_that_is_none_is_refused(turn):
    with pytest.raises(InputError, match="not a valid orientation"):
        NamedEffects(named(gravity=1000.0), turn)


def test_a_clog_is_refused_where_the_whole_lattice_is_searched():
    with pytest.raises(InputError, match="whole lattice"):
        with_effects(job=attrs.evolve(JOB, paths="graph"), clogged_chamber=0.5)


def given(*words, whole=True):
    """What a command makes of its options --preset and --model, its summary, and what it warns of."""
    messages = []
    options = parser().parse_args([str(w) for w in [*words, "--preset", "mu-1.0x", "--out", "out"]])
    with run_to_end(Progress([messages.append])) as context:
        found = modelled(options, context, whole)
    assert context.status == 0, messages[-1]
    return found, context.summary, [m["what"] for m in messages if m.get("type") == "warning"]


def test_options_give_what_a_diagnosis_found_and_a_direction_of_nothing_that_weighs_is_told(tmp_path):
    path = model_file(tmp_path / "model.toml", clogged_chamber=0.3)
    (unit, effects), _, warned = given("simulate", "--model", path, "--orientation", "90")
    assert unit == UNIT
    assert effects.tables == {"effects": named(clogged_chamber=0.3)}
    assert warned == ["gravity is not part of this model, so the orientation has no effect"]
    path = model_file(tmp_path / "model.toml", gravity=1000.0, strain_stiffening=0.4)
    (_, effects), summary, warned = given("place", "--model", path, "--orientation", "90")
    assert effects == NamedEffects(named(gravity=1000.0, strain_stiffening=0.4), 90.0)
    assert len(summary["model"]["applied"]) == 2
    assert not warned


def test_homogenize_says_that_it_knows_no_whole_unit(tmp_path):
    path = model_file(tmp_path / "model.toml", gravity=1300.0)
    (unit, _), summary, (warned,) = given("homogenize", "--model", path, whole=False)
    assert unit == UNIT
    assert "1300 kg/m³: only `simulate` and `place` simulate the whole unit" in warned
    assert summary["model"]["applied"] == ()


def test_what_has_no_place_in_a_simulation_is_left_out_and_says_why():
    effects = {
        "pressure_gain": {"gain": Fitted(0.1, 0, 0, 0)},
        "contact": {"reach_mm": Fitted(2.0, 0, 0, 0)},
        "gravity": {"density_kg_m3": Fitted(1100.0, 0, 0, 0)},
    }
    found = extend(UNIT, ExtendedModel("ambiguous", effects, {}, rivals=("line_lag", "leak of specimen B")))
    assert found.unit == UNIT
    assert found.effects.sizes == {"gravity": 1100.0}
    assert found.applied == ("solid parts have a density of 1100 kg/m³",)
    assert "gravity" in found.doubt
    assert "line lag or leak of specimen B" in found.doubt
    gain, contact = found.left_out
    assert "gauge" in gain
    assert "--obstacle" in contact
    # What a file keeps of it says as much of gravity, and nothing of the rest.
    assert list(found.kept.effects) == ["gravity"]
    again = extend(UNIT, found.kept)
    assert again.effects == found.effects
    assert "line lag" in again.doubt
    part = found.of_parameters()
    assert not part.effects
    assert part.applied == ()
    assert "1100" in part.left_out[-1]


def test_softer_is_said_in_words_and_errors_of_the_model_are_no_part_of_a_unit():
    size = {"excess": Fitted(-0.32, 0.01, -0.34, -0.3)}
    errors = ("discrepancy_second", "mesh_share", "mesh_share_11_kPa_below")
    nuisances = {name: Fitted(0.1, 0.01, 0.08, 0.12) for name in (*errors, "angle_zero_deg")}
    model = ExtendedModel("named", {"tension_compression_asymmetry": size}, nuisances)
    found = extend(load_preset("mu-1.0x"), model)
    assert found.applied == ("struts are 32% softer in compression than in tension",)
    assert [words.partition(" (")[0] for words in found.left_out] == ["angle zero deg"]


def test_an_effect_out_of_its_bounds_is_refused_by_the_models_name():
    known = ExtendedModel("named", {"gravity": {"density_kg_m3": Fitted(9e3, 0, 0, 0)}}, {})
    with pytest.raises(InputError, match="out of bounds") as caught:
        extend(UNIT, known, "there/model.toml")
    assert "there/model.toml" in caught.value.where


def test_a_sweep_may_turn_a_unit_that_weighs_something(tmp_path):
    plan = parse_plan(
        'format = 1\npreset = "mu-1.0x"\nmethod = "grid"\n' + GRAVITY + "[vary]\n"
        '"simulate.orientation_deg" = { values = [0.0, 90.0] }\n',
        tmp_path,
    )
    found = [plan.point(number).job.effects for number in (1, 2)]
    assert found == [with_effects(turn, gravity=1300.0).effects for turn in (0.0, 90.0)]


SLOW = Protocol(np.array([0.0, 1.0, 9.0, 10.0, 18.0]), np.array([0.0, 20.0, 20.0, 0.0, 0.0]))
MILD = attrs.evolve(SLOW, pressure_kPa=SLOW.pressure_kPa / 10.0)
IN_TIME = {
    "viscoelasticity": {"share": 0.3, "time_s": 2.0},
    "relaxing by decades": {"per_decade": 0.05, "onset_s": 0.5},
    "line_lag": {"time_s": 0.4},
    "line_lag of two volumes": {"slower_s": 0.4, "faster_share": 0.5},
    "leak": {"conductance_ratio": 0.2},
    "rate_independent_hysteresis": {"share": 0.3, "threshold_kPa": 4.0},
    "mullins_softening": {"softening": 0.3, "energy_share": 0.2, "reference_kPa": 20.0},
}


def in_time(name, **more):
    effect = "viscoelasticity" if name.startswith("relaxing") else name.partition(" of ")[0]
    return attrs.evolve(JOB, protocol=SLOW, times=19, effects=NamedEffects({effect: IN_TIME[name]}), **more)


@pytest.mark.parametrize("name", IN_TIME)
def test_in_time_the_unit_stands_where_the_evidence_has_it(name):
    """The pressure at which it stands is the evidence's own, of a record of the same pressures."""
    time = np.linspace(0.0, 18.0, 181)
    pressure = np.interp(time, SLOW.time_s, SLOW.pressure_kPa)
    record = analytic.experiment("one", time, pressure, dict.fromkeys(analytic.CHANNELS, 0.0 * time))
    effect = "viscoelasticity" if name.startswith("relaxing") else name.partition(" of ")[0]
    values = {f"{effect}.{p}": v for p, v in IN_TIME[name].items()}
    expected = UnitPressure([analytic.response()], [record]).effective_kPa(record, values)
    found = in_time(name).samples.pressure_kPa
    np.testing.assert_allclose(found, expected[::10], atol=2e-9 if name != "leak" else 1e-9)


@pytest.mark.nightly("test_in_time_the_unit_stands_where_the_evidence_has_it")
def test_a_wall_that_relaxes_creeps_on_and_comes_back(tmp_path):
    """A step of pressure held: the bending goes from that of the modulus at once to that after long."""
    job = attrs.evolve(in_time("viscoelasticity"), protocol=MILD, times=7, stages=("design", "simulate"))
    summary = ran(job, tmp_path)
    rows = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
    assert rows["time_s"].tolist() == job.samples.time_s.tolist() == [0, 3, 6, 9, 12, 15, 18]
    np.testing.assert_allclose(rows["pressure_kPa"], [0, 2, 2, 2, 0, 0, 0])
    assert (np.diff(rows["angle_deg"][1:4]) > 0).all()
    # After long it stands where the unit without memory does at 2 kPa.
    assert 1.5 < rows["effective_kPa"][1] < rows["effective_kPa"][3] == pytest.approx(2.0, rel=0.03)
    assert 0.0 < rows["angle_deg"][4] < 0.3 * rows["angle_deg"][3]
    assert rows["angle_deg"][-1] < 0.1 * rows["angle_deg"][3]
    # The table has six digits.
    assert summary["angle_deg"]["2"] == pytest.approx(rows["angle_deg"][1], rel=1e-5)
    shown = np.load(tmp_path / "motion/model_a.npz")
    np.testing.assert_allclose(shown["pressure_kPa"], rows["pressure_kPa"])


def test_a_mechanism_found_in_two_kinds_acts_by_the_parameters_of_the_unit():
    """A leak of a closed chamber, stated beside the unit's own, is told and does not take it away."""
    share = {"conductance_ratio": Fitted(0.1, 0, 0, 0)}
    alone = extend(UNIT, ExtendedModel("named", {"leak": share}, {}))
    assert alone.effects.values["leak"]
    both = extend(UNIT, ExtendedModel("named", {"leak": {**share, "loss_per_s": Fitted(0.02, 0, 0, 0)}}, {}))
    assert both.effects == alone.effects
    assert both.applied == alone.applied
    (told,) = both.left_out
    assert "loss_per_s 0.02" in told
    assert "another kind of experiment" in told
