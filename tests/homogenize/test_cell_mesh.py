"""The octant's mesh: exact planes, the printed volume, one mesh for all scales, and its skin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mu_addon.design.lattice_kinds import kind
from mu_addon.design.strut_cell import Facets, StrutCell, octant_surface, relative_density
from mu_addon.design.surface import volume
from mu_addon.errors import InputError, MeshingError
from mu_addon.homogenize import cell_mesh as module
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell, skin_share
from mu_addon.homogenize.elasticity import effective_tensor
from mu_addon.meshing.mesh import TET_EDGES, Mesh
from mu_addon.meshing.quality import element_volumes
from mu_addon.meshing.surface import mesh_surface
from mu_addon.meshing.tiling import tiled

from . import cells

COARSE = CellMeshSettings(per_diameter=1.5, facets=Facets(12, 8))


def paper_cell(scale: float = 1.0, **more: float) -> StrutCell:
    return StrutCell(kind("body-centred"), 12.5 * scale, 0.75 * scale, 1.0 * scale, **more)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cells")


@pytest.mark.parametrize("order", [1, 2])
def test_its_sides_lie_on_the_planes_and_its_volume_is_the_surfaces(cache: Path, order: int) -> None:
    cell = paper_cell()
    mesh = mesh_cell(cell, CellMeshSettings(order, 1.5, Facets(12, 8)), cache)
    half = cell.half_mm
    assert mesh.order == order
    assert len(mesh.base) == len(mesh.tip) == len(mesh.cavity) == 0
    assert mesh.symmetry == ()
    assert mesh.nodes.min(axis=0).tolist() == [0] * 3
    assert mesh.nodes.max(axis=0).tolist() == [half] * 3
    vertices, triangles = octant_surface(cell, Facets(12, 8))
    assert element_volumes(mesh).sum() == pytest.approx(volume(vertices, triangles), rel=5e-3)
    # What is left within the tolerance of a plane would be a crack between images.
    beside = np.minimum(mesh.nodes, half - mesh.nodes)
    assert beside[beside > 0].min() > 1e-3
    whole = tiled(mesh, (2, 2, 2), (half,) * 3)
    free = cells.free_faces(whole, (2 * half,) * 3)
    own = cells.free_faces(mesh, (half,) * 3)
    assert area(whole, free) == pytest.approx(8 * area(mesh, own))


def area(mesh: Mesh, faces: np.ndarray) -> float:
    a, b, c = mesh.nodes[faces].transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_straight_edges_have_their_middles_on_them(cache: Path) -> None:
    mesh = mesh_cell(paper_cell(), COARSE, cache)
    ends = mesh.nodes[mesh.corners][:, TET_EDGES]
    assert mesh.nodes[mesh.tets[:, 4:]] == pytest.approx(ends.mean(axis=2), abs=1e-12)


def test_scales_share_one_mesh_and_one_tensor(cache: Path) -> None:
    one, other = (mesh_cell(paper_cell(s), COARSE, cache) for s in (1.0, 1.5))
    assert np.array_equal(one.tets, other.tets)
    assert other.nodes == pytest.approx(1.5 * one.nodes, rel=1e-12)
    tensors = [
        effective_tensor(m, cell_materials(paper_cell(s), m, 2.5, 0.45))
        for s, m in ((1.0, one), (1.5, other))
    ]
    assert np.allclose(tensors[1].C, tensors[0].C, rtol=1e-9, atol=0)
    assert tensors[0].relative_density == pytest.approx(relative_density(paper_cell()), rel=0.02)


def test_a_printed_offset_makes_another_mesh(cache: Path) -> None:
    thick = paper_cell(offset_xy_mm=0.15, offset_z_mm=0.15)
    mesh = mesh_cell(thick, COARSE, cache)
    found = effective_tensor(mesh, cell_materials(thick, mesh, 2.5, 0.45))
    assert found.relative_density == pytest.approx(relative_density(thick, COARSE.facets), rel=0.01)
    assert found.relative_density > 1.2 * relative_density(paper_cell())


def test_a_skin_is_as_deep_as_it_says(cache: Path) -> None:
    cell = StrutCell(cells.SIMPLE_CUBIC, 10.0, 1.0, 1.0, skin_depth_mm=0.3, skin_factor=2.0)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=4.0, facets=Facets(16, 8), tolerance=0.005), cache)
    share, volumes = skin_share(cell, mesh), element_volumes(mesh)
    # Away from the joints a strut along an axis has a core of radius 0.7. All three of them, since an element
    # is core or skin as a whole, and meshes without a seed scatter by 2 % over a single one.
    middle = mesh.nodes[mesh.corners].mean(axis=1)
    along = (middle > 2).any(axis=1)
    found = (share * volumes)[along].sum() / volumes[along].sum()
    assert found == pytest.approx(1 - 0.7**2, rel=0.03)
    assert share.min() == 0
    assert share.max() == 1

    stiff = effective_tensor(mesh, cell_materials(cell, mesh, 1.0, 0.3))
    plain = effective_tensor(
        mesh, cell_materials(StrutCell(cells.SIMPLE_CUBIC, 10.0, 1.0, 1.0), mesh, 1.0, 0.3)
    )
    # Struts along the load stretch core and skin alike.
    assert np.isclose(stiff.E100 / plain.E100, 1 + 1 - 0.7**2, rtol=0.05)
    twice = StrutCell(cells.SIMPLE_CUBIC, 10.0, 1.0, 1.0, skin_depth_mm=9.0, skin_factor=2.0)
    assert skin_share(twice, mesh) == pytest.approx(1)
    whole = effective_tensor(mesh, cell_materials(twice, mesh, 1.0, 0.3))
    assert np.allclose(whole.C, 2 * plain.C, rtol=1e-9, atol=0)


def test_a_mesh_turned_over_is_made_anew(monkeypatch: pytest.MonkeyPatch, cache: Path) -> None:
    asked = []

    def fail(*arguments: Any, **names: Any) -> Mesh:
        asked.append(names["epsilon_mm"])
        if len(asked) < 3:
            raise MeshingError("2 of 9 elements are inverted", "at x", "refine the mesh")
        return mesh_surface(*arguments, **names)

    monkeypatch.setattr(module, "mesh_surface", fail)
    assert len(mesh_cell(paper_cell(), COARSE, cache).tets)
    assert len(set(asked)) == len(asked) == 3
    asked.clear()
    monkeypatch.setattr(module, "_TRIES", (1.0, 0.8))
    with pytest.raises(MeshingError, match="inverted"):
        mesh_cell(paper_cell(), COARSE, cache)


@pytest.mark.parametrize(
    "given", [{"order": 3}, {"per_diameter": 0.1}, {"tolerance": 0.5}], ids=["order", "size", "tolerance"]
)
def test_settings_out_of_bounds_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(given))):
        CellMeshSettings(**given)
