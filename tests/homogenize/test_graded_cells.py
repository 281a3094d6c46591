"""The polynomials for graded struts against cells meshed otherwise: pytetwild's, of the drawn facets."""

import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.design.strut_cell import StrutCell
from mu_addon.fem.graded_lattice import relative_moduli
from mu_addon.homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from mu_addon.homogenize.elasticity import effective_tensor

D = load_preset("mu-1.0x").printed


def moduli(factor):
    cell = StrutCell(D.kind, D.cell, 0.75 * factor, 1.0 * factor)
    mesh = mesh_cell(cell, CellMeshSettings(per_diameter=4.0))
    found = effective_tensor(mesh, cell_materials(cell, mesh, 1.0, 0.45))
    return np.array([found.E100, found.C[0, 1], found.C44])


@pytest.mark.nightly(
    "tests/fem/test_graded_lattice.py::test_slender_struts_bend_along_an_axis_and_stretch_in_shear"
)
def test_two_diameters_against_pytetwilds_cell():
    nominal = moduli(1.0)
    for factor in (0.75, 1.3):
        ratio = moduli(factor) / nominal
        known = np.ravel(relative_moduli(D, np.array([factor])))
        assert known == pytest.approx(ratio, rel=0.035)
