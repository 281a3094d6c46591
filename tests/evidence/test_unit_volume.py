"""The growth of a unit's chambers as a channel of its measured data."""

import numpy as np
import pytest

from mu_addon.design.quantity import in_MPa
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.unit_pressure import UnitPressure, UnitResponse
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_fem import unit_responses
from mu_addon.evidence.unit_run import Run, run
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.meshing.settings import MeshSettings

from .bench import experiment
from .hollow_finger import UNIT, in_place_of_units

ROUGH = MeshSettings(refine=0.35)
AT = (-4.0, 0.0, 4.0, 8.0)


@pytest.fixture(scope="module", autouse=True)
def fingers():
    with in_place_of_units():
        yield


@pytest.fixture(scope="module")
def grown():
    return run(Run(Body(UNIT, ROUGH), AT)).values[1]


def test_chambers_at_rest_have_not_grown(grown):
    assert grown[1] == 0.0
    assert (np.diff(grown) > 0).all()


def test_the_growth_is_the_slope_of_the_potential():
    """Of an elastic body at rest under pressure p the potential W - pV changes by -V dp."""
    body = Body(UNIT, ROUGH)
    mesh = body.meshed(None)
    model, materials = body.model(mesh), body.materials(mesh)
    equilibrium = Equilibrium(model, materials)
    start, step = equilibrium.at_zero_pressure(), 0.05
    potential = {}
    for p in (4.0 - step, 4.0, 4.0 + step):
        state = equilibrium.reach(in_MPa(p), [start])
        potential[p] = model.potential(state.u, in_MPa(p), equilibrium.parameters)
        if p == 4.0:
            volume = model.cavity_volume(state.u)
    slope = (potential[4.0 + step] - potential[4.0 - step]) / in_MPa(2 * step)
    assert -slope == pytest.approx(volume, rel=1e-4)


def test_it_is_predicted_beside_the_angle_with_a_zero_of_its_own(tmp_path, grown):
    time = np.arange(8.0)
    pressure = np.array([0.0, 2.0, 4.0, 6.0, 8.0, 4.0, 0.0, -3.0])
    columns = {"time_s": time, "pressure_kPa": pressure, "volume_mm3": np.zeros(8), "angle_deg": np.zeros(8)}
    e = experiment("unit_pressure", columns)
    settings = UnitSettings(ROUGH, ROUGH, effects=(), pressures=6, self_contact=False, workers=1)
    (response,) = unit_responses(UNIT, [e], settings, tmp_path)
    assert response.channels == ("angle_deg", "volume_mm3")
    model = UnitPressure([response], [e])
    y = model.predict(e, {})
    assert y[1, 2] == pytest.approx(grown[2], rel=1e-3)
    assert model.predict(e, {"volume_zero_mm3": 50.0})[1] == pytest.approx(y[1] + 50.0)
    # A lens distorts a picture, no syringe.
    assert model.predict(e, {"lens_distortion.at_tip": 0.03})[1] == pytest.approx(y[1])
    bigger = experiment("unit_pressure", columns, scale=1.5)
    (response,) = unit_responses(UNIT, [bigger], settings, tmp_path)
    assert UnitPressure([response], [bigger]).predict(bigger, {})[1] == pytest.approx(1.5**3 * y[1], rel=1e-6)


def test_a_gauge_off_by_two_kPa_is_found_in_volumes_alone():
    """Liquid pushed in and out through a unit that stiffens; the gauge reads 2 kPa too much."""
    at = np.linspace(-15.0, 45.0, 13)
    response = UnitResponse(("volume_mm3",), at, np.array([900.0 * np.arctan(at / 30.0)]))
    rng = np.random.default_rng(3)
    experiments = []
    for number, top in enumerate((20.0, 40.0, -10.0)):
        time = np.arange(0.0, 60.0, 0.5)
        pressure = top * (1 - np.abs(time / 30.0 - 1.0))
        columns = {"time_s": time, "pressure_kPa": pressure, "volume_mm3": np.zeros(len(time))}
        e = experiment("unit_pressure", columns, f"stroke {number}", specimen="A")
        y = UnitPressure([response], [e]).predict(e, {"pressure_offset.offset_kPa": 2.0})[0]
        columns["volume_mm3"] = y + 1.0 * rng.normal(size=len(time))
        experiments.append(experiment("unit_pressure", columns, e.name, specimen="A"))
    found = diagnose(experiments, Composite({"unit_pressure": UnitPressure([response], experiments)}))
    assert found.kind == "named"
    assert found.names == ("pressure_offset",)
    assert found.as_json()["gain"]["fit"]["unit"] == "mm3"
