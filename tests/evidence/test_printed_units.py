"""Verdicts on printed units whose model is the printed body itself, strut by strut."""

import attrs
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mu_addon.design.parameters import load_preset
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effects import STATIC as EFFECTS
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_fem import unit_responses
from mu_addon.evidence.unit_run import Run, run
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.fem.dead_loads import STANDARD_GRAVITY
from mu_addon.fem.laws import Foam, Layered, NeoHooke, Yeoh
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings
from tests.evidence import analytic

UNIT = load_preset("mu-1.0x")
SMALL = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))
ROUGH = MeshSettings(refine=0.5)
LOW, HIGH = -3.0, 8.0


@pytest.fixture(scope="module")
def mesh():
    return Body(SMALL, ROUGH).meshed()


def test_the_weight_of_struts_is_that_of_their_resin(mesh):
    body = Body(SMALL, ROUGH)
    load = EFFECTS["gravity"].load(body, mesh, 1100.0)
    volume = body.model(mesh).volumes.sum()
    assert load[:, 2].sum() == pytest.approx(1100e-12 * STANDARD_GRAVITY * volume, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "laws"),
    [
        ("strain_stiffening", {Yeoh}),
        ("anisotropy", {NeoHooke, Layered}),
        ("tension_compression_asymmetry", {NeoHooke, Foam}),
    ],
)
def test_laws_of_the_resin_act_on_struts_too(mesh, name, laws):
    effect = EFFECTS[name]
    changed = effect.materials(Body(SMALL, ROUGH).materials(mesh), mesh, effect.sizes[-1])
    struts = np.flatnonzero(mesh.region == LATTICE)
    assert {layer.law for layer in changed.layers if np.isin(struts, layer.elements).all()} == laws


def crossing_and_touching():
    """Three chambers with thin walls, which touch from -10 kPa on."""
    thin = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, wall_mm=0.6))
    rough = MeshSettings(refine=0.4)
    return [Run(Body(thin, rough, self_contact=apart), (-14.0, 0.0)) for apart in (False, True)]


def test_a_run_with_walls_that_touch_is_another():
    crossing, touching = crossing_and_touching()
    assert crossing.key() != touching.key()


@pytest.mark.nightly(
    "tests/studies/test_simulate_and_place.py::test_a_study_says_where_walls_and_struts_touch"
)
def test_walls_that_touch_hold_the_unit_back():
    crossing, touching = crossing_and_touching()
    angle, volume = run(touching).values[:, 0]
    wanted = run(crossing).values[:, 0]
    assert wanted[0] < 1.1 * angle < 0
    assert wanted[1] < volume < 0


@pytest.mark.nightly(
    "tests/evidence/test_unit_verdicts.py::test_a_wall_in_the_data_is_named_and_where_it_stands"
)
def test_a_thinner_wall_is_named_though_every_size_has_a_mesh_of_its_own(tmp_path):
    at = tuple(np.concatenate([np.linspace(LOW, 0.0, 3)[:-1], np.linspace(0.0, HIGH, 5)]).tolist())
    thin = attrs.evolve(SMALL, chambers=attrs.evolve(SMALL.chambers, wall_mm=0.87 * SMALL.chambers.wall_mm))
    angle = CubicSpline(at, run(Run(Body(thin, ROUGH), at)).values[0])
    random = np.random.default_rng(5)
    tests = []
    for period, name in ((10.0, "slow"), (3.0, "fast")):
        t, p = analytic.triangle(0.1, period, 3, LOW, HIGH)
        noisy = angle(p) + 0.02 * random.standard_normal(len(p))
        tests.append(analytic.experiment(name, t, p, {"angle_deg": noisy}))
    effects = ("wall_thickness", "gravity")
    # Data and model are of one code and one way of meshing: there is no discrepancy between them.
    settings = UnitSettings(ROUGH, ROUGH, 5, effects=effects, whole=None, self_contact=False, discrepancy=0.0)
    found = diagnose(
        tests,
        Composite({"unit_pressure": UnitPressure(unit_responses(SMALL, tests, settings, tmp_path), tests)}),
    )
    assert found.names == ("wall_thickness",)
    low, high = found.intervals["wall_thickness.factor"]
    assert low < 0.87 < high
