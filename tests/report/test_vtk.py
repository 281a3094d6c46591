"""VTK files read back as what was written."""

import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest

from mu_addon.fem.state import State
from mu_addon.report.vtk import write_mesh, write_trajectory

from .test_unit_pictures import cube


@pytest.mark.parametrize(("order", "kind"), [(1, "tetra"), (2, "tetra10")])
def test_mesh(tmp_path, order, kind):
    mesh = cube(order)
    modulus = np.linspace(0.01, 3.0, 5)
    displacement = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    write_mesh(tmp_path / "mesh.vtu", mesh, modulus, displacement)
    read = meshio.read(tmp_path / "mesh.vtu")
    assert np.array_equal(read.points, mesh.nodes)
    assert np.array_equal(read.cells_dict[kind], mesh.tets)
    assert np.array_equal(read.cell_data["E_MPa"][0], modulus)
    assert np.array_equal(read.cell_data["region"][0], mesh.region)
    assert np.array_equal(read.point_data["displacement_mm"], displacement)
    assert b'compressor="vtkZLibDataCompressor"' in (tmp_path / "mesh.vtu").read_bytes()
    assert [p.name for p in tmp_path.iterdir()] == ["mesh.vtu"]
    if order == 2:
        # VTK's order: node 4 + i lies between the corners of edge i.
        tets = read.cells_dict[kind]
        for i, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
            middle = 0.5 * (read.points[tets[:, a]] + read.points[tets[:, b]])
            assert np.allclose(read.points[tets[:, 4 + i]], middle)


def test_trajectory_writes_a_pressure_once_and_removes_old_states(tmp_path):
    mesh = cube(2)
    rest, down, up = (State(p, np.full(mesh.nodes.shape, 100 * p)) for p in (0.0, -0.02, 0.04))
    (tmp_path / "model_a").mkdir()
    (tmp_path / "model_a" / "0007.vtu").write_text("old")
    write_trajectory(tmp_path / "model_a.pvd", mesh, [(0.0, rest), (1.0, down), (2.0, rest), (3.5, up)])
    sets = ET.parse(tmp_path / "model_a.pvd").getroot().findall("Collection/DataSet")
    assert [float(s.get("timestep")) for s in sets] == [0.0, 1.0, 2.0, 3.5]
    assert [s.get("name") for s in sets] == ["0 kPa", "-20 kPa", "0 kPa", "40 kPa"]
    files = [s.get("file") for s in sets]
    assert files[0] == files[2]
    assert sorted(p.name for p in (tmp_path / "model_a").iterdir()) == ["0000.vtu", "0001.vtu", "0002.vtu"]
    read = meshio.read(tmp_path / files[3])
    assert np.allclose(read.point_data["displacement_mm"], 4.0)
    assert np.array_equal(read.cell_data["region"][0], mesh.region)
