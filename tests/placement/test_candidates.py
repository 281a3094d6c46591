"""Algorithm 1 on a coarse mesh of the real unit."""

import subprocess
import sys

import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import mirror
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.candidates import candidate_paths, evaluate, evaluation, moved_points, roi

UNIT = load_preset("mu-1.0x")
COARSE = MeshSettings(refine=0.5)
PRESSURES = np.array([0.0, -10.0, 0.0, 20.0])


def materials(mesh):
    return materials_of(UNIT, mesh)


@pytest.fixture(scope="module")
def half():
    mesh = mesh_unit(UNIT, COARSE)
    model = Model(mesh)
    baseline = simulate(Equilibrium(model, materials(mesh)), np.arange(4.0), PRESSURES)
    return mesh, model, baseline


@pytest.fixture(scope="module")
def monitored(half):
    points = anchor_points(UNIT)
    return points, probe(half[0], points)


NAMES = ("alpha1", "alpha2", "alpha4", "alpha6", "alpha10")


def sensors(mesh, names):
    every = {c.name: c for c in candidate_paths(anchor_points(UNIT), windows(6))}
    return [roi(mesh, every[name], 1.0).share for name in names]


@pytest.fixture(scope="module")
def swept(half, monitored):
    """Evaluations of some candidates, all solved in lockstep."""
    mesh, model, baseline = half
    sweep = CandidateBatch(model, materials(mesh), monitored, sensors(mesh, NAMES), 2.5)
    moved = baseline.of_time(np.array([sweep.at(s) for s in baseline.solved]))
    still = moved_points(monitored, baseline)
    return {name: evaluation(name, moved[:, i], still, 21) for i, name in enumerate(NAMES)}


def test_a_sensor_as_soft_as_the_lattice_changes_nothing(half, monitored):
    mesh, model, baseline = half
    soft = UNIT.material.lattice_modulus_kPa / 1e3
    sweep = CandidateBatch(model, materials(mesh), monitored, sensors(mesh, ["alpha2"]), soft)
    moved = sweep.at(baseline.solved[-1])[0]
    assert np.abs(moved - moved_points(monitored, baseline)[-1]).max() < 1e-6


def test_a_longer_window_disturbs_more_than_the_shorter_one_inside_it(swept):
    J = {n: swept[n].deviation.J_hat for n in ("alpha2", "alpha6", "alpha10")}
    assert 0 < J["alpha2"] < J["alpha6"] < J["alpha10"]


def test_nothing_deviates_without_pressure(swept):
    found = swept["alpha1"].deviation
    assert found.over_time[PRESSURES == 0].max() == 0
    assert found.over_time[PRESSURES != 0].min() > 0


def test_lockstep_finds_what_each_finds_alone_along_its_whole_path(half, monitored, swept):
    """The guard of path independence: cold, step by step from rest, against the jump that all share."""
    mesh, model, baseline = half
    every = {c.name: c for c in candidate_paths(anchor_points(UNIT), windows(6))}
    alone = evaluate(model, materials(mesh), baseline, monitored, every["alpha10"], 1.0, 2.5, 21)
    together = swept["alpha10"]
    assert np.abs(alone.deviation.delta - together.deviation.delta).max() < 1e-6


def test_the_angle_grows_with_pressure_and_changes_sign_with_it(half):
    mesh, _, baseline = half
    angles = [bending_angle_deg(mesh, s.u) for s in baseline.solved]
    assert angles[0] < 0 == angles[1] < angles[2]


def test_a_mirrored_mesh_answers_symmetrically_and_as_its_half(half):
    mesh, _, baseline = half
    whole = mirror(mesh, "x")
    state = simulate(Equilibrium(Model(whole), materials(whole)), np.arange(2.0), PRESSURES[2:]).states[-1]
    n = len(mesh.nodes)
    np.testing.assert_allclose(state.u[:n], baseline.solved[-1].u, atol=1e-6)
    off = np.abs(mesh.nodes[:, 0]) > 0
    np.testing.assert_allclose(state.u[n:], state.u[:n][off] * [-1, 1, 1], atol=1e-6)


@pytest.mark.nightly("tests/headless/test_resume.py::test_killed_at_any_stage_it_goes_on_to_the_same_digits")
def test_two_processes_find_the_same_to_the_last_digit(tmp_path):
    script = """
import sys
from tests.placement.test_candidates import *
mesh = mesh_unit(UNIT, COARSE)
model = Model(mesh)
baseline = simulate(Equilibrium(model, materials(mesh)), np.arange(2.0), PRESSURES[2:])
points = anchor_points(UNIT)
every = candidate_paths(points, windows(6))
batch = CandidateBatch(model, materials(mesh), (points, probe(mesh, points)), sensors(mesh, JOBS[2:4]), 2.5)
moved = batch.at(baseline.solved[-1])
sys.stdout.write(mesh.hash() + " " + moved.tobytes().hex())
"""
    answers = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert answers[0] == answers[1]
    assert len(answers[0].split()[0]) == 64
