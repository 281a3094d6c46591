"""The paper's table done again: what is compared with it, and how."""

import re

import attrs
import numpy as np
import pytest

from benchmarks.paper.inclusion_rules import INTERSECT, RULES, VOLUME_FRACTION, sensor_share
from benchmarks.paper.table.agreement import (
    HELD,
    NOT_HELD,
    UNDECIDED,
    agreement,
    spearman,
    statements,
)
from benchmarks.paper.table.gripper import deviations
from benchmarks.paper.table.published import GRIPPER, name_of, published
from benchmarks.paper.table.report import report, weightings
from benchmarks.paper.table.run import Found, OtherTableColumn, summary
from benchmarks.paper.table.settings import Settings, read_set, read_settings
from benchmarks.paper.table.table_column import STATIONS, motion, paths, with_fixed_base
from benchmarks.paper.table.table_columns import BENDING_KPA, Solved, TableColumn
from benchmarks.paper.table.values import unit_of_table_column
from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.gripper import load_gripper
from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import candidate_paths, evaluate
from mu_addon.placement.inclusion import Inclusion
from mu_addon.run.folder import keep_inputs
from mu_addon.run.pool import each
from mu_addon.usecases.simulate_and_place.job import grasp

PAPER = published()


def verdicts(table, coarser=None):
    return {s.text: s.verdict for s in statements(table, coarser or {}, PAPER.paths)}


def test_the_papers_own_figures():
    assert PAPER.scales == (0.75, 1.0, 1.5)
    assert [name_of(s) for s in PAPER.scales] == ["0.75x", "1.0x", "1.5x"]
    assert PAPER.table_column(1.0)[1] == 0.376
    assert PAPER.modulus_kPa[1.5] == 16.38
    assert PAPER.bending_deg[0.75] == (-50.0, 45.0)
    # Windows as this program numbers them.
    assert [(p.name, p.start, p.length) for p in PAPER.paths] == [
        (w.name, w.start, w.length) for w in windows(6)
    ]
    best = {name: PAPER.paths[int(np.argmin(J))].name for name, J in PAPER.J_hat.items()}
    assert best == {"0.75x": "alpha4", "1.0x": "alpha4", "1.5x": "alpha2", GRIPPER: "alpha4"}


def test_the_papers_statements_in_its_own_table():
    found = verdicts({name: J for name, J in PAPER.J_hat.items() if name != GRIPPER})
    distal, longer = (
        "of paths of equal length, the distal one deviates least",
        "a path deviates more than any path contained in it",
    )
    assert found[f"0.75x: {distal}"] == found[f"1.0x: {distal}"] == HELD
    assert found[f"1.5x: {distal}"] == NOT_HELD  # alpha2 is its optimum
    assert all(v == HELD for text, v in found.items() if longer in text)
    assert found["1.5x deviates less than 0.75x"] == found["1.5x deviates less than 1.0x"] == HELD


def test_a_difference_that_the_mesh_turns_round_cannot_be_told():
    fine, coarse = PAPER.table_column(1.0).copy(), PAPER.table_column(1.0).copy()
    coarse[3] = coarse[2] + 0.01  # alpha4 above alpha3 on the other mesh
    found = verdicts({"1.0x": fine}, {"1.0x": coarse})
    assert found["1.0x: of paths of equal length, the distal one deviates least"] == UNDECIDED
    assert agreement(fine, fine, PAPER.paths, coarse).tied == ("alpha1", "alpha3")
    # A mesh that makes all larger alike changes no order.
    assert agreement(fine, fine, PAPER.paths, 1.5 * fine).tied == ()


def test_agreement_of_a_column_with_itself_and_with_its_opposite():
    theirs = PAPER.table_column(0.75)
    same = agreement(2 * theirs, theirs, PAPER.paths)
    assert same.spearman == pytest.approx(1.0)
    assert (same.chosen, same.same_choice) == ("alpha4", True)
    assert same.magnitude == pytest.approx(2.0)
    opposite = agreement(1 - theirs, theirs, PAPER.paths)
    assert opposite.spearman == pytest.approx(-1.0)
    assert not opposite.same_choice


def test_spearman_is_scipys():
    from scipy.stats import spearmanr

    one, other = np.random.default_rng(0).integers(0, 5, (2, 10))
    assert spearman(one, other) == pytest.approx(spearmanr(one, other).statistic)


def test_settings_refuse_what_is_out_of_bounds(tmp_path):
    with pytest.raises(InputError, match="out of bounds"):
        Settings(held_cells=-1)
    with pytest.raises(InputError, match="no set of values"):
        read_set("bets")
    assert read_set("default") == {}
    assert Settings(**read_set("held")).held_cells == 1.0
    mine = tmp_path / "mine.toml"
    mine.write_text('[values]\n"chambers.wall_mm" = 1.0\n', encoding="utf-8")
    assert Settings(**read_set(str(mine))).unit.chambers.wall_mm == 1.0
    for wrong, words in (("values = 3\n", "table"), ("held_cells = true\n", "number"), ("=", "TOML")):
        mine.write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_set(str(mine))


def test_settings_are_read_back_from_their_folder(tmp_path):
    settings = Settings({"chambers.wall_mm": 0.95}, "mine", held_cells=1 / 3, gripper=False)
    keep_inputs(tmp_path, settings.texts())
    assert read_settings(tmp_path).texts() == settings.texts()


def test_samplings_weigh_the_same_motion():
    samples = np.array([0.0, -20.0, 0.0, 40.0, 0.0])
    found = weightings(samples)
    assert found["every pressure once"] @ (samples == 0.0) == pytest.approx(1.0)
    assert found["vacuum alone"].tolist() == [0, 1, 0, 0, 0]
    assert found["its two ends"].tolist() == [0, 1, 0, 1, 0]


@pytest.mark.parametrize("workers", [1, 2])
def test_work_in_processes_comes_back_by_number(workers):
    assert dict(each(abs, [-1, 2, -3], workers)) == {0: 1, 1: 2, 2: 3}


# The unit's mesh and mechanics, on meshes as coarse as they can be.

COARSE = MeshSettings(order=1, refine=0.4)


def test_what_is_held_does_not_move_and_its_paths_disturb_nothing():
    unit = Unit()
    mesh = with_fixed_base(mesh_unit(unit, COARSE), 3.0 * unit.dimensions.cell)
    moved = motion(unit, mesh, (40.0,), look_for_self_intersection=False)
    assert np.abs(moved.states[-1].u[mesh.nodes[:, 2] <= 37.5]).max() == 0.0
    free = motion(unit, mesh_unit(unit, COARSE), (40.0,), look_for_self_intersection=False)
    assert 0 < moved.angle_at(40.0) < 0.7 * free.angle_at(40.0)
    J = paths(unit, mesh, moved, ("volume_fraction",), (40.0,)).J_hat(
        "volume_fraction", anchor_points(unit), np.array([0.0, 40.0])
    )
    # alpha1 ends at the third anchor, 31.25 mm above the base.
    assert J[0] < 0.05 * J[3]


def test_the_papers_rule_fills_every_touched_element():
    found = Inclusion(np.array([0.0, 0.25, 1.0]), radius_mm=1.0, length_mm=25.0)
    assert sensor_share(INTERSECT, found).tolist() == [0.0, 1.0, 1.0]
    assert sensor_share(VOLUME_FRACTION, found).tolist() == [0.0, 0.25, 1.0]
    with pytest.raises(ValueError, match="unknown inclusion rule"):
        sensor_share("voxel", found)


def test_a_finger_that_closes_on_nothing_ranks_paths_as_the_paper_does():
    gripper = load_gripper("gripper")
    found = deviations(gripper, mesh_unit(gripper.unit, COARSE), VOLUME_FRACTION, None)
    J = np.array([found[path.name] for path in PAPER.paths])
    assert PAPER.paths[int(J.argmin())].name == "alpha4"
    assert spearman(J, PAPER.J_hat[GRIPPER]) > 0.9


def test_paths_side_by_side_are_each_path_alone():
    unit = unit_of_table_column(Unit(), 0.75, 21.70)
    mesh = mesh_unit(unit, COARSE)
    pressures = (-20.0, 20.0, 40.0)
    moved = motion(unit, mesh, pressures)
    points = anchor_points(unit)
    found = paths(unit, mesh, moved, ("volume_fraction",), pressures)
    (path, *_) = candidate_paths(points, windows(6))
    model, materials = Model(mesh, threads=1), materials_of(unit, mesh)
    baseline = simulate(Equilibrium(model, materials), np.arange(3.0), np.array(pressures))
    alone = evaluate(
        model, materials, baseline, (points, probe(mesh, points)), path,
        unit.dimensions.inclusion_radius, unit.material.sensor_modulus_kPa / 1e3, STATIONS,
    )  # fmt: skip
    side_by_side = found.deviations("volume_fraction", points, np.array(pressures))[0]
    assert side_by_side.delta == pytest.approx(alone.deviation.delta, abs=1e-5)
    assert found.volume_ratio == pytest.approx(np.ones((1, 10)), rel=1e-4)
    assert moved.angle_at(-20.0) < 0 < moved.angle_at(40.0)


def test_the_table_hardly_depends_on_the_pressures_that_are_left_out():
    unit, (_, samples) = Unit(), grasp().sample(13)
    mesh = mesh_unit(unit, COARSE)
    every = tuple(np.unique(samples[samples != 0]))
    moved = motion(unit, mesh, every)
    J = [
        paths(unit, mesh, moved, ("volume_fraction",), solved).J_hat(
            "volume_fraction", anchor_points(unit), samples
        )
        for solved in ((-20.0, 20.0, 40.0), every)
    ]
    assert J[0] == pytest.approx(J[1], rel=0.01)


def shown(**changes):
    """What a run would hand to its report, with the paper's own columns for ours."""
    _, samples = grasp().sample(13)
    columns = []
    for scale in PAPER.scales:
        load = np.abs(samples)[:, None] / np.abs(samples).mean()
        delta = PAPER.table_column(scale)[:, None, None] * np.broadcast_to(load, (10, 13, STATIONS))
        angle = np.array(BENDING_KPA)
        one = Solved(
            np.array(BENDING_KPA), angle, np.full(2, np.nan), np.array([delta, delta]), np.ones((2, 10))
        )
        columns.append(TableColumn(name_of(scale), scale, one, one))
    gripper = OtherTableColumn(dict.fromkeys(RULES, PAPER.J_hat[GRIPPER]), remark="on a cube")
    whole = Found(Settings(), PAPER, tuple(columns), {GRIPPER: gripper}, samples)
    return attrs.evolve(whole, **changes)


def test_the_page_of_the_papers_own_table_agrees_with_it():
    found = shown()
    page = report(found)
    for part in ("table", "deviation", "statements", "bending", "sampling", "versions"):
        assert f'<section id="{part}"' in page
    assert page.count("1.00 (goal") == 4
    assert "4 of 4" in page  # chosen paths
    words = re.sub(r'src="[^"]*"', "", page)
    assert "nan" not in re.sub(r"<style>.*</style>", "", words, flags=re.DOTALL)
    assert "<script" not in page
    for rule in RULES:
        assert found.agreements(rule)[GRIPPER].chosen == "alpha4"
    assert summary(found)["agreement"]["intersect"]["1.5x"]["chosen"] == "alpha2"


def test_the_page_says_what_is_missing_and_what_is_wrong():
    (first, *others) = shown().columns
    angle = np.where(np.array(BENDING_KPA) > 40, np.nan, first.fine.angle_deg)
    bad = attrs.evolve(
        first.fine, angle_deg=angle, crossing_kPa=np.array([-15.2, np.nan]), stopped="limit point at 47 kPa"
    )
    page = report(shown(columns=(attrs.evolve(first, fine=bad), *others), others={}))
    assert "from -15.2 kPa on, walls intersect" in page
    assert "the range of bending was not reached: limit point at 47 kPa" in page
    assert "gripper&#x27;s column is not part" in page
