"""The long studies behind the paper's table: random meshes, and what the paper leaves open."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from benchmarks.paper.inclusion_rules import RULES
from benchmarks.paper.long import open_study, scatter
from benchmarks.paper.long.__main__ import main
from benchmarks.paper.long.open_study import objective
from benchmarks.paper.long.open_values import BESIDE, OPEN, design, scaled
from benchmarks.paper.long.report import sections
from benchmarks.paper.long.run import LongFound, LongSettings, shipped
from benchmarks.paper.long.surrogate import fit, shares
from benchmarks.paper.long.unstructured import Recipe, unstructured_mesh
from benchmarks.paper.table.published import published
from benchmarks.paper.table.report import report
from benchmarks.paper.table.settings import Settings
from benchmarks.paper.table.values import unit_of_table_column, with_values
from mu_addon.design.parameters import Unit
from mu_addon.errors import InputError
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE, TET_FACES
from mu_addon.meshing.settings import MeshSettings
from tests.benchmarks.test_paper_table import shown

PAPER = published()
COARSE = MeshSettings(order=1, refine=0.4)


def test_the_objective_is_zero_for_the_paper_itself():
    wanted = np.array([PAPER.bending_deg[s] for s in PAPER.scales])
    own = np.array([PAPER.table_column(s) for s in PAPER.scales])
    assert objective(own, own, wanted, wanted) == pytest.approx(0.0)
    factor_of_two = 0.1 * np.log(2) ** 2
    assert objective(own / 2, own, wanted, wanted) == pytest.approx(factor_of_two)
    assert objective(own, own, wanted / 2, wanted) == pytest.approx(factor_of_two)
    many = objective(np.array([own, own / 2]), own, np.array([wanted, wanted / 2]), wanted)
    assert many == pytest.approx([0.0, 2 * factor_of_two])


def test_surrogate_finds_a_quadratic_and_its_variances():
    x = np.random.default_rng(0).random((60, 4))

    def f(at):
        return 3 + at[:, 0] + 2 * at[:, 1]

    model = fit(x, f(x))
    assert pytest.approx(1.0) == model.Q2
    # Var(a x) is a^2 / 12: one part and four parts.
    assert shares(model, 4).first == pytest.approx([0.2, 0.8, 0.0, 0.0], abs=0.01)

    def product(at):
        return (2 * at[:, 2] - 1) * (2 * at[:, 3] - 1)

    found = shares(fit(x, product(x)), 4)
    assert found.first == pytest.approx(np.zeros(4), abs=0.02)
    assert found.total == pytest.approx([0, 0, 1, 1], abs=0.02)


def test_surrogate_does_not_claim_to_predict_noise():
    random = np.random.default_rng(1)
    assert fit(random.random((60, 8)), random.standard_normal(60)).Q2 < 0.5


def test_orders_that_meshes_agree_on():
    theirs = np.array([1.0, 2.0, 3.0])
    s = scatter.Scatter(np.array([[1.0, 2.0, 3.0], [2.0, 1.0, 3.0]]), theirs, np.ones(2))
    assert s.agree[0, 1] == 0.5
    assert s.agree[2, 0] == s.agree[2, 1] == 1.0
    assert s.chosen.tolist() == [0.5, 0.5, 0.0]
    assert s.spearman == pytest.approx([1.0, 0.5])


def test_drawn_meshes_survive_their_table():
    drawn = scatter.Drawn("grown", 0.75, "intersect", 3, np.arange(1.0, 11.0), 9.5)
    head = ",".join([*scatter.COLUMNS, *(p.name for p in PAPER.paths)])
    rows = "\n".join(",".join(map(str, row)) for row in scatter.to_rows([drawn]))
    (back,) = scatter.from_text(f"# words\n{head}\n{rows}\n", Path("meshes.csv"))
    assert np.array_equal(back.J_hat, drawn.J_hat)
    assert (back.family, back.scale, back.rule, back.seed) == ("grown", 0.75, "intersect", 3)
    with pytest.raises(InputError, match="table of meshes"):
        scatter.from_text("family\ngrown,not a number\n", Path("meshes.csv"))


def test_a_scatter_counts_each_mesh_of_1x_for_both_families():
    units = [unit_of_table_column(Unit(), s, E) for s, E in PAPER.modulus_kPa.items()]
    families = [(d.family.name, d.unit.scale) for d in scatter.draws(units, 1)]
    assert ("same", 1.0) not in families
    assert len(families) == len(set(families)) == 8
    drawn = [scatter.Drawn("grown", 1.0, "intersect", i, PAPER.table_column(1.0), 1.0) for i in range(2)]
    found = scatter.scatters(drawn, {1.0: PAPER.table_column(1.0)})
    assert set(found) == {("grown", "intersect", 1.0), ("same", "intersect", 1.0)}


def synthetic(count=48):
    """Points whose J_hat grows with the wall alone and whose angles fall with it."""
    points = []
    for values in design(count):
        wall = values["chambers.wall_mm"]
        J = np.array([PAPER.table_column(s) for s in PAPER.scales]) * wall
        bending = np.array([(-20 / wall, 30 / wall, 35 / wall)] * 3)
        row = np.array([values[o.name] for o in OPEN])
        points.append(open_study.OpenPoint("", row, "", bending, np.full((3, 2), np.nan), J))
    return points


def test_effects_name_the_one_value_that_matters():
    found = {e.name: e for e in open_study.effects(synthetic(), PAPER)}
    wall = [o.name for o in OPEN].index("chambers.wall_mm")
    size = found["mean J_hat, 1.0x [mm]"]
    assert pytest.approx(1.0) == size.Q2
    assert size.shares.total[wall] == pytest.approx(1.0, abs=0.02)
    assert np.delete(size.shares.total, wall) == pytest.approx(np.zeros(7), abs=0.02)


def test_the_proposal_is_where_ours_is_the_papers():
    # J_hat equals the paper's at a wall of 1 mm, angles want it thin: between, and nearer to J_hat's zero.
    found = open_study.proposal(synthetic(), PAPER)
    assert 0.7 <= found["chambers.wall_mm"] < 1.0


def test_points_survive_their_table():
    names = [p.name for p in PAPER.paths]
    failed = open_study.point("", dict.fromkeys((o.name for o in OPEN), 1.0), "limit point", np.zeros(1))
    points = [*synthetic(2), failed]
    head = ",".join(open_study.columns(PAPER.scales, names))
    rows = "\n".join(",".join(row) for row in open_study.to_rows(points, PAPER.scales, names))
    back = open_study.from_text(f"# words\n{head}\n{rows}\n", PAPER.scales, names, Path("open.csv"))
    assert [p.failed for p in back] == ["", "", "limit point"]
    assert back[1].J_hat == pytest.approx(points[1].J_hat, rel=1e-5)
    assert not back[0].touches
    with pytest.raises(InputError, match="columns are others"):
        open_study.from_text("a,b\n", PAPER.scales, names, Path("open.csv"))


def test_the_design_goes_on_and_stays_within_the_rules():
    few, more = design(8), design(32)
    assert more[:8] == few
    for values in more:
        with_values(Unit(), values)
    for one in BESIDE:
        with_values(Unit(), one.values)
    places = open_study.places(
        [attrs.evolve(synthetic(1)[0], values=np.array([v[o.name] for o in OPEN])) for v in more]
    )
    assert places.min() >= 0
    assert places.max() < 1


def test_what_ships_is_whole():
    drawn, points, origin = shipped(PAPER)
    assert len({d.seed for d in drawn}) >= 12
    assert sum(not p.failed and not p.name for p in points) >= open_study.FEWEST
    assert all("2026" in words for words in origin.values())
    assert {p.name for p in points} >= {one.name for one in BESIDE}


def volumes(mesh):
    a, b, c, d = np.moveaxis(mesh.nodes[mesh.corners], 1, 0)
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def test_an_unstructured_mesh_is_the_whole_unit_without_gaps():
    unit = Unit()
    mesh = unstructured_mesh(unit, Recipe(size_mm=6.0), seed=1)
    v = volumes(mesh)
    assert v.min() > 0
    d = unit.dimensions
    (x0, x1), (y0, y1), (z0, z1) = d.bounds
    assert mesh.symmetry == ()
    assert mesh.nodes.min(axis=0) == pytest.approx([x0, y0, z0])
    assert mesh.nodes.max(axis=0) == pytest.approx([x1, y1, z1])
    # Every face belongs to two elements, or to the boundary: its closed surface holds the same volume.
    faces = mesh.tets[:, TET_FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    assert set(count) == {1, 2}
    outside = mesh.nodes[faces[first[count == 1]]]
    enclosed = np.einsum("ij,ij->i", np.cross(outside[:, 0], outside[:, 1]), outside[:, 2]).sum() / 6
    assert enclosed == pytest.approx(v.sum())
    # The box less its cavity: the lattice of a much finer mesh, whose wall is rounder.
    fine = mesh_unit(unit, MeshSettings(order=1, refine=1.5, fraction="full"))
    lattice = [w[m.region == LATTICE].sum() for m, w in ((mesh, v), (fine, volumes(fine)))]
    assert lattice[0] == pytest.approx(lattice[1], rel=0.03)


def test_a_seed_makes_its_mesh_and_no_other():
    one, again, other = (unstructured_mesh(Unit(), Recipe(size_mm=9.0), seed) for seed in (1, 1, 2))
    assert one.hash() == again.hash()
    assert len(one.nodes) != len(other.nodes)


def test_a_scaled_mesh_is_the_mesh_of_the_scaled_unit():
    unit = Unit()
    larger = mesh_unit(attrs.evolve(unit, scale=1.5), COARSE)
    same = scaled(mesh_unit(unit, COARSE), 1.5)
    assert np.array_equal(larger.tets, same.tets)
    assert larger.nodes == pytest.approx(same.nodes, abs=1e-6)


def test_settings_say_all_and_refuse_what_is_out_of_bounds():
    with pytest.raises(InputError, match="out of bounds"):
        LongSettings(meshes=-1)
    (text,) = LongSettings(Settings(), 3, 8).texts().values()
    (own,) = Settings().texts().values()
    assert text.startswith(own)
    assert "meshes = 3" in text
    assert "points = 8" in text


def long_found():
    """What a run would hand to its report, with meshes and points made up."""
    drawn = [
        scatter.Drawn("grown", scale, rule, seed, PAPER.table_column(scale) * (1 + 0.1 * seed), 10.0)
        for seed in range(3)
        for scale in PAPER.scales
        for rule in RULES
    ]
    return LongFound(shown(), tuple(drawn), tuple(synthetic(32)), {"meshes": "a test", "points": "a test"})


def test_the_page_has_the_long_studies_between_the_tables_own_sections():
    found = long_found()
    page = report(found.table, sections(found))
    at = [
        page.index(f'<section id="{part}"')
        for part in ("table", "deviation", "statements", "bending", "meshes", "open", "sampling", "versions")
    ]
    assert at == sorted(at)
    bare = attrs.evolve(found, drawn=(), points=())
    page = report(bare.table, sections(bare))
    assert '<section id="meshes"' not in page
    assert '<section id="open"' not in page


@pytest.mark.nightly(
    "tests/benchmarks/test_paper_table.py::test_the_table_hardly_depends_on_the_pressures_that_are_left_out"
)
def test_the_command_makes_the_table_and_the_page(tmp_path):
    out = tmp_path / "out"
    assert main(["--coarse", "--out", str(out), "--json"]) == 0
    page = (out / "report.html").read_text(encoding="utf-8")
    for part in ("table", "bending", "meshes", "open"):
        assert f'<section id="{part}"' in page
    assert "[long]" in (out / "reproduce.toml").read_text(encoding="utf-8")
