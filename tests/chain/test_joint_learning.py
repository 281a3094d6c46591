"""A joint learned from finite elements, and two of them against both units as one body."""

from pathlib import Path

import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.chain import Chain, Link, Loads, Sampling, learn
from mu_addon.chain.rigid_motion import rotation_vector
from mu_addon.chain.unit_between_plates import PlateBody
from mu_addon.errors import InputError
from mu_addon.fem import Equilibrium, Model, materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.cache import Cache

from ..evidence.hollow_finger import UNIT, finger
from .joined import full_model

DENSITY = 1.01


@pytest.fixture(scope="module")
def unit():
    """Short and of a stiff wall: no lattice bears what presses on it."""
    return UNIT.evolve(count=3, membrane_modulus_kPa=3 * UNIT.material.membrane_modulus_kPa)


@pytest.fixture(scope="module")
def mesh(unit):
    """A finger in the place of the unit, and the same one for both models."""
    return finger(unit, MeshSettings("full", 0.35))


@pytest.fixture(scope="module")
def learned(unit, mesh):
    sampling = Sampling(pressure_step_kPa=20.0)
    return learn("mu-1.0x", unit, mesh, sampling.pressures(0.0, 40.0), sampling, DENSITY)


def printed(unit):
    """A short printed unit and its mesh, whose struts are beams up to the plate."""
    short = unit.evolve(count=3)
    return short, mesh_printed(short, MeshSettings(refine=0.3, fraction="full"))


@pytest.mark.slow
@pytest.mark.parametrize(("struts", "freedoms"), [("none", (0, 2, 5)), ("beams", (0,))])
def test_stiffness_between_plates_is_symmetric_and_that_of_differences(unit, mesh, struts, freedoms):
    if struts == "beams":
        unit, mesh = printed(unit)
    body = PlateBody(unit, mesh, DENSITY)
    eta = body.rest + np.array([0.1, 0.05, -0.08, 1.0, -0.5, 1.5])
    u = body.solved(np.zeros_like(mesh.nodes), body.rest, eta, 0.01)
    state = body.state(u, eta, 0.01)
    scale = np.outer(body.size, body.size)
    found = state.hessian * scale
    np.testing.assert_allclose(found, found.T, atol=1e-8 * np.abs(found).max())
    h = 1e-4
    for k in freedoms:
        ends = []
        for side in (1.0, -1.0):
            there = eta.copy()
            there[k] += side * h * body.size[k]
            ends.append(body.state(body.solved(u, eta, there, 0.01), there, 0.01))
        slope = (ends[0].gradient - ends[1].gradient) / (2 * h * body.size[k])
        np.testing.assert_allclose(
            slope * body.size * body.size[k], found[k], atol=1e-5 * np.abs(found).max()
        )
        moved = (ends[0].centre - ends[1].centre) / (2 * h * body.size[k])
        np.testing.assert_allclose(moved, state.centre_slope[:, k], atol=1e-5 * (1 + np.abs(moved).max()))


@pytest.mark.slow
def test_a_free_tip_on_a_plate_bends_about_as_the_unit_does(unit, mesh, learned):
    half = finger(unit, MeshSettings(refine=0.35))
    from mu_addon.fem import bending_angle_deg, rest

    equilibrium = Equilibrium(Model(half, threads=1), materials_of(unit, half))
    state = equilibrium.reach(0.02, [rest(half)])
    angle = bending_angle_deg(half, state.u)
    # Positive toward +y, a negative rotation about x. Without a plate the tip's face bulges as well.
    assert 0.9 * angle < -np.degrees(learned.joint.at(20.0).eta0[0]) < 1.05 * angle


@pytest.mark.slow
def test_held_out_states_are_within_a_few_percent_of_their_loads(learned):
    assert len(learned.held_out) >= 6
    assert not learned.missed
    for row in learned.held_out:
        assert row["moment_error_N_mm"] < 0.03 * max(row["moment_N_mm"], 5.0)
        assert row["angle_error_deg"] < 0.3


PAIRS = [(20.0, 20.0), (40.0, 0.0)]
AS_ONE = pytest.mark.nightly("test_a_chain_of_two_is_near_both_units_as_one_body")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plate_between", "turn", "loads", "degrees", "mm"),
    [
        (True, 0.0, Loads(), 0.02, 0.02),
        (True, 90.0, Loads(tip_force_N=np.array([0.2, -0.3, 0.5])), 0.1, 0.15),
        pytest.param(
            *(True, 0.0, Loads(down=np.array([0.0, -1.0, 0.0]), tip_mass_g=50.0), 0.15, 0.25), marks=AS_ONE
        ),
        # Where the planes between the units may warp, all bends further.
        pytest.param(
            *(False, 0.0, Loads(down=np.array([0.0, -1.0, 0.0]), tip_mass_g=50.0), 0.5, 0.8),
            marks=AS_ONE,
        ),
    ],
    ids=["free", "turned and pulled", "heavy", "heavy, in one piece"],
)
def test_a_chain_of_two_is_near_both_units_as_one_body(
    unit, mesh, learned, plate_between, turn, loads, degrees, mm
):
    chain = Chain([Link(learned.joint), Link(learned.joint, turn)], loads)
    full = full_model([unit, unit], [mesh, mesh], [0.0, turn], loads, DENSITY, plate_between)
    rest = chain.at_rest()
    for p, state in zip(PAIRS, full.states(PAIRS), strict=True):
        wanted, found = full.tip(state.u), chain.reach(rest, np.array(p))
        apart = rotation_vector(found.plates[-1, :3, :3].T @ wanted[:3, :3])
        assert np.degrees(np.linalg.norm(apart)) < degrees
        assert np.linalg.norm(found.tip_mm - wanted[:3, 3]) < mm


@pytest.mark.slow
def test_a_second_learning_takes_every_state_from_the_cache(unit, mesh, tmp_path: Path, monkeypatch):
    cache = Cache(tmp_path)
    sampling = Sampling(pressure_step_kPa=20.0, loaded=False)
    how = {
        "kept": lambda w: cache.get("plate", w.replace(" ", "_")),
        "keep": lambda w, a: cache.put("plate", w.replace(" ", "_"), a),
    }
    first = learn("a", unit, mesh, np.array([0.0, 10.0]), sampling, DENSITY, **how)
    monkeypatch.setattr(PlateBody, "free", lambda *a: pytest.fail("solved again"))
    monkeypatch.setattr(PlateBody, "solved", lambda *a: pytest.fail("solved again"))
    again = learn("a", unit, mesh, np.array([0.0, 10.0]), sampling, DENSITY, **how)
    np.testing.assert_array_equal(again.joint.coefficients, first.joint.coefficients)
    assert again.held_out == first.held_out


@pytest.mark.slow
def test_a_path_that_goes_on_from_the_cache_ends_at_the_same_digits(unit, mesh):
    """Steps between its states are not kept; the slope at the last of them led to another guess."""
    body, pressures = PlateBody(unit, mesh, DENSITY), np.array([0.0, 6.0, 12.0])
    whole = body.free_path(pressures, step_kPa=2.0)
    rest = body.free_path(pressures, kept=lambda p: whole[p] if p < 12.0 else None, step_kPa=2.0)
    np.testing.assert_array_equal(rest[12.0][0], whole[12.0][0])


def test_a_sampling_out_of_bounds_is_refused():
    with pytest.raises(InputError, match="bend_deg = 90"):
        Sampling(bend_deg=90.0)
